//! Problems of a configuration.

use super::Range;
use core::fmt;
use heapless::Vec;

/// Most problems a validation reports at once.
pub const MAX_PROBLEMS: usize = 32;

/// One problem of a configuration.
///
/// ```
/// use dynvox_core::Problems;
/// use dynvox_core::view::MeshConfig;
///
/// let mut problems = Problems::new();
/// MeshConfig { min_weight: 0 }.validate(&mut problems);
/// assert_eq!(problems[0].to_string(), "mesh.min_weight must be from 1 to 255");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Problem {
    /// The key as it stands in a configuration file: `volume.voxel_size_m`.
    pub key: &'static str,
    /// The rule that the value breaks.
    pub rule: BrokenRule,
}

/// A rule that a value breaks, which prints itself: "must be above 0".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum BrokenRule {
    /// The number lies outside the setting's range.
    Range(Range),
    /// The value contradicts another one, or is wrong for a reason that the text says.
    Text(&'static str),
}

impl Problem {
    /// A problem whose rule is a text: "must be above volume.near_m".
    pub const fn new(key: &'static str, rule: &'static str) -> Self {
        Self { key, rule: BrokenRule::Text(rule) }
    }
}

impl fmt::Display for BrokenRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Range(range) => fmt::Display::fmt(range, f),
            Self::Text(text) => f.write_str(text),
        }
    }
}

/// `volume.voxel_size_m must be above 0`.
impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.key, self.rule)
    }
}

impl core::error::Error for Problem {}

/// All problems found, in the order of the rows.
pub type Problems = Vec<Problem, MAX_PROBLEMS>;

/// Notes a problem unless `holds`. Beyond [`MAX_PROBLEMS`] the first ones are enough to refuse the
/// configuration.
///
/// ```
/// use dynvox_core::{Problems, settings::require};
///
/// let mut problems = Problems::new();
/// require(&mut problems, 2 < 1, "example.count", "must be below 1");
/// assert_eq!(problems[0].to_string(), "example.count must be below 1");
/// ```
pub fn require(problems: &mut Problems, holds: bool, key: &'static str, rule: &'static str) {
    if !holds {
        note(problems, Problem::new(key, rule));
    }
}

/// Appends a problem unless the list is full.
pub(super) fn note(problems: &mut Problems, problem: Problem) {
    if !problems.is_full() {
        let _ = problems.push(problem);
    }
}
