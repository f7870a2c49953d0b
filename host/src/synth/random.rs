//! Hashes and random numbers: every random figure is a function of what it belongs to, never of
//! what was asked for before.

use dynvox_core::random::Random;

/// Mixes 64 bits so that each input bit moves every output bit (SplitMix64's finaliser).
#[inline]
pub fn mix(value: u64) -> u64 {
    let a = (value ^ (value >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let b = (a ^ (a >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    b ^ (b >> 31)
}

/// One hash of a seed and two counters.
pub fn hash(seed: u64, a: i64, b: i64) -> u64 {
    mix(mix(seed ^ (a as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15))
        .wrapping_add((b as u64).wrapping_mul(0xD1B5_4A32_D192_ED03)))
}

/// A cheap hash of a texture cell, for the shader.
#[inline]
pub fn cell(seed: u32, a: i32, b: i32) -> u32 {
    let mut h = seed ^ (a as u32).wrapping_mul(0x9E37_79B1) ^ (b as u32).wrapping_mul(0x85EB_CA77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
    h ^ (h >> 15)
}

/// Uniform in 0..1 from 32 bits.
#[inline]
pub fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// A generator for one object of the street: a building, a tree, a car.
pub struct Rng(Random);

impl Rng {
    /// Random numbers for object `a`, `b` under `seed`.
    pub fn new(seed: u64, a: i64, b: i64) -> Self {
        Self(Random::new(hash(seed, a, b)))
    }

    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f64 {
        self.0.fraction()
    }

    /// Uniform between two figures.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// True with a probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// One of `0..count`.
    pub fn below(&mut self, count: usize) -> usize {
        self.0.below(count as u32) as usize
    }

    /// 32 bits, as a seed for textures.
    pub fn seed(&mut self) -> u32 {
        self.0.next_u32()
    }

    /// One of a list, copied.
    pub fn pick<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())]
    }
}
