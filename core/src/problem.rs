//! Problems of a configuration. Every stage's settings use this module; it depends on none of them.

use core::fmt;
use heapless::Vec;

/// Most problems a validation reports at once.
pub const MAX_PROBLEMS: usize = 32;

/// One problem of a configuration.
///
/// ```
/// use dynvox_core::view::MeshConfig;
/// use dynvox_core::Problems;
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
    /// What the value must be: "must be above 0".
    pub rule: &'static str,
}

/// `volume.voxel_size_m must be above 0`.
impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.key, self.rule)
    }
}

impl core::error::Error for Problem {}

/// All problems found, in the order of the keys.
pub type Problems = Vec<Problem, MAX_PROBLEMS>;

/// Notes a problem unless `holds`. Beyond [`MAX_PROBLEMS`] the first ones are enough to refuse the
/// configuration.
pub fn require(problems: &mut Problems, holds: bool, key: &'static str, rule: &'static str) {
    if !holds && !problems.is_full() {
        let _ = problems.push(Problem { key, rule });
    }
}
