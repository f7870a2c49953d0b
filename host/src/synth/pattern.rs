//! Patterns that surfaces are painted with, each filtered over a pixel's footprint.

use super::random::{cell, unit};
use super::surface::Tone;
use super::texture::floor;

/// A point on a surface and the size of a pixel there.
pub struct SurfacePoint {
    /// Surface coordinates, m.
    pub surface_m: [f32; 3],
    /// Extent of a pixel along each of them, lens included, m: twice the kernel's deviation.
    pub footprint_m: [f32; 3],
    /// Normal in the object's own frame.
    pub own_normal: [f32; 3],
}

/// Colour and brightness of a painted point.
#[derive(Clone, Copy)]
pub struct Painted {
    /// Linear reflectance.
    pub tone: Tone,
    /// Share of light mirrored at grazing view.
    pub gloss: f32,
    /// Share of the sky the surface's own relief leaves open.
    pub open: f32,
}

impl Painted {
    /// A dull surface.
    pub fn dull(tone: Tone) -> Self {
        Self { tone, gloss: 0.0, open: 1.0 }
    }
}

/// Width of the kernel over a footprint: a parabola so wide has a deviation of half of it.
const KERNEL_PX: f32 = 2.236;

/// Share of a pixel's light from above an edge.
#[inline]
pub fn above(edge: f32, x: f32, footprint: f32) -> f32 {
    let at = ((x - edge) / (KERNEL_PX * footprint + 1e-4) + 0.5).clamp(0.0, 1.0);
    at * at * (3.0 - 2.0 * at)
}

/// Share of a pixel's light from between two edges.
#[inline]
pub fn within(from: f32, to: f32, x: f32, footprint: f32) -> f32 {
    (above(from, x, footprint) - above(to, x, footprint)).max(0.0)
}

/// Share of a pixel's light from the stripes 0..width of every period.
#[inline]
pub fn stripes(x: f32, period: f32, width: f32, footprint: f32) -> f32 {
    let half = 0.5 * (footprint + 1e-4);
    let per = 1.0 / period;
    let sum = |x: f32| {
        let count = x * per;
        let periods = floor(count) as f32;
        periods * width + ((count - periods) * period).min(width)
    };
    // Three boxes as wide as the footprint, half of it apart, have the kernel's deviation.
    let (near, far) = (sum(x + half) - sum(x - half), sum(x + 2.0 * half) - sum(x - 2.0 * half));
    (near + far) / (6.0 * half)
}

/// One tone blended towards another.
#[inline]
pub fn blend(a: Tone, b: Tone, share: f32) -> Tone {
    [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share, a[2] + (b[2] - a[2]) * share]
}

/// A tone under a factor, never below nothing.
#[inline]
pub fn times(tone: Tone, factor: f32) -> Tone {
    let factor = factor.max(0.02);
    [tone[0] * factor, tone[1] * factor, tone[2] * factor]
}

/// Returns the share of a detail's contrast that survives a footprint.
#[inline]
pub fn survives(size: f32, footprint: f32) -> f32 {
    (1.5 - footprint / size).clamp(0.0, 1.0)
}

/// Patches of random tone: their size along and down, m.
#[derive(Clone, Copy)]
pub struct Patches {
    /// Chooses the tones.
    pub seed: u32,
    /// Size of one, m.
    pub size_m: [f32; 2],
}

impl Patches {
    /// Tone at a point, -1 to 1 and 0 in the mean; fades where a pixel covers many patches.
    pub fn at(&self, [u, v]: [f32; 2], [fu, fv]: [f32; 2]) -> f32 {
        let [wide, tall] = self.size_m;
        // The nearest edge of either direction, and the share of light from beyond it.
        let axis = |x: f32, size: f32, footprint: f32| {
            let before = floor(x / size - 0.5);
            (before, above((before + 1) as f32 * size, x, footprint))
        };
        let ((column, right), (row, down)) = (axis(u, wide, fu), axis(v, tall, fv));
        let tone = |du: i32, dv: i32| {
            2.0 * unit(cell(self.seed, column.wrapping_add(du), row.wrapping_add(dv))) - 1.0
        };
        let top = tone(0, 0) + (tone(1, 0) - tone(0, 0)) * right;
        let bottom = tone(0, 1) + (tone(1, 1) - tone(0, 1)) * right;
        (top + (bottom - top) * down) * survives(wide, fu) * survives(tall, fv)
    }
}

/// Surface coordinates shifted by a seed within a tile.
pub fn shifted(seed: u32, surface_point: &SurfacePoint, tile_m: f32) -> (f32, f32) {
    (
        surface_point.surface_m[0] + unit(seed.wrapping_mul(0x9E37_79B1)) * tile_m,
        surface_point.surface_m[1] + unit(seed.wrapping_mul(0x85EB_CA77)) * tile_m,
    )
}
