//! A car's shell, painted by position: glass, lamps, grille, plates, joints.

use super::car::Shape;
use super::paint::Painter;
use super::pattern::{Painted, SurfacePoint, above, blend, stripes, times, within};
use super::random::cell;
use super::surface::{Surface, Tone};
use super::texture::floor;

const GLASS: Tone = [0.022, 0.028, 0.034];
const BLACK: Tone = [0.018, 0.018, 0.02];

/// A point on the shell: right, up, forward, and the footprint there.
struct BodyPoint {
    x: f32,
    up: f32,
    z: f32,
    f: f32,
}

/// The shell.
pub fn shell(
    painter: &Painter,
    shape: &Shape,
    surface_point: &SurfacePoint,
    coat: Tone,
) -> Painted {
    let [x, y, z] = surface_point.surface_m;
    let [fx, fy, fz] = surface_point.footprint_m;
    let point = BodyPoint { x, up: -y, z, f: fx.max(fy).max(fz).max(0.002) };
    let [nx, ny, nz] = surface_point.own_normal;
    let side = above(0.55, nx.abs(), 0.1);
    let speck = painter.textures.fine.at(z * 0.7 + x, y * 0.7 + x, 0.7 * point.f, 0.7 * point.f);
    let dirt = 0.25 * (1.0 - above(0.45, point.up, 0.4));
    let mut tone = blend(times(coat, 1.0 + 0.06 * speck), [0.10, 0.09, 0.08], dirt);
    let mut gloss = 0.30;
    // Joints of doors are seen on the sides only.
    if side > 0.0 {
        tone = blend(tone, times(coat, 0.22), joints(shape, &point) * side);
    }
    // The strip below the doors and the bumpers' lower edge are black.
    tone = blend(tone, BLACK, 1.0 - above(0.30, point.up, point.f));
    // Wheel arches are dark discs, a little larger than the wheels.
    for axle in shape.axles_m {
        let radius = ((z - axle) * (z - axle)
            + (point.up - shape.wheel_m) * (point.up - shape.wheel_m))
            .sqrt();
        let arch = (1.0 - above(shape.wheel_m + 0.055, radius, point.f))
            * above(0.6, x.abs() / shape.half_m[1], 0.1);
        tone = blend(tone, BLACK, arch);
    }
    // Glass mirrors the sky above and the street below.
    let glass = glass(shape, &point, side, nz);
    if glass > 0.0 {
        let sky = 0.06 * (0.5 - 0.5 * ny).max(0.0)
            + 0.05 * above(shape.side_height_m[0] + 0.2, point.up, 0.2);
        tone = blend(tone, blend(GLASS, [0.45, 0.52, 0.62], sky), glass);
        gloss += 0.20 * glass;
    }
    // Lamps, grille and plates are painted on the last 60 cm of either end.
    if z.abs() > shape.half_m[0] - 0.6 {
        let ends = if z > 0.0 { front(shape, &point) } else { rear(shape, &point) };
        for (share, paint) in ends {
            tone = blend(tone, paint, share);
        }
    }
    Painted { tone, gloss, open: 1.0 }
}

/// Edges of doors, handles.
fn joints(shape: &Shape, p: &BodyPoint) -> f32 {
    let [front, rear, ..] = shape.side_glass_m;
    let low = above(0.32, p.up, p.f) * (1.0 - above(shape.side_height_m[0] + 0.02, p.up, p.f));
    let line = |at: f32| within(at - 0.008, at + 0.008, p.z, p.f);
    // A shape without a middle pillar has it far outside.
    let middle = if shape.pillars_m[0] < 5.0 { shape.pillars_m[0] } else { -0.2 };
    // A line at the front door, one between the doors, one behind.
    let doors = line(front - 0.02).max(line(middle)).max(line((rear + 0.15).max(middle - 0.85)));
    let handle = |at: f32| {
        within(at, at + 0.16, p.z, p.f) * within(-0.11, -0.085, p.up - shape.side_height_m[0], p.f)
    };
    let crease = 0.35 * within(-0.30, -0.285, p.up - shape.side_height_m[0], p.f);
    (doors * low)
        .max(handle(middle + 0.05))
        .max(handle((rear + 0.25).max(middle - 0.8)))
        .max(crease)
}

fn glass(shape: &Shape, p: &BodyPoint, side: f32, nz: f32) -> f32 {
    let [belt, roof] = shape.side_height_m;
    let along = |low: f32, high: f32, at: f32, from: f32, to: f32| {
        low + (high - low) * (at - from) / (to - from)
    };
    let mut share: f32 = 0.0;
    // Side windows: a trapezium between belt and roof, divided by pillars.
    if p.up > belt - 0.1 && side > 0.0 {
        let [front, rear, front_top, rear_top] = shape.side_glass_m;
        let (head, tail) =
            (along(front, front_top, p.up, belt, roof), along(rear, rear_top, p.up, belt, roof));
        let mut pane = within(belt, roof, p.up, p.f) * within(tail, head, p.z, p.f) * side;
        for pillar in shape.pillars_m {
            pane *= 1.0 - within(pillar - 0.035, pillar + 0.035, p.z, p.f);
        }
        share = share.max(pane);
    }
    // Windscreen and rear window, on the parts of the shell that face forward or back.
    for (facing, [low, high, wide, narrow]) in [(nz, shape.windscreen_m), (-nz, shape.rear_glass_m)]
    {
        let toward = above(0.25, facing, 0.1);
        if toward > 0.0 && p.up > low - 0.1 {
            let half = along(wide, narrow, p.up, low, high);
            share =
                share.max(within(low, high, p.up, p.f) * within(-half, half, p.x, p.f) * toward);
        }
    }
    share
}

