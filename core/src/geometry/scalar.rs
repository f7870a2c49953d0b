//! Float helpers that give the same bits everywhere (ARCHITECTURE.md, *Rules*): no `f32::min`, no
//! rounding by the platform.

/// The smaller of two; `b` when either is NaN or both are equal.
pub(crate) fn min_f32(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger of two; `b` when either is NaN or both are equal.
pub(crate) fn max_f32(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Returns the smaller value, like [`min_f32`].
pub(crate) fn min_f64(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Returns the larger value, like [`max_f32`].
pub(crate) fn max_f64(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// `value` held within `low..=high`; `low` when it is NaN.
pub(crate) fn clamp_f32(value: f32, low: f32, high: f32) -> f32 {
    min_f32(max_f32(value, low), high)
}

/// Largest integer not above a finite `value` within ±2^31; saturates beyond, 0 for NaN.
pub(crate) fn floor_i32(value: f32) -> i32 {
    let truncated = value as i32;
    truncated.saturating_sub(i32::from(value < truncated as f32))
}

/// The nearest integer to a `value` within ±2^22, ties to even, by the float format itself; any
/// bits at all beyond.
#[inline(always)]
pub(crate) const fn rounded_i32(value: f32) -> i32 {
    const MAGIC: f32 = 12_582_912.0;
    ((value + MAGIC).to_bits() as i32).wrapping_sub(MAGIC.to_bits() as i32)
}

/// Rounds down like [`floor_i32`], for a `value` within ±2^22, in loops: compilers cannot vectorise
/// the saturating cast there.
#[inline(always)]
pub(crate) fn floored_i32(value: f32) -> i32 {
    let near = rounded_i32(value);
    near.wrapping_sub(i32::from(near as f32 > value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_loops_round_down_is_what_a_cast_does() {
        // Every eighth on both sides of 0.
        for eighth in -4_000..4_000 {
            let value = eighth as f32 * 0.125;
            assert_eq!(floored_i32(value), floor_i32(value), "{value}");
        }
        // The ends of the range for which the fast way holds, and the smallest steps.
        for value in
            [-0.0, 0.999_999_94, 65_534.996, 65_535.0, -4_194_303.5, 4_194_303.5, 1.0e-30, -1.0e-30]
        {
            assert_eq!(floored_i32(value), floor_i32(value), "{value}");
        }
    }
}
