//! Ranges of numbers, and the sentence that asks for one.

use core::fmt;

/// Numbers that a setting may have. NaN and infinity are in no range.
///
/// ```
/// use dynvox_core::settings::Range;
///
/// assert!(Range::Within(1.0, 255.0).contains(255.0));
/// assert!(!Range::Above(0.0).contains(0.0));
/// assert_eq!(Range::AboveTo(0.0, 1.0).to_string(), "must be above 0 and at most 1");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Range {
    /// Every finite number.
    Any,
    /// From the first to the second, both included.
    Within(f32, f32),
    /// This number and larger ones.
    AtLeast(f32),
    /// Larger numbers only.
    Above(f32),
    /// Larger than the first, and at most the second.
    AboveTo(f32, f32),
    /// At least the first, and smaller than the second.
    FromBelow(f32, f32),
}

// Bounds are written in tables, and no table has NaN.
impl Eq for Range {}

impl Range {
    /// Shares: from 0 to 1.
    pub const SHARE: Self = Self::Within(0.0, 1.0);
    /// Numbers above 0.
    pub const POSITIVE: Self = Self::Above(0.0);
    /// Numbers from 0 on.
    pub const NOT_NEGATIVE: Self = Self::AtLeast(0.0);

    /// Tells whether a number lies in the range.
    ///
    /// ```
    /// use dynvox_core::settings::Range;
    ///
    /// assert!(Range::SHARE.contains(1.0) && !Range::SHARE.contains(1.1));
    /// assert!(Range::Within(0.05, 1.0).contains(0.05), "a bound that no float is exactly");
    /// assert!(!Range::Any.contains(f64::NAN), "no setting is NaN");
    /// ```
    pub fn contains(self, number: f64) -> bool {
        // Bounds are of `f32`: the bound 0.05 is another number than a setting of 0.05 in `f64`.
        let rounded = number as f32;
        let at_least = |low: f32| rounded >= low;
        let above = |low: f32| rounded > low;
        let at_most = |high: f32| rounded <= high;
        number.is_finite()
            && match self {
                Self::Any => true,
                Self::Within(low, high) => at_least(low) && at_most(high),
                Self::AtLeast(low) => at_least(low),
                Self::Above(low) => above(low),
                Self::AboveTo(low, high) => above(low) && at_most(high),
                Self::FromBelow(low, high) => at_least(low) && rounded < high,
            }
    }
}

/// `must be from 1 to 255`.
impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Any => f.write_str("must be a number"),
            Self::Within(low, high) => write!(f, "must be from {low} to {high}"),
            Self::AtLeast(low) => write!(f, "must be at least {low}"),
            Self::Above(low) => write!(f, "must be above {low}"),
            Self::AboveTo(low, high) => write!(f, "must be above {low} and at most {high}"),
            Self::FromBelow(low, high) => write!(f, "must be at least {low} and below {high}"),
        }
    }
}
