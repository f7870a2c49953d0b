//! Paint of a surface at a point: reflectance from noise pictures and box-filtered patterns, all
//! attached to the surface.

use super::car::{Shape, shape};
use super::config::CarKind;
use super::layout;
use super::pattern::{
    Painted, SurfacePoint, above, blend, shifted, stripes, survives, times, within,
};
use super::random::{cell, unit};
use super::surface::{Kind, Surface, Tone};
use super::texture::{Textures, floor};
use super::{car_paint, room_paint, window_paint};

/// Everything painting needs besides the position.
pub struct Painter {
    /// Noise.
    pub textures: Textures,
    shapes: [Shape; 5],
}

impl Painter {
    /// Draws the noise pictures.
    pub fn new() -> Self {
        Self { textures: Textures::new(), shapes: CarKind::ALL.map(shape) }
    }

    /// The paint at a point of a surface. `coat` is the paint of the object, if it has one.
    pub fn paint(&self, surface: &Surface, surface_point: &SurfacePoint, coat: Tone) -> Painted {
        match surface.kind {
            Kind::Road => self.road(surface, surface_point),
            Kind::Pavement => self.pavement(surface, surface_point),
            Kind::Kerb => self.kerb(surface, surface_point),
            Kind::Yard => self.yard(surface, surface_point),
            Kind::Plaster => self.plaster(surface, surface_point),
            Kind::Brick => self.masonry(surface, surface_point, &BRICKS),
            Kind::Stone => self.masonry(surface, surface_point, &STONES),
            Kind::Window => window_paint::window(self, surface, surface_point),
            Kind::Shop => window_paint::shop(self, surface, surface_point),
            Kind::Board => window_paint::board(self, surface, surface_point),
            Kind::Door => window_paint::door(self, surface, surface_point),
            Kind::Tiles => self.tiles(surface, surface_point),
            Kind::Plain => self.plain(surface, surface_point),
            Kind::Fence => self.fence(surface, surface_point),
            Kind::Bark => self.bark(surface, surface_point),
            Kind::Leaves => self.leaves(surface, surface_point),
            Kind::Sign => window_paint::sign(surface, surface_point),
            Kind::Car => car_paint::shell(
                self,
                &self.shapes[surface.size_m[0] as usize % 5],
                surface_point,
                coat,
            ),
            Kind::Wheel => car_paint::wheel(surface, surface_point),
            Kind::Indoor(indoor) => {
                room_paint::paint(&self.textures, indoor, surface, surface_point)
            }
        }
    }

    /// Fine noise at the point's first two coordinates, shifted by a seed.
    pub fn fine(&self, seed: u32, surface_point: &SurfacePoint, scale: f32) -> f32 {
        let (u, v) = shifted(seed, surface_point, 3.0);
        let [fu, fv, _] = surface_point.footprint_m;
        self.textures.fine.at(u * scale, v * scale, fu * scale, fv * scale)
    }

    /// Broad noise, likewise.
    pub fn broad(&self, seed: u32, surface_point: &SurfacePoint, scale: f32) -> f32 {
        let (u, v) = shifted(seed, surface_point, 24.0);
        let [fu, fv, _] = surface_point.footprint_m;
        self.textures.broad.at(u * scale, v * scale, fu * scale, fv * scale)
    }

    fn road(&self, surface: &Surface, surface_point: &SurfacePoint) -> Painted {
        let [s, d, _] = surface_point.surface_m;
        let [fs, fd, _] = surface_point.footprint_m;
        // Grain and stains of the asphalt, each filtered by the pixel's footprint.
        let fine = self.textures.asphalt.at(s, d, fs, fd);
        let broad = self.textures.broad.at(s, d, fs, fd);
        let mut shade = 1.0 + 0.50 * fine + 0.06 * broad;
        let mut tint = surface.tone;
        // Wheels polish two tracks in each lane; the gutter is dirty.
        let lane = (d - 1.6) * (1.0 / 3.2);
        let across = (lane - floor(lane) as f32 - 0.5).abs() * 3.2;
        if d > -8.0 && d < 1.6 {
            shade += 0.07 * within(0.45, 1.05, across, 0.4 + fd)
                - 0.06 * within(-0.3, 0.3, across, 0.4 + fd);
        } else {
            shade -= 0.10 + 0.05 * broad;
            shade -= 0.25 * (1.0 - within(-10.0, 3.6, d, 0.3 + fd));
        }
        let point = RoadPoint { s, d, fs, fd };
        self.repairs(surface.seed, point, broad, &mut shade);
        if let Some(lid) = manhole(surface.seed, point) {
            tint = blend(tint, [0.07, 0.065, 0.06], lid);
        }
        // Worn paint lets the asphalt through.
        let worn = (0.86 + 0.16 * broad + 0.10 * fine).clamp(0.25, 1.0);
        let marking = markings(surface.size_m[0] > 0.5, point) * worn;
        let painted =
            blend(times(tint, shade), times([0.72, 0.72, 0.68], 1.0 + 0.06 * fine), marking);
        Painted { tone: painted, gloss: 0.02, open: 1.0 }
    }

