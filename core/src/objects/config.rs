//! Settings of the objects' volumes.

use crate::{
    problem::{Problems, require},
    volume::{ObservationWeight, VolumeConfig, WhenFull},
};

/// The objects' volumes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct ObjectsConfig {
    /// Distance between lattice points, m; 0.001 to 10; the original: 0.035.
    pub voxel_size_m: f32,
    /// Truncation, m; 2 to 64 voxels; the original: 1.0.
    pub truncation_m: f32,
    /// Farthest depth fused, m; above the map's `near_m`; 20.
    pub far_m: f32,
    /// How far from the object's median depth a pixel may lie, m: what is visible through windows
    /// and at the rim is left out; above 0; 3. A frame shows at most twice this length of a bus
    /// viewed lengthwise.
    pub extent_m: f32,
    /// What one observation of a voxel weighs; by depth, free space a quarter (the original: one).
    pub observation_weight: ObservationWeight,
    /// Weight at which the average stops forgetting less, 1 to 255; 200.
    pub max_weight: u8,
    /// Voxels that weigh at most this are reset when the object is pruned; 0 is off; 6: what was
    /// observed once from beyond 14 m.
    pub prune_weight: u8,
    /// Fused frames from one pruning of the whole object to the next; 1 to 255. With 1 a voxel must
    /// weigh more than `prune_weight` in its first frame to stay.
    pub prune_frames: u8,
}

impl Default for ObjectsConfig {
    fn default() -> Self {
        Self {
            voxel_size_m: 0.05,
            truncation_m: 0.3,
            far_m: 20.0,
            extent_m: 3.0,
            observation_weight: ObservationWeight::Band,
            max_weight: 200,
            prune_weight: 6,
            prune_frames: 4,
        }
    }
}

impl ObjectsConfig {
    /// The settings of one object's volume. It refuses blocks above its bound, for an evicted one
    /// could not be loaded again.
    pub(super) fn volume(&self) -> VolumeConfig {
        VolumeConfig {
            voxel_size_m: self.voxel_size_m,
            truncation_m: self.truncation_m,
            far_m: self.far_m,
            observation_weight: self.observation_weight,
            max_weight: self.max_weight,
            when_full: WhenFull::Refuse,
            prune_weight: 0,
            ..VolumeConfig::default()
        }
    }

    /// Adds what is wrong with the settings.
    pub fn validate(&self, problems: &mut Problems) {
        let positive = |value: f32| value.is_finite() && value > 0.0;
        let voxel = positive(self.voxel_size_m) && (0.001..=10.0).contains(&self.voxel_size_m);
        require(problems, voxel, "objects.voxel_size_m", "must be from 0.001 to 10 m");
        let truncation = positive(self.truncation_m)
            && (2.0..=64.0).contains(&(self.truncation_m / self.voxel_size_m));
        require(problems, truncation, "objects.truncation_m", "must be from 2 to 64 voxels");
        require(problems, positive(self.far_m), "objects.far_m", "must be above 0");
        require(problems, positive(self.extent_m), "objects.extent_m", "must be above 0");
        require(problems, self.max_weight >= 1, "objects.max_weight", "must be from 1 to 255");
        require(
            problems,
            self.prune_weight < self.max_weight,
            "objects.prune_weight",
            "must be below objects.max_weight",
        );
        require(problems, self.prune_frames >= 1, "objects.prune_frames", "must be at least 1");
    }
}