fn front(shape: &Shape, p: &BodyPoint) -> [(f32, Tone); 5] {
    // Lamps reach around the corner, the grille lies on the nose only.
    let depth = above(shape.half_m[0] - 0.45, p.z, 0.05);
    let nose = above(shape.half_m[0] - 0.14, p.z, 0.05);
    let (half, lamp) = (shape.half_m[1], shape.lamps_m[0]);
    let away = p.x.abs();
    // Each figure is a product of soft bounds: at any distance it fades by the pixel's footprint.
    let lamps = depth
        * within(lamp - 0.075, lamp + 0.065, p.up, p.f)
        * within(0.60 * half, 0.97 * half, away, p.f);
    let core = depth
        * within(lamp - 0.045, lamp + 0.04, p.up, p.f)
        * within(0.66 * half, 0.86 * half, away, p.f);
    let grille =
        nose * within(lamp - 0.10, lamp + 0.03, p.up, p.f) * (1.0 - above(0.50 * half, away, p.f));
    let ribs = 0.5 + 0.5 * stripes(p.up, 0.05, 0.02, p.f);
    let intake = nose * within(0.27, 0.38, p.up, p.f) * (1.0 - above(0.72 * half, away, p.f));
    let plate = nose * within(0.42, 0.53, p.up, p.f) * (1.0 - above(0.26, away, p.f));
    [
        (lamps, [0.10, 0.10, 0.11]),
        (core, [0.75, 0.77, 0.80]),
        (grille * ribs, BLACK),
        (intake, BLACK),
        (plate, plate_tone(p)),
    ]
}

fn rear(shape: &Shape, p: &BodyPoint) -> [(f32, Tone); 5] {
    // Behind, the same figures with their measures from the rear end.
    let depth = 1.0 - above(-shape.half_m[0] + 0.30, p.z, 0.05);
    let tail = 1.0 - above(-shape.half_m[0] + 0.14, p.z, 0.05);
    let (half, lamp) = (shape.half_m[1], shape.lamps_m[1]);
    let away = p.x.abs();
    let lamps = depth * within(lamp - 0.13, lamp + 0.09, p.up, p.f) * above(0.64 * half, away, p.f);
    let reverse = depth
        * within(lamp - 0.06, lamp - 0.02, p.up, p.f)
        * within(0.66 * half, 0.90 * half, away, p.f);
    let lid = depth * within(0.62, 0.635, p.up, p.f) * (1.0 - above(0.8 * half, away, p.f));
    let plate =
        depth * within(lamp - 0.16, lamp - 0.05, p.up, p.f) * (1.0 - above(0.26, away, p.f));
    let skirt = tail * within(0.28, 0.40, p.up, p.f) * (1.0 - above(0.75 * half, away, p.f));
    [
        (lamps, [0.42, 0.015, 0.015]),
        (reverse, [0.6, 0.55, 0.55]),
        (lid, [0.03; 3]),
        (plate, plate_tone(p)),
        (skirt, BLACK),
    ]
}

fn plate_tone(p: &BodyPoint) -> Tone {
    // Glyphs of their own width each, a gap after the third.
    let number = floor((p.x + 0.26) / 0.065);
    let h = cell(0xCA2, number, 0);
    let at = p.x + 0.26 - number as f32 * 0.065;
    let stroke = within(0.010, 0.022, at, p.f).max(within(0.036, 0.048, at, p.f) * (h & 1) as f32);
    let ink = if number == 3 || number == 0 { 0.0 } else { stroke };
    blend([0.72, 0.72, 0.68], BLACK, 0.8 * ink)
}

/// A wheel's side in coordinates -1..1: tyre, spokes, hub.
pub fn wheel(surface: &Surface, surface_point: &SurfacePoint) -> Painted {
    let [x, y, _] = surface_point.surface_m;
    let f = surface_point.footprint_m[0].max(surface_point.footprint_m[1]);
    let radius = (x * x + y * y).sqrt();
    // Five spokes: the largest of five projections.
    let spoke = [(1.0, 0.0), (0.309, 0.951), (-0.809, 0.588), (-0.809, -0.588), (0.309, -0.951)]
        .map(|(a, b): (f32, f32)| (x * a + y * b, (x * b - y * a).abs()))
        .into_iter()
        .map(|(along, off)| if along > 0.0 { 1.0 - above(0.10, off, f) } else { 0.0 })
        .fold(0.0, f32::max);
    let hub = 1.0 - above(0.18, radius, f);
    let ring = within(0.58, 0.68, radius, f);
    let metal = spoke.max(hub).max(ring) * (1.0 - above(0.68, radius, f));
    let tone = blend([0.025; 3], surface.tone, metal);
    Painted { tone, gloss: 0.05 * metal, open: 1.0 }
}