    /// Patches of newer asphalt and sealed cracks, at most one of each in every cell of 8 m by 3.5
    /// m.
    fn repairs(
        &self,
        seed: u32,
        RoadPoint { s, d, fs, fd }: RoadPoint,
        broad: f32,
        shade: &mut f32,
    ) {
        let (cs, cd) = (floor(s * 0.125), floor((d + 10.2) * (1.0 / 3.5)));
        let h = cell(seed.wrapping_mul(31), cs, cd);
        // Patches, cracks and seams come from one hash of each piece of road.
        let (ls, ld) = (s - cs as f32 * 8.0, d + 10.2 - cd as f32 * 3.5);
        // One piece in four has a patch, with a dark rim.
        if h & 3 == 0 {
            let (a, b) = (unit(h << 4), unit(h << 12));
            let (s0, s1) = (0.5 + 3.0 * a, 4.0 + 3.5 * b);
            let (d0, d1) = (0.2 + 1.2 * b, 2.0 + 1.3 * a);
            let inside = within(s0, s1, ls, fs) * within(d0, d1, ld, fd);
            let rim = inside
                - within(s0 + 0.05, s1 - 0.05, ls, fs) * within(d0 + 0.05, d1 - 0.05, ld, fd);
            *shade *= 1.0 - inside * (0.34 - 0.3 * unit(h << 18)) - 0.5 * rim;
        }
        if h & 12 == 4 {
            // A crack wanders like a sum of triangle waves.
            let wave = |x: f32| ((x - floor(x) as f32) - 0.5).abs() - 0.25;
            // Sums of triangle waves, not of sines: the same on every machine and cheap.
            let phase = unit(h << 7) * 10.0;
            let wander = 1.6 * wave(d * 0.31 + phase)
                + 0.5 * wave(d * 1.3 + phase)
                + 0.16 * wave(d * 4.7)
                + 0.05 * broad;
            let off = ls - (4.0 + 1.5 * wander);
            let crack = within(-0.025, 0.025, off, fs);
            *shade *= 1.0 - 0.55 * crack;
        }
        // A joint between two lanes of paving.
        let seam = within(-0.015, 0.015, d + 4.78 + 0.02 * broad, fd);
        *shade *= 1.0 - 0.35 * seam;
    }

    fn pavement(&self, surface: &Surface, surface_point: &SurfacePoint) -> Painted {
        let [s, d, _] = surface_point.surface_m;
        let [fs, fd, _] = surface_point.footprint_m;
        // Slabs of half a metre; every second row is shifted by half a slab.
        let (row, size) = (floor(d * 2.0), 0.5);
        let shifted = s + 0.25 * (row & 1) as f32;
        let column = floor(shifted * 2.0);
        let joint =
            1.0 - (1.0 - stripes(shifted, size, 0.012, fs)) * (1.0 - stripes(d, size, 0.012, fd));
        // Slabs differ in shade, which fades where a pixel covers many.
        let own = (unit(cell(surface.seed, column.rem_euclid(480), row)) - 0.5)
            * survives(size, fs.max(fd));
        let fine = self.fine(3, surface_point, 1.0);
        let broad = self.broad(4, surface_point, 1.0);
        let shade = 1.0 + 0.22 * fine + 0.10 * broad + 0.26 * own;
        Painted::dull(blend(times(surface.tone, shade), surface.second, 0.7 * joint))
    }

    fn kerb(&self, surface: &Surface, surface_point: &SurfacePoint) -> Painted {
        let [s, ..] = surface_point.surface_m;
        let [fs, ..] = surface_point.footprint_m;
        let joint = stripes(s, 1.0, 0.015, fs);
        let own = unit(cell(surface.seed, floor(s), 0)) - 0.5;
        let shade = 1.0
            + 0.16 * self.fine(6, surface_point, 1.3)
            + 0.3 * own * survives(1.0, fs)
            + 0.08 * self.broad(7, surface_point, 1.0);
        Painted::dull(blend(times(surface.tone, shade), surface.second, joint))
    }

