//! Noise that is a function of a position: the same in every frame.

use super::changed::Pixel;
use dynvox_core::random::Random;

/// Uniform number from 0 to 1 of a point of the lattice.
fn of_point(seed: u64, x: i64, y: i64) -> f64 {
    let mixed = (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
        ^ seed.wrapping_mul(0x1656_67B1_9E37_79F9);
    Random::new(mixed).fraction()
}

/// Noise from 0 to 1 that is smooth between whole numbers.
pub(super) fn smooth(seed: u64, x: f64, y: f64) -> f64 {
    let (left, top) = (x.floor(), y.floor());
    let eased = |share: f64| share * share * (3.0 - 2.0 * share);
    let (across, down) = (eased(x - left), eased(y - top));
    let at = |right: i64, low: i64| of_point(seed, left as i64 + right, top as i64 + low);
    let row = |low: i64| (1.0 - across) * at(0, low) + across * at(1, low);
    (1.0 - down) * row(0) + down * row(1)
}

/// Noise of a pixel, about normal and of variance 1.
pub(super) fn fixed(seed: u64, at: &Pixel) -> f64 {
    let (u, v) = (at.u as i64, at.v as i64);
    // Four uniform numbers have a variance of a third.
    let sum: f64 = (0..4).map(|part| of_point(seed, 4 * u + part, v)).sum();
    (sum - 2.0) * 3f64.sqrt()
}
