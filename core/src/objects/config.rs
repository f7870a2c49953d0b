//! Settings of the objects' volumes.

use crate::{
    settings::{
        Problems, Range, Relation, Rule, Setting,
        Value::{Choice, F32, U8},
        check, rules,
    },
    volume::{ObservationWeight, PruneBy, VolumeConfig, WhenFull},
};

/// Upper bound of a voxel's weight; at the bound old observations fade exponentially.
const MAX_WEIGHT: u8 = 200;

/// The objects' volumes. [`ObjectsConfig::SETTINGS`] has the ranges, and the original's values
/// where they differ.
///
/// ```
/// use dynvox_core::{Problems, objects::ObjectsConfig};
///
/// let mut problems = Problems::new();
/// ObjectsConfig { extent_m: -1.0, ..ObjectsConfig::default() }.validate(&mut problems);
/// assert_eq!(problems[0].key, "objects.extent_m");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct ObjectsConfig {
    /// Distance between lattice points, m.
    pub voxel_size_m: f32,
    /// Distance from the surface up to which voxels are kept, m.
    pub truncation_m: f32,
    /// Farthest depth fused, m.
    pub far_m: f32,
    /// Largest distance of a pixel from the object's median depth, m.
    pub extent_m: f32,
    /// Weight of one observation of a voxel.
    pub observation_weight: ObservationWeight,
    /// Largest weight of voxels that pruning resets.
    pub prune_weight: u8,
    /// Fused frames from one pruning of the whole object to the next.
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
            prune_weight: 6,
            prune_frames: 4,
        }
    }
}

type Row = Setting<ObjectsConfig>;

impl ObjectsConfig {
    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::user("objects.voxel_size_m", "m", |c| F32(&mut c.voxel_size_m))
            .range(Range::Within(0.001, 10.0))
            .published("0.035")
            .text("Distance between lattice points."),
        Row::user("objects.truncation_m", "m", |c| F32(&mut c.truncation_m))
            .range(Range::POSITIVE)
            .relation(&Relation {
                holds: |c| (2.0..=64.0).contains(&(c.truncation_m / c.voxel_size_m)),
                rule: "must be from 2 to 64 voxels",
            })
            .published("1.0")
            .text("Distance from the surface up to which voxels are kept."),
        Row::user("objects.far_m", "m", |c| F32(&mut c.far_m))
            .range(Range::POSITIVE)
            .text("Farthest depth fused."),
        Row::user("objects.extent_m", "m", |c| F32(&mut c.extent_m)).range(Range::POSITIVE).text(
            "Largest distance of a pixel from the object's median depth: what is visible through \
             windows and at the rim is left out. A frame shows at most twice this length of a bus \
             viewed lengthwise.",
        ),
        Row::expert("objects.observation_weight", "", |c| Choice(&mut c.observation_weight))
            .published("one")
            .text(
                "Weight of one observation of a voxel, as for the map: by depth, free space a \
                 quarter ([decision 51](decisions/0051-free-space-weighs-a-quarter.md)).",
            ),
        Row::expert("objects.prune_weight", "", |c| U8(&mut c.prune_weight))
            .range(Range::Within(0.0, MAX_WEIGHT as f32 - 1.0))
            .text(
                "Voxels that weigh at most this are reset when the object is pruned; 0 is off. At \
                 6 those go that were observed once from beyond 14 m.",
            ),
        Row::expert("objects.prune_frames", "frames", |c| U8(&mut c.prune_frames))
            .range(Range::Within(1.0, 255.0))
            .text(
                "Fused frames from one pruning of the whole object to the next. With 1 a voxel \
                 must weigh more than `prune_weight` in its first frame to stay.",
            ),
    ];

    pub(crate) const CHECKS: &'static [Rule<Self>] =
        &rules::<_, { Self::SETTINGS.len() }>(Self::SETTINGS);

    /// The settings of one object's volume. It refuses blocks above its bound, because an evicted
    /// one could not be loaded again.
    pub(super) fn volume(&self) -> VolumeConfig {
        let map = VolumeConfig::default();
        // Lengths without a setting of their own are as many voxels as the map's are.
        let lengths = self.voxel_size_m / map.voxel_size_m;
        VolumeConfig {
            voxel_size_m: self.voxel_size_m,
            truncation_m: self.truncation_m,
            far_m: self.far_m,
            observation_weight: self.observation_weight,
            max_weight: MAX_WEIGHT,
            when_full: WhenFull::Refuse,
            prune_weight: 0,
            prune_rule: PruneBy::Weight,
            near_m: map.near_m * lengths,
            behind_m: map.behind_m * lengths,
            allocation_m: map.allocation_m * lengths,
            ..map
        }
    }

    /// Notes everything wrong with the settings.
    pub fn validate(&self, problems: &mut Problems) {
        check(Self::CHECKS, self, problems);
    }
}
