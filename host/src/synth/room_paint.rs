//! Paint of walls, floors, furniture and clothes: patterns of a hand's size and less, for cameras
//! that are a few metres away.

use super::pattern::{Painted, Patches, SurfacePoint, blend, shifted, stripes, times, within};
use super::surface::{Indoor, Surface, Tone};
use super::texture::Textures;

/// Width of a picture's frame, m.
const FRAME_M: f32 = 0.035;

/// The paint of an indoor surface at a point.
pub fn paint(
    textures: &Textures,
    indoor: Indoor,
    surface: &Surface,
    surface_point: &SurfacePoint,
) -> Painted {
    let brush = Brush::new(textures, surface, surface_point);
    match indoor {
        Indoor::Wall => brush.wall(),
        Indoor::Wallpaper => brush.wallpaper(),
        Indoor::Boards => brush.boards(),
        Indoor::Rug => brush.rug(),
        Indoor::Wood => brush.wood(),
        Indoor::Folders => brush.folders(),
        Indoor::Picture => brush.picture(),
        Indoor::Cloth => brush.cloth(),
    }
}

/// A surface and the point on it.
struct Brush<'a> {
    textures: &'a Textures,
    surface: &'a Surface,
    /// Surface coordinates, m.
    at: [f32; 2],
    /// Surface coordinates, shifted by the surface's seed, m.
    noise_at: [f32; 2],
    footprint: [f32; 2],
}

impl<'a> Brush<'a> {
    fn new(textures: &'a Textures, surface: &'a Surface, surface_point: &SurfacePoint) -> Self {
        let ([u, v, _], [fu, fv, _]) = (surface_point.surface_m, surface_point.footprint_m);
        let (su, sv) = shifted(surface.seed, surface_point, 24.0);
        Self { textures, surface, at: [u, v], noise_at: [su, sv], footprint: [fu, fv] }
    }

    /// Fine noise, stretched along either coordinate.
    fn fine(&self, scale: [f32; 2]) -> f32 {
        let ([u, v], [fu, fv]) = (self.noise_at, self.footprint);
        self.textures.fine.at(u * scale[0], v * scale[1], fu * scale[0], fv * scale[1])
    }

    /// Broad noise.
    fn broad(&self, scale: f32) -> f32 {
        let ([u, v], [fu, fv]) = (self.noise_at, self.footprint);
        self.textures.broad.at(u * scale, v * scale, fu * scale, fv * scale)
    }

    /// Random patches of a size, m; `layer` tells layers of one surface apart.
    fn patches(&self, layer: u32, size_m: [f32; 2]) -> f32 {
        let seed = self.surface.seed ^ layer.wrapping_mul(0x9E37_79B1);
        Patches { seed, size_m }.at(self.at, self.footprint)
    }

    fn wall(&self) -> Painted {
        let contrast = self.surface.size_m[0];
        let shade = 1.0
            + contrast * (0.13 * self.fine([1.5, 1.5]) + 0.06 * self.fine([0.4, 0.4]))
            + (0.01 + 0.05 * contrast) * self.broad(1.0);
        Painted::dull(times(self.surface.tone, shade))
    }

    fn wallpaper(&self) -> Painted {
        // Two sizes of print, one for near views and one for far ones.
        let motifs = self.patches(1, [0.11, 0.14]) + 0.7 * self.patches(2, [0.031, 0.043]);
        let share = (0.5 + 0.6 * motifs).clamp(0.0, 1.0);
        let line = stripes(self.at[0], 0.27, 0.02, self.footprint[0]);
        let tone = blend(self.surface.tone, self.surface.second, 0.75 * share);
        let shade = 1.0 - 0.25 * line + 0.07 * self.fine([2.0, 2.0]);
        Painted::dull(times(tone, shade))
    }

