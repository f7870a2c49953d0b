//! Sun, sky and haze; linear light to grey levels.

use nalgebra::Vector3;

use super::pattern::{Painted, above};
use super::surface::Tone;
use super::texture::Ripmap;

type Direction = Vector3<f32>;

/// Sun, sky and light thrown back by the ground.
const DAY: [Tone; 3] = [[3.05, 2.76, 2.34], [0.40, 0.49, 0.64], [0.22, 0.20, 0.17]];
/// Lamps, and light thrown back by ceiling and floor.
const LAMPS: [Tone; 3] = [[0.62, 0.58, 0.52], [0.66, 0.63, 0.58], [0.50, 0.46, 0.40]];
const HAZE: Tone = [0.74, 0.80, 0.86];
const HAZE_M: f32 = 800.0;

/// Light of a world: where it comes from, and how much.
pub struct Light {
    /// Direction to the sun, or to the lamps, in the world's frame.
    pub to_sun: Direction,
    /// Light from there, from above, and from below.
    tones: [Tone; 3],
}

/// Exposure of a point of a surface to eye, sun and sky.
pub struct Exposure {
    /// Outward normal.
    pub normal: Direction,
    /// Direction to the eye.
    pub to_eye: Direction,
    /// Share of the sun that reaches it.
    pub sunlit: f32,
    /// Share of the sky that reaches it.
    pub open: f32,
    /// Light shines through, as through a leaf.
    pub thin: bool,
}

impl Light {
    /// A day in the open.
    pub fn day(to_sun: Direction) -> Self {
        Self { to_sun, tones: DAY }
    }

    /// A room with lamps.
    pub fn lamps(to_lamps: Direction) -> Self {
        Self { to_sun: to_lamps, tones: LAMPS }
    }

    /// Light that leaves a surface towards the eye.
    pub fn shade(&self, painted: &Painted, exposure: &Exposure) -> Tone {
        let &Exposure { normal, to_eye, sunlit, open, thin } = exposure;
        let facing = normal.dot(&self.to_sun);
        // Leaves let light through.
        let direct = if thin { 0.30 + 0.45 * facing.max(-0.4 * facing) } else { facing.max(0.0) };
        // Upward faces see the sky, downward ones the road's light.
        let up = 0.5 - 0.5 * normal.y;
        let open = open * painted.open;
        let [sun, sky, bounce] = &self.tones;
        let mut light = [0.0; 3];
        for (k, out) in light.iter_mut().enumerate() {
            let around = sky[k] * (0.25 + 0.75 * up) + bounce[k] * (1.0 - up);
            *out = painted.tone[k] * (sun[k] * direct * sunlit + around * open);
        }
        // Glossy paint mirrors sky, walls and road, and the sun as a spark.
        if painted.gloss > 0.03 {
            let cosine = normal.dot(&to_eye).clamp(0.0, 1.0);
            let mirrored = normal * (2.0 * normal.dot(&to_eye)) - to_eye;
            let grazing = (1.0 - cosine) * (1.0 - cosine);
            // Schlick's approximation: glass and paint mirror most at a grazing angle.
            let share = painted.gloss * (0.12 + 0.88 * grazing * grazing);
            let sky = above(-0.05, -mirrored.y, 0.5);
            let (wall, road) = (0.22, 0.14);
            let low = wall + (road - wall) * above(0.0, mirrored.y, 0.3);
            let spark = mirrored.dot(&self.to_sun).max(0.0);
            // The 36th power of the cosine, by squares and cubes: the sun's reflection is small.
            let spark = spark * spark;
            let spark = spark * spark;
            let spark = spark * spark * spark;
            let spark = spark * spark * spark;
            for (k, out) in light.iter_mut().enumerate() {
                let seen = low + (HAZE[k] * 1.1 - low) * sky;
                *out += share * (seen * open + 2.2 * sunlit * spark);
            }
        }
        light
    }

    /// The sky in a direction.
    pub fn sky(&self, direction: Direction, noise: &Ripmap) -> Tone {
        let up = -direction.y;
        // Below the horizon nothing but the ground's haze is seen.
        if up < 0.0 {
            return [0.40, 0.42, 0.40];
        }
        let height = up.sqrt();
        let zenith = [0.13, 0.30, 0.72];
        let mut tone =
            [0, 1, 2].map(|k| HAZE[k] * 1.12 + (zenith[k] - HAZE[k] * 1.12) * height * 0.95);
        let near = direction.dot(&self.to_sun).max(0.0);
        let glow = near * near * near * near;
        // Clouds hang on a ceiling; near the horizon they are small and many.
        let scale = 5.0 / (up + 0.10);
        let (x, z) = (direction.x * scale, direction.z * scale);
        // Two octaves of noise make clouds of two sizes.
        let mass = noise.at(x, z, 0.25, 0.25) + 0.35 * noise.at(x * 3.1, z * 3.1, 0.4, 0.4);
        let cover = ((mass + 0.1) * 0.75).clamp(0.0, 1.0) * (up * 9.0).min(1.0);
        let lit = 1.25 - 0.30 * (mass * 0.4).clamp(0.0, 1.0);
        for (k, out) in tone.iter_mut().enumerate() {
            let cloud = [1.0, 1.0, 1.02][k] * lit;
            *out += (cloud - *out) * cover * cover * (3.0 - 2.0 * cover) * 0.85;
            *out += glow * [0.5, 0.42, 0.3][k];
        }
        tone
    }

    /// A far surface through the air.
    pub fn through_air(&self, light: Tone, depth_m: f32) -> Tone {
        let share = depth_m / (depth_m + HAZE_M);
        [0, 1, 2].map(|k| light[k] + (HAZE[k] - light[k]) * share)
    }
}

/// Linear light as a grey level 0 to 255, before noise: a soft shoulder, the root as the curve of
/// the eye, and a black point.
#[inline]
pub fn develop(light: f32) -> f32 {
    let soft = light * (1.0 + light * 0.16) / (1.0 + light * 0.95);
    (272.0 * soft.clamp(0.0, 1.0).sqrt() - 20.0).clamp(0.0, 255.0)
}
