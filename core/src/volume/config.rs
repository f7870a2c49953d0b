//! How depth becomes a map.

use crate::settings::{
    Problems, Range, Relation, Rule, Setting,
    Value::{Bytes, Choice, F32, U8, U32},
    check, choices, rules,
};

/// Semantic classes that can carry a weight of their own.
pub const CLASS_COUNT: usize = 32;

/// Weight of one observation of a voxel.
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
    /// Weight as for `Depth` within a band of four voxels before the surface, a quarter of that in
    /// the free space farther before it: free space seen in one view does not erase a surface that
    /// another view measured.
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

/// Reaction to a new block when the pool is full.
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

/// Rule of what pruning removes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
pub enum PruneBy {
    /// Voxels seen at most `prune_weight` times, the paper's rule.
    Weight,
    /// Voxels seen at most `prune_weight` times where less than a tenth of their block was seen
    /// more often: others belong to a surface that is well known. And blocks farther than two
    /// voxels from any surface.
    #[default]
    Support,
}

choices! {
    ObservationWeight { "one" = One, "nearest" = Nearest, "depth" = Depth, "band" = Band }
    DistanceAlong { "ray" = Ray, "normal" = Normal }
    WhenFull { "evict" = Evict, "refuse" = Refuse }
    PruneBy { "weight" = Weight, "support" = Support }
}

/// Parameters of the map. [`VolumeConfig::SETTINGS`] has their ranges, and the original's values
/// where they differ.
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
    /// Distance between lattice points, m.
    pub voxel_size_m: f32,
    /// Distance from the surface up to which voxels are kept, m.
    pub truncation_m: f32,
    /// Nearest depth fused, m.
    pub near_m: f32,
    /// Farthest depth fused, m.
    pub far_m: f32,
    /// Upper bound of a voxel's weight.
    pub max_weight: u8,
    /// Weight of one observation.
    pub observation_weight: ObservationWeight,
    /// Factor on an observation's weight by semantic class.
    pub class_weight: [u8; CLASS_COUNT],
    /// Action when a block is to be made and the pool is full.
    pub when_full: WhenFull,
    /// Largest weight of voxels that pruning resets.
    pub prune_weight: u8,
    /// Length of the pruning window, frames.
    pub prune_lag: u32,
    /// Rule of what pruning removes.
    pub prune_rule: PruneBy,
    /// Most blocks that pruning visits in one frame.
    pub prune_blocks_per_frame: u32,
    /// Distance from the edge of something nearer within which pixels are not fused, px.
    pub edge_reach_px: u8,
    /// Direction along which distance is measured.
    pub distance: DistanceAlong,
    /// Distance behind the surface up to which voxels are observed, m.
    pub behind_m: f32,
    /// Distance before and behind the surface within which blocks are made, m.
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
            when_full: WhenFull::Evict,
            prune_weight: 1,
            prune_lag: 200,
            prune_rule: PruneBy::Support,
            prune_blocks_per_frame: 20_000,
            edge_reach_px: 2,
            distance: DistanceAlong::Normal,
            behind_m: 0.3,
            allocation_m: 0.2,
        }
    }
}

type Row = Setting<VolumeConfig>;

