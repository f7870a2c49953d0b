//! How the map is looked at.

use crate::problem::{Problems, require};

/// Parameters of the raycast.
///
/// ```
/// use dynvox_core::view::RaycastConfig;
///
/// let mut problems = dynvox_core::Problems::new();
/// RaycastConfig { near_m: 5.0, far_m: 2.0, ..RaycastConfig::default() }.validate(&mut problems);
/// assert_eq!(problems[0].key, "raycast.far_m");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct RaycastConfig {
    /// Nearest depth looked at, m. Above 0; 0.3.
    pub near_m: f32,
    /// Farthest depth looked at, m. Above `near_m`; 30.
    pub far_m: f32,
    /// Observations a lattice point needs to count as seen, 1 to 255; 1 (the original looks at all
    /// it has).
    pub min_weight: u8,
}

impl Default for RaycastConfig {
    fn default() -> Self {
        Self { near_m: 0.3, far_m: 30.0, min_weight: 1 }
    }
}

impl RaycastConfig {
    /// Notes everything wrong with the figures.
    pub fn validate(&self, problems: &mut Problems) {
        require(
            problems,
            self.near_m.is_finite() && self.near_m > 0.0,
            "raycast.near_m",
            "must be above 0",
        );
        require(
            problems,
            self.far_m.is_finite() && self.far_m > self.near_m,
            "raycast.far_m",
            "must be above raycast.near_m",
        );
        require(problems, self.min_weight >= 1, "raycast.min_weight", "must be from 1 to 255");
    }
}