    fn yard(&self, surface: &Surface, surface_point: &SurfacePoint) -> Painted {
        let broad = self.broad(8, surface_point, 1.0);
        let [u, v, _] = surface_point.surface_m;
        let [fu, fv, _] = surface_point.footprint_m;
        let blades = self.textures.leaves.at(u * 2.0, v * 2.0, 2.0 * fu, 2.0 * fv);
        let gravel = self.fine(9, surface_point, 1.0);
        let grass = times(surface.tone, 0.8 + 0.25 * blades + 0.15 * broad);
        let stones = times(surface.second, 1.0 + 0.3 * gravel);
        Painted::dull(blend(grass, stones, (0.25 - broad).clamp(0.0, 1.0)))
    }

    fn plaster(&self, surface: &Surface, surface_point: &SurfacePoint) -> Painted {
        let fine = self.fine(surface.seed, surface_point, 0.8);
        let broad = self.broad(surface.seed, surface_point, 1.0);
        // Rain draws streaks: noise stretched downwards.
        let (u, v) = shifted(surface.seed, surface_point, 24.0);
        let [fu, fv, _] = surface_point.footprint_m;
        let streak = self.textures.broad.at(u * 2.0, v * 0.18, 2.0 * fu, 0.18 * fv);
        let height = -surface_point.surface_m[1];
        let splash = ((0.9 - height) * 0.5).clamp(0.0, 0.35);
        let shade = 1.0 + 0.11 * fine + 0.06 * broad + 0.06 * streak - splash * (0.7 + 0.3 * broad);
        Painted::dull(times(surface.tone, shade))
    }

    /// Stones in running bond.
    fn masonry(&self, surface: &Surface, surface_point: &SurfacePoint, bond: &Bond) -> Painted {
        let &Bond { length, height, joint, spread } = bond;
        let [u, v, _] = surface_point.surface_m;
        let [fu, fv, _] = surface_point.footprint_m;
        // Every second row begins with half a stone.
        let row = floor(v / height);
        let along = u + 0.5 * length * (row & 1) as f32;
        let column = floor(along / length);
        let gap =
            1.0 - (1.0 - stripes(along, length, joint, fu)) * (1.0 - stripes(v, height, joint, fv));
        let h = cell(surface.seed, column, row);
        // Stones smaller than the footprint lose their own tone, so that far walls do not flicker.
        let kept = survives(length, fu) * survives(height, fv);
        let own = (unit(h) - 0.5) * 2.0 * spread * kept;
        let fine = self.fine(surface.seed, surface_point, 1.0);
        let broad = self.broad(surface.seed, surface_point, 1.0);
        let shade = 1.0 + own + 0.15 * fine + 0.07 * broad;
        let mut tone = times(surface.tone, shade);
        // A few burnt stones.
        tone[0] *= 1.0 + 0.15 * kept * (unit(h << 9) - 0.5);
        Painted::dull(blend(tone, times(surface.second, 1.0 + 0.06 * fine), gap))
    }

    fn tiles(&self, surface: &Surface, surface_point: &SurfacePoint) -> Painted {
        let [u, v, _] = surface_point.surface_m;
        let [fu, fv, _] = surface_point.footprint_m;
        let (wide, tall) = (0.24, 0.32);
        let (row, column) = (floor(v / tall), floor(u / wide));
        // The shadow under each tile's edge, and the rounding of its side.
        let lip = stripes(v, tall, 0.05, fv);
        let roll = stripes(u, wide, 0.07, fu);
        let own = (unit(cell(surface.seed, column, row)) - 0.5) * survives(wide, fu.max(fv)) * 0.45;
        let shade = 1.0
            + own
            + 0.10 * self.fine(surface.seed, surface_point, 1.0)
            + 0.14 * self.broad(surface.seed, surface_point, 1.0)
            - 0.5 * lip
            - 0.2 * roll;
        Painted::dull(times(surface.tone, shade))
    }

    fn plain(&self, surface: &Surface, surface_point: &SurfacePoint) -> Painted {
        let shade = 1.0
            + 0.05 * self.fine(surface.seed, surface_point, 1.0)
            + 0.06 * self.broad(surface.seed, surface_point, 2.0);
        Painted { tone: times(surface.tone, shade), gloss: 0.04, open: 1.0 }
    }