impl VolumeConfig {
    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::user("volume.voxel_size_m", "m", |c| F32(&mut c.voxel_size_m))
            .range(Range::Within(0.001, 10.0))
            .text("Distance between lattice points."),
        Row::user("volume.truncation_m", "m", |c| F32(&mut c.truncation_m))
            .range(Range::POSITIVE)
            .relation(&Relation {
                holds: |c| (2.0..=64.0).contains(&(c.truncation_m / c.voxel_size_m)),
                rule: "must be from 2 to 64 voxels",
            })
            .published("0.5 in the paper's experiments")
            .text("Distance from the surface up to which voxels are kept."),
        Row::user("volume.near_m", "m", |c| F32(&mut c.near_m))
            .range(Range::POSITIVE)
            .text("Nearest depth fused."),
        Row::user("volume.far_m", "m", |c| F32(&mut c.far_m))
            .range(Range::POSITIVE)
            .relation(&Relation {
                holds: |c| c.far_m > c.near_m,
                rule: "must be above volume.near_m",
            })
            .text("Farthest depth fused."),
        Row::expert("volume.max_weight", "", |c| U8(&mut c.max_weight))
            .range(Range::Within(1.0, 255.0))
            .text(
                "Upper bound of a voxel's weight; at the bound old observations fade \
                 exponentially.",
            ),
        Row::expert("volume.observation_weight", "", |c| Choice(&mut c.observation_weight))
            .published("one")
            .text(
                "Weight of one observation: 1; 1 against a past that weighs at most one for every \
                 2 m of depth (`nearest`); 100 / depth, held within 1 and 10 (`depth`); or a \
                 quarter of that farther than four voxels before the surface (`band`).",
            ),
        Row::user("volume.class_weight", "", |c| Bytes(&mut c.class_weight)).text(
            "Factor on an observation's weight by semantic class (Vineet et al., *Incremental \
             Dense Semantic Stereo Fusion*, 2015); 0 keeps a class out of the map.",
        ),
        Row::user("volume.when_full", "", |c| Choice(&mut c.when_full)).text(
            "Action when a block is to be made and the pool is full: `evict` lets the block unseen \
             for longest leave, `refuse` the new one.",
        ),
        Row::user("volume.prune_weight", "", |c| U8(&mut c.prune_weight))
            .range(Range::Within(0.0, 254.0))
            .relation(&Relation {
                holds: |c| c.prune_weight < c.max_weight,
                rule: "must be below volume.max_weight",
            })
            .text(
                "Voxels seen at most this often are reset when their block leaves the window; 0 is \
                 off.",
            ),
        Row::user("volume.prune_lag", "frames", |c| U32(&mut c.prune_lag))
            .range(Range::AtLeast(1.0))
            .published("300 in the paper's text, 40 in its pruning experiment")
            .text("Length of the pruning window."),
        Row::user("volume.prune_rule", "", |c| Choice(&mut c.prune_rule)).published("weight").text(
            "Rule of what pruning removes: voxels of low weight (`weight`); or those only where \
             less than a tenth of their block was seen more often, and blocks farther than two \
             voxels from any surface that left the window (`support`).",
        ),
        Row::expert("volume.prune_blocks_per_frame", "blocks", |c| {
            U32(&mut c.prune_blocks_per_frame)
        })
        .range(Range::AtLeast(1.0))
        .text("Most blocks that pruning visits in one frame; the rest follows in the next."),
        Row::expert("volume.edge_reach_px", "px", |c| U8(&mut c.edge_reach_px))
            .range(Range::Within(0.0, 16.0))
            .text(
                "Pixels so near to what is farther by more than 1.5 px of disparity are not fused, \
                 because the matcher widens what is near. Pixels within 3 px of it, or of no \
                 disparity, give colour only to voxels without colour. 0 is off.",
            ),
        Row::expert("volume.distance", "", |c| Choice(&mut c.distance)).published("ray").text(
            "Direction along which distance is measured: the camera's z axis, or the surface's \
             normal (Pan et al., *Voxfield*, IROS 2022).",
        ),
        Row::expert("volume.behind_m", "m", |c| F32(&mut c.behind_m)).range(Range::POSITIVE).text(
            "Distance behind the surface up to which voxels are observed, held between two voxels \
             and the truncation.",
        ),
        Row::expert("volume.allocation_m", "m", |c| F32(&mut c.allocation_m))
            .range(Range::POSITIVE)
            .published("the truncation")
            .text(
                "Distance before and behind the surface, along the ray, within which blocks are \
                 made: at least two voxels and half of the way in depth to the pixels beside, at \
                 most the truncation. Blocks that exist are fused wherever they are in view.",
            ),
    ];

    pub(crate) const CHECKS: &'static [Rule<Self>] =
        &rules::<_, { Self::SETTINGS.len() }>(Self::SETTINGS);

    /// Tells whether anything is pruned.
    pub const fn prunes(&self) -> bool {
        self.prune_weight > 0
    }

    /// Notes everything wrong with the figures.
    pub fn validate(&self, problems: &mut Problems) {
        check(Self::CHECKS, self, problems);
    }
}
