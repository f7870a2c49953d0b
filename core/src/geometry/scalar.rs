//! Float helpers that give the same bits everywhere (ARCHITECTURE.md, *Rules*): no `f32::min`, no rounding by the platform.

/// The smaller of two; `b` when either is NaN or both are equal.
pub(crate) fn min_f32(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger of two; `b` when either is NaN or both are equal.
pub(crate) fn max_f32(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// As [`min_f32`].
pub(crate) fn min_f64(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// As [`max_f32`].
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