    fn boards(&self) -> Painted {
        let ([u, v], [fu, fv]) = (self.at, self.footprint);
        // Every board begins elsewhere: rows are shifted by a third.
        let own = self.patches(1, [1.35, 0.12]);
        let row = (v / 0.12).floor();
        let joint = 1.0
            - (1.0 - stripes(v, 0.12, 0.003, fv))
                * (1.0 - stripes(u + 0.45 * row, 1.35, 0.003, fu));
        let grain = self.fine([0.35, 3.0]);
        let shade = 1.0 + 0.18 * own + 0.14 * grain + 0.05 * self.fine([2.0, 2.0]);
        let tone = blend(times(self.surface.tone, shade), [0.03, 0.025, 0.02], 0.7 * joint);
        Painted { tone, gloss: 0.02, open: 1.0 }
    }

    fn rug(&self) -> Painted {
        let share = 0.5 + 0.5 * self.patches(1, [0.16, 0.16]) + 0.4 * self.patches(2, [0.05, 0.05]);
        let tone = blend(self.surface.tone, self.surface.second, share.clamp(0.0, 1.0));
        Painted::dull(times(tone, 1.0 + 0.16 * self.fine([2.5, 2.5])))
    }

    fn wood(&self) -> Painted {
        // Fibres are long along the grain and short across it.
        let grain = self.fine([0.3, 2.6]) + 0.5 * self.fine([0.8, 0.8]);
        let shade = 1.0 + 0.17 * grain + 0.05 * self.broad(2.0);
        Painted { tone: times(self.surface.tone, shade), gloss: 0.03, open: 1.0 }
    }

    fn folders(&self) -> Painted {
        let ([u, v], [fu, fv]) = (self.at, self.footprint);
        let size = [0.036, 10.0];
        // A back is one patch: rows of folders are as high as one.
        let back = [1, 2, 3].map(|layer| self.patches(layer, size));
        let tone: Tone =
            [0, 1, 2].map(|k| (self.surface.tone[k] * (1.0 + 0.85 * back[k])).max(0.02));
        // A gap between neighbours, and two bands with a title.
        let gap = stripes(u + 0.0015, 0.036, 0.003, fu);
        let title = within(0.05, 0.08, v, fv) + within(0.15, 0.16, v, fv);
        let letters = 0.5 + 0.5 * self.patches(4, [0.012, 0.006]);
        let tone = blend(tone, self.surface.second, 0.6 * title * letters);
        let shade = (1.0 - 0.75 * gap) * (1.0 + 0.08 * self.fine([2.0, 2.0]));
        Painted::dull(times(tone, shade))
    }

    fn picture(&self) -> Painted {
        let ([u, v], [fu, fv]) = (self.at, self.footprint);
        let [wide, tall] = self.surface.size_m;
        let inside =
            within(FRAME_M, wide - FRAME_M, u, fu) * within(FRAME_M, tall - FRAME_M, v, fv);
        // Three layers of patches for each channel, large to small.
        let channel = |k: u32| {
            let sum = 0.5 * self.patches(3 * k + 1, [wide / 3.0, tall / 4.0])
                + 0.4 * self.patches(3 * k + 2, [wide / 11.0, tall / 9.0])
                + 0.3 * self.patches(3 * k + 3, [0.017, 0.013]);
            (0.36 + 0.4 * sum).clamp(0.02, 0.9)
        };
        let tone = [channel(1), channel(2), channel(3)];
        let frame = times(self.surface.second, 1.0 + 0.12 * self.fine([2.0, 2.0]));
        Painted { tone: blend(frame, tone, inside), gloss: 0.02, open: 1.0 }
    }

    fn cloth(&self) -> Painted {
        // Large enough to be tracked from across a room.
        let weave = self.patches(1, [0.045, 0.06]) + 0.7 * self.patches(2, [0.014, 0.017]);
        let share = (0.5 + 0.55 * weave).clamp(0.0, 1.0);
        let tone = blend(self.surface.tone, self.surface.second, 0.8 * share);
        Painted::dull(times(tone, 1.0 + 0.1 * self.fine([2.0, 2.0])))
    }
}
