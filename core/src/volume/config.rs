//! How depth becomes a map.

use crate::problem::{Problems, require};

/// Semantic classes that can carry a weight of their own.
pub const CLASS_COUNT: usize = 32;

/// What one observation of a voxel weighs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
pub enum ObservationWeight {
    /// 1, wherever it is.
    One,
    /// 1, against a past that weighs at most one for every 2 m of depth: near observations, which
    /// are more precise, replace what was seen from afar, and weights count observations all the
    /// same.
    #[default]
    Nearest,
    /// `100 / depth_m`, held within 1 and 10: near observations are more precise (the original's
    /// option).
    Depth,
    /// As `Depth` within a band of four voxels before the surface, a quarter of that in the free
    /// space farther before it: what one view takes for free does not erase a surface that another
    /// one measures.
    Band,
}

/// Width of the band of [`ObservationWeight::Band`], voxels.
const BAND_VOXELS: f32 = 4.0;

impl ObservationWeight {
    /// The most that one observation weighs.
    pub(super) const fn most(self) -> u32 {
        match self {
            Self::One | Self::Nearest => 1,
            Self::Depth | Self::Band => 10,
        }
    }

    /// Distance before the surface from which on an observation weighs a quarter, m.
    pub(super) const fn free_m(self, voxel_size_m: f32) -> f32 {
        match self {
            Self::Band => BAND_VOXELS * voxel_size_m,
            Self::One | Self::Nearest | Self::Depth => f32::MAX,
        }
    }

    /// The most that the past weighs against an observation, by its depth, 1/m.
    pub(super) const fn past_per_m(self) -> f32 {
        match self {
            Self::Nearest => 0.5,
            Self::One | Self::Depth | Self::Band => f32::MAX,
        }
    }
}

/// Along what a voxel's distance from the surface is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
pub enum DistanceAlong {
    /// The camera's z axis, as the original does: the more obliquely a view sees a surface, the
    /// more its distances count.
    Ray,
    /// The surface's normal, as the disparities about the pixel say (Pan et al., *Voxfield*, IROS
    /// 2022).
    #[default]
    Normal,
}

/// What happens when a block is to be made and the pool is full.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
pub enum WhenFull {
    /// The block unseen for longest leaves: the map follows the camera.
    #[default]
    Evict,
    /// The new block is refused: the map stays where it is.
    Refuse,
}

/// Parameters of the map. Defaults are the original's published ones.
///
/// ```
/// use dynvox_core::volume::VolumeConfig;
///
/// let coarse = VolumeConfig { voxel_size_m: 0.1, far_m: 30.0, ..VolumeConfig::default() };
/// let mut problems = dynvox_core::Problems::new();
/// coarse.validate(&mut problems);
/// assert!(problems.is_empty());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct VolumeConfig {
    /// Distance between lattice points, m. Above 0; 0.05 in the paper.
    pub voxel_size_m: f32,
    /// Distance from the surface up to which voxels are kept, m. At least two voxels; 0.75 (the
    /// paper's experiments: 0.50).
    pub truncation_m: f32,
    /// Nearest depth fused, m. Above 0; 0.5.
    pub near_m: f32,
    /// Farthest depth fused, m. Above `near_m`; 20.
    pub far_m: f32,
    /// Weight at which the average stops forgetting less, 1 to 255; 50.
    pub max_weight: u8,
    /// What one observation weighs; nearest (the original: one).
    pub observation_weight: ObservationWeight,
    /// Factor on an observation's weight by semantic class (Vineet et al., *Incremental Dense
    /// Semantic Stereo Fusion*, 2015); 0 keeps a class out of the map. All 1.
    pub class_weight: [u8; CLASS_COUNT],
    /// Share of the truncation on either side of the surface within which colour is averaged, 0 to
    /// 1; 0.25.
    pub colour_band: f32,
    /// What happens when a block is to be made and the pool is full.
    pub when_full: WhenFull,
    /// Voxels seen at most this often are reset when their block leaves the window; 0 is off, below
    /// `max_weight`; 1.
    pub prune_weight: u8,
    /// Length of the window, frames. At least 1; 200 (the paper's text: 300, its pruning
    /// experiment: 40).
    pub prune_lag: u32,
    /// A block not visible in the window whose smallest |distance| is above this share of the
    /// truncation goes as a whole, 0 to 1; 0 is off. With two voxels, 0.13 at the defaults,
    /// surfaces stay.
    pub prune_distance: f32,
    /// Most blocks visited in one frame; the rest follows in the next. At least 1; 20,000.
    pub prune_blocks_per_frame: u32,
    /// Pixels so near to what is farther by more than 1.5 px of disparity are not fused, for the
    /// matcher widens what is near, and pixels within 3 px of it, or of no disparity, give colour
    /// only to voxels without colour; 0 is off, at most 16; 2.
    pub edge_reach_px: u8,
    /// Along what distance is measured.
    pub distance: DistanceAlong,
    /// How far behind the surface voxels are observed, m, above 0: at least two voxels, at most the
    /// truncation; 0.3.
    pub behind_m: f32,
    /// How far before and behind the surface blocks are made, along the ray, m, above 0: at least
    /// two voxels and half of the way in depth to the pixels beside, at most the truncation; 0.2
    /// (the original: the truncation). Blocks that exist are fused wherever they are in view.
    pub allocation_m: f32,
}