    fn fence(&self, surface: &Surface, surface_point: &SurfacePoint) -> Painted {
        let [u, ..] = surface_point.surface_m;
        let [fu, ..] = surface_point.footprint_m;
        let shade = 1.0
            + 0.10 * self.fine(surface.seed, surface_point, 1.0)
            + 0.05 * self.broad(surface.seed, surface_point, 1.0);
        if surface.second != surface.tone {
            // Cloth: two tones in turn.
            let share = stripes(u, 0.6, 0.3, fu);
            return Painted::dull(times(blend(surface.tone, surface.second, share), shade));
        }
        let gap = stripes(u, 0.13, 0.016, fu);
        let own = (unit(cell(surface.seed, floor(u / 0.13), 0)) - 0.5) * 0.3 * survives(0.13, fu);
        Painted::dull(times(surface.tone, (shade + own) * (1.0 - 0.7 * gap)))
    }

    fn bark(&self, surface: &Surface, surface_point: &SurfacePoint) -> Painted {
        let (u, v) = shifted(surface.seed, surface_point, 3.0);
        let [fu, fv, _] = surface_point.footprint_m;
        let ridges = self.textures.fine.at(u * 2.0, v * 0.4, 2.0 * fu, 0.4 * fv);
        Painted::dull(times(surface.tone, 1.0 + 0.35 * ridges))
    }

    fn leaves(&self, surface: &Surface, surface_point: &SurfacePoint) -> Painted {
        let [u, v, _] = surface_point.surface_m;
        let [fu, fv, _] = surface_point.footprint_m;
        let leaf = self.textures.leaves.at(u, v, fu, fv);
        let mut tone = times(surface.tone, (0.85 + 0.34 * leaf).max(0.2));
        tone[0] *= 1.0 + 0.12 * leaf;
        Painted { tone, gloss: 0.02, open: 1.0 }
    }
}

/// Running bond of stones, m.
struct Bond {
    length: f32,
    height: f32,
    joint: f32,
    /// Spread of the stones' tones.
    spread: f32,
}

const BRICKS: Bond = Bond { length: 0.25, height: 0.085, joint: 0.012, spread: 0.20 };
const STONES: Bond = Bond { length: 0.72, height: 0.36, joint: 0.018, spread: 0.10 };

/// A point of the road and the size of the pixel that looks at it, m: along the street and across.
#[derive(Clone, Copy)]
struct RoadPoint {
    s: f32,
    d: f32,
    fs: f32,
    fd: f32,
}

/// Share of a manhole's lid in the footprint, if one is near.
fn manhole(seed: u32, RoadPoint { s, d, fs, fd }: RoadPoint) -> Option<f32> {
    let (cs, cd) = (floor(s * (1.0 / 6.0)), floor((d + 9.6) * (1.0 / 3.2)));
    let h = cell(seed ^ 0x77, cs, cd);
    if !h.is_multiple_of(5) {
        return None;
    }
    let (x, y) = (s - cs as f32 * 6.0 - 1.0 - 4.0 * unit(h << 5), d + 9.6 - cd as f32 * 3.2 - 1.6);
    let radius = (x * x + y * y).sqrt();
    // A long footprint spreads the lid along the street.
    let soft = fs.min(0.6).max(fd);
    let lid = 1.0 - above(0.33, radius, soft);
    let ring = within(0.29, 0.33, radius, soft);
    let pattern = stripes(x + y, 0.08, 0.03, fs + fd);
    Some((lid * (0.55 + 0.35 * pattern) + 0.4 * ring).min(1.0))
}

/// Share of white paint in the footprint.
fn markings(crossing: bool, RoadPoint { s, d, fs, fd }: RoadPoint) -> f32 {
    let half = 0.06;
    let line = |at: f32| within(at - half, at + half, d, fd);
    let lane = layout::LANE_M as f32;
    // Dashes and lines by their lane, then bays, then the crossing, which replaces them all.
    let mut share = line(0.5 * lane).max(line(-2.5 * lane)) * stripes(s, 2.0, 1.0, fs);
    share = share.max(line(-0.5 * lane) * stripes(s + 1.5, 8.0, 3.0, fs));
    let twin = line(-1.5 * lane - 0.12).max(line(-1.5 * lane + 0.12));
    share = share.max(twin);
    // Parking bays.
    let bays = within(0.5 * lane, 3.75, d, fd).max(within(-10.15, -2.5 * lane, d, fd));
    share = share.max(bays * stripes(s + 0.05, 6.0, 0.1, fs));
    if crossing {
        let middle = layout::CROSSING_M as f32;
        let zone = within(middle - 3.6, middle + 3.6, s, fs);
        let bars = stripes(d + 0.2, 1.0, 0.5, fd) * within(middle - 1.7, middle + 1.7, s, fs);
        let stops =
            within(-1.5 * lane, 0.5 * lane, d, fd) * within(middle - 3.4, middle - 3.0, s, fs);
        share = share * (1.0 - zone) + (bars + stops).min(1.0);
    }
    share
}
