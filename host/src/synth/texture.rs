//! Noise pictures with every reduction in both directions (a "ripmap"): one look-up gives the mean
//! over a footprint that may be long and thin, so that grazing asphalt neither flickers nor blurs
//! sideways.
//!
//! Memory: 2 B x (2 x side)² per picture, 2 MiB at 512. Time: one look-up reads 4 to 16 values.

use super::random::{Rng, cell, unit};

const LOG: usize = 9;
const SIDE: usize = 1 << LOG;
const ONE: f32 = 4096.0;

/// A tile of noise with mean 0 and standard deviation 1.
pub struct Ripmap {
    /// All levels one after the other, rows of the picture outermost.
    texels: Vec<i16>,
    /// Start of each level in the pixels.
    starts: [u32; (LOG + 1) * (LOG + 1)],
    /// Texels a metre.
    texels_per_m: f32,
}

impl Ripmap {
    fn new(mut base: Vec<f32>, tile_m: f32) -> Self {
        // Mean 0 and deviation 1, so that strengths mean the same for all textures.
        let mean = base.iter().sum::<f32>() / base.len() as f32;
        base.iter_mut().for_each(|value| *value -= mean);
        let deviation =
            (base.iter().map(|value| value * value).sum::<f32>() / base.len() as f32).sqrt();
        base.iter_mut().for_each(|value| *value /= deviation);
        let mut texels: Vec<i16> = Vec::with_capacity(4 * SIDE * SIDE);
        let mut starts = [0; (LOG + 1) * (LOG + 1)];
        let mut column = base;
        // Every pair of levels in u and v: surfaces are seen at a slant, with unlike sizes along
        // and across.
        for lv in 0..=LOG {
            let mut row = column.clone();
            for lu in 0..=LOG {
                starts[lv * (LOG + 1) + lu] = texels.len() as u32;
                texels.extend(row.iter().map(|value| (value.clamp(-7.9, 7.9) * ONE) as i16));
                if lu < LOG {
                    row = row.chunks_exact(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
                }
            }
            if lv < LOG {
                let pairs = column.chunks_exact(2 * SIDE);
                column = pairs
                    .flat_map(|two| (0..SIDE).map(|k| 0.5 * (two[k] + two[SIDE + k])))
                    .collect();
            }
        }
        Self { texels, starts, texels_per_m: SIDE as f32 / tile_m }
    }

    /// Fine noise of equal strength at every scale, a little more at the finest.
    pub fn grain(seed: u32, tile_m: f32, tilt: f32) -> Self {
        let mut base = vec![0.0_f32; SIDE * SIDE];
        let mut strength = 1.0;
        // From 4 cells a side to one a texel.
        for octave in 2..=LOG as u32 {
            let cells = 1_i32 << octave;
            let step = SIDE as i32 / cells;
            for y in 0..SIDE as i32 {
                for x in 0..SIDE as i32 {
                    let (cx, cy) = (x / step, y / step);
                    let (fx, fy) =
                        ((x % step) as f32 / step as f32, (y % step) as f32 / step as f32);
                    // Smoothed at the cells' edges, so that no grid shows.
                    let (fx, fy) = (fx * fx * (3.0 - 2.0 * fx), fy * fy * (3.0 - 2.0 * fy));
                    let at = |dx: i32, dy: i32| {
                        unit(cell(seed ^ octave, (cx + dx) % cells, (cy + dy) % cells)) - 0.5
                    };
                    let top = at(0, 0) * (1.0 - fx) + at(1, 0) * fx;
                    let bottom = at(0, 1) * (1.0 - fx) + at(1, 1) * fx;
                    base[y as usize * SIDE + x as usize] +=
                        strength * (top * (1.0 - fy) + bottom * fy);
                }
            }
            strength *= tilt;
        }
        Self::new(base, tile_m)
    }

    /// Many small leaves on each other, each of a tone of its own.
    pub fn foliage(seed: u64, tile_m: f32) -> Self {
        let mut base = vec![-1.5_f32; SIDE * SIDE];
        let mut rng = Rng::new(seed, 0x1EAF, 0);
        for k in 0..5200 {
            let (x, y) = (rng.between(0.0, SIDE as f64), rng.between(0.0, SIDE as f64));
            let (long, short) = (rng.between(9.0, 17.0), rng.between(4.0, 7.0));
            let angle = rng.between(0.0, core::f64::consts::PI);
            let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
            // Later leaves lie on top and in the light.
            let tone = rng.between(-1.0, 1.0) + 1.2 * (k as f64 / 5200.0);
            let reach = long as i32 + 1;
            for dy in -reach..=reach {
                for dx in -reach..=reach {
                    let (fx, fy) = (f64::from(dx), f64::from(dy));
                    let (a, b) =
                        ((fx * cosine + fy * sine) / long, (fy * cosine - fx * sine) / short);
                    if a * a + b * b < 1.0 {
                        let column = (x as i32 + dx).rem_euclid(SIDE as i32) as usize;
                        let row = (y as i32 + dy).rem_euclid(SIDE as i32) as usize;
                        base[row * SIDE + column] = (tone + 0.5 * b) as f32;
                    }
                }
            }
        }
        Self::new(base, tile_m)
    }

    /// Mean noise around (`u_m`, `v_m`) over a footprint.
    pub fn at(&self, u_m: f32, v_m: f32, footprint_u_m: f32, footprint_v_m: f32) -> f32 {
        // Places in 1/256 texel: the whole look-up is integer arithmetic.
        let scale = 256.0 * self.texels_per_m;
        let (u, v) = ((u_m * scale) as i32, (v_m * scale) as i32);
        let (lu, fu) = level(footprint_u_m * self.texels_per_m);
        let (lv, fv) = level(footprint_v_m * self.texels_per_m);
        let mut value = self.bilinear(lu, lv, u, v);
        if fu > 0.0 {
            value += (self.bilinear(lu + 1, lv, u, v) - value) * fu;
        }
        if fv > 0.0 {
            let mut coarse = self.bilinear(lu, lv + 1, u, v);
            if fu > 0.0 {
                coarse += (self.bilinear(lu + 1, lv + 1, u, v) - coarse) * fu;
            }
            value += (coarse - value) * fv;
        }
        value
    }

    #[inline]
    fn bilinear(&self, lu: usize, lv: usize, u: i32, v: i32) -> f32 {
        let picture =
            &self.texels[self.starts[lv * (LOG + 1) + lu] as usize..][..1 << (2 * LOG - lu - lv)];
        let (wide, tall) = (LOG - lu, LOG - lv);
        // Texels are centred on halves.
        let (u, v) = ((u >> lu) - 128, (v >> lv) - 128);
        let (fu, fv) = (u & 255, v & 255);
        let (mask_u, mask_v) = ((1_i32 << wide) - 1, (1_i32 << tall) - 1);
        let (u0, u1) = (((u >> 8) & mask_u) as usize, (((u >> 8) + 1) & mask_u) as usize);
        let (v0, v1) =
            ((((v >> 8) & mask_v) as usize) << wide, ((((v >> 8) + 1) & mask_v) as usize) << wide);
        let at = |k: usize| i32::from(picture[k]);
        let (a, b, c, d) = (at(v0 + u0), at(v0 + u1), at(v1 + u0), at(v1 + u1));
        // 16 + 8 bits, four of them dropped so that the second product fits 32.
        let (top, bottom) = ((a * 256 + (b - a) * fu) >> 4, (c * 256 + (d - c) * fu) >> 4);
        (top * 256 + (bottom - top) * fv) as f32 * (1.0 / (ONE * 4096.0))
    }
}

/// Largest integer not above.
#[inline]
pub fn floor(value: f32) -> i32 {
    let integer = value as i32;
    integer.wrapping_sub(i32::from(value < integer as f32))
}

/// Level of reduction for a footprint in texels, and how far towards the next: the logarithm read
/// off the exponent.
#[inline]
fn level(texels: f32) -> (usize, f32) {
    // A texel's mean, interpolated, is the kernel of a pixel of that size: between two levels, the
    // mixture has the deviation of the pixel's own.
    let bits = (texels.clamp(1.0, 400.0)).to_bits();
    let level = (bits >> 23) as usize - 127;
    let part = (bits & 0x7F_FFFF) as f32 * (1.0 / 8_388_608.0);
    let share = part * (2.0 + part) * (1.0 / 3.0);
    // Nearly one level is that level, which is read faster.
    (level, (share * 1.25 - 0.125).clamp(0.0, 1.0))
}

/// The pictures a street needs.
pub struct Textures {
    /// Render, brick, stone: 3 m, 6 mm a texel.
    pub fine: Ripmap,
    /// Asphalt: the same size, mostly single stones.
    pub asphalt: Ripmap,
    /// Stains and wear: 24 m, 5 cm a texel.
    pub broad: Ripmap,
    /// Leaves: 2 m.
    pub leaves: Ripmap,
}

impl Textures {
    /// Draws them; the same for every street.
    pub fn new() -> Self {
        Self {
            fine: Ripmap::grain(11, 3.0, 1.25),
            asphalt: Ripmap::grain(14, 3.0, 1.5),
            broad: Ripmap::grain(12, 24.0, 0.85),
            leaves: Ripmap::foliage(13, 2.0),
        }
    }
}