impl Default for VolumeConfig {
    fn default() -> Self {
        Self {
            voxel_size_m: 0.05,
            truncation_m: 0.75,
            near_m: 0.5,
            far_m: 20.0,
            max_weight: 50,
            observation_weight: ObservationWeight::Nearest,
            class_weight: [1; CLASS_COUNT],
            colour_band: 0.25,
            when_full: WhenFull::Evict,
            prune_weight: 1,
            prune_lag: 200,
            prune_distance: 0.0,
            prune_blocks_per_frame: 20_000,
            edge_reach_px: 2,
            distance: DistanceAlong::Normal,
            behind_m: 0.3,
            allocation_m: 0.2,
        }
    }
}

impl VolumeConfig {
    /// Whether anything is pruned.
    pub const fn prunes(&self) -> bool {
        self.prune_weight > 0 || self.prune_distance > 0.0
    }

    /// Notes everything wrong with the figures.
    pub fn validate(&self, problems: &mut Problems) {
        let positive = |value: f32| value.is_finite() && value > 0.0;
        require(
            problems,
            positive(self.voxel_size_m) && (0.001..=10.0).contains(&self.voxel_size_m),
            "volume.voxel_size_m",
            "must be from 0.001 to 10 m",
        );
        require(
            problems,
            positive(self.truncation_m)
                && (2.0..=64.0).contains(&(self.truncation_m / self.voxel_size_m)),
            "volume.truncation_m",
            "must be from 2 to 64 voxels",
        );
        require(problems, positive(self.near_m), "volume.near_m", "must be above 0");
        require(
            problems,
            positive(self.far_m) && self.far_m > self.near_m,
            "volume.far_m",
            "must be above volume.near_m",
        );
        require(problems, self.max_weight >= 1, "volume.max_weight", "must be from 1 to 255");
        require(
            problems,
            (0.0..=1.0).contains(&self.colour_band),
            "volume.colour_band",
            "must be from 0 to 1",
        );
        require(
            problems,
            self.prune_weight < self.max_weight,
            "volume.prune_weight",
            "must be below volume.max_weight",
        );
        require(problems, self.prune_lag >= 1, "volume.prune_lag", "must be at least 1 frame");
        require(
            problems,
            (0.0..=1.0).contains(&self.prune_distance),
            "volume.prune_distance",
            "must be from 0 to 1",
        );
        require(problems, positive(self.behind_m), "volume.behind_m", "must be above 0");
        require(problems, positive(self.allocation_m), "volume.allocation_m", "must be above 0");
        require(
            problems,
            self.edge_reach_px <= 16,
            "volume.edge_reach_px",
            "must be at most 16 px",
        );
        require(
            problems,
            self.prune_blocks_per_frame >= 1,
            "volume.prune_blocks_per_frame",
            "must be at least 1",
        );
    }
}
