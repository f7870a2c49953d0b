//! How a map becomes triangles.

use crate::problem::{Problems, require};

/// Parameters of the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct MeshConfig {
    /// Observations a lattice point needs to count as seen, 1 to 255; 1 (the original meshes all it
    /// has).
    pub min_weight: u8,
}

impl Default for MeshConfig {
    fn default() -> Self {
        Self { min_weight: 1 }
    }
}

impl MeshConfig {
    /// Notes everything wrong with the figures.
    pub fn validate(&self, problems: &mut Problems) {
        require(problems, self.min_weight >= 1, "mesh.min_weight", "must be from 1 to 255");
    }
}
