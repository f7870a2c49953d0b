//! The one configuration, and what can be wrong with it.

use heapless::Vec;

/// Most problems `validate` reports at once.
pub const MAX_PROBLEMS: usize = 32;

/// One thing wrong with a configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Problem {
    /// The key as it stands in a configuration file: `volume.voxel_size_m`.
    pub key: &'static str,
    /// What the value must be: "must be above 0".
    pub rule: &'static str,
}

/// All problems found, in the order of the keys.
pub type Problems = Vec<Problem, MAX_PROBLEMS>;

/// Notes a problem unless `holds`. Beyond [`MAX_PROBLEMS`] the first ones are enough to refuse the configuration.
pub fn require(problems: &mut Problems, holds: bool, key: &'static str, rule: &'static str) {
    if !holds && !problems.is_full() {
        let _ = problems.push(Problem { key, rule });
    }
}
