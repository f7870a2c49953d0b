//! The camera's noise: a function of seed, frame, camera and pixel, so that any frame alone is the
//! same.

use super::random::mix;

/// One camera at one frame.
pub struct Sensor {
    key: u64,
    sigma: f32,
}

impl Sensor {
    /// `camera` is 0 on the left, 1 on the right; `sigma` is the noise at mid grey in grey levels.
    pub fn new(seed: u64, frame: u32, camera: u32, sigma: f64) -> Self {
        Self {
            key: mix(seed ^ mix(u64::from(frame) << 1 | u64::from(camera))),
            sigma: sigma as f32,
        }
    }

    /// Grey levels as the sensor reads them.
    pub fn read(&self, pixel: usize, levels: [f32; 3]) -> [u8; 3] {
        let bits = mix(self.key.wrapping_add((pixel as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)));
        [0, 1, 2].map(|channel| {
            let part = (bits >> (21 * channel)) as u32;
            // Three sevenths-bit draws have nearly the normal's shape: mean 190.5, deviation 64.
            let sum = (part & 127) + (part >> 7 & 127) + (part >> 14 & 127);
            let normal = (sum as f32 - 190.5) * (1.0 / 64.0);
            let level = levels[channel];
            let deviation = self.sigma * (0.5 + level * (0.5 / 128.0)).sqrt();
            (level + normal * deviation + 0.5).clamp(0.0, 255.0) as u8
        })
    }
}

/// Integer luma.
pub fn luma([red, green, blue]: [u8; 3]) -> u8 {
    ((77 * u32::from(red) + 150 * u32::from(green) + 29 * u32::from(blue) + 128) >> 8) as u8
}
