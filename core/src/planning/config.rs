//! Settings of the maps for planners.

use crate::settings::{
    Problems, Range, Relation, Rule, Setting,
    Value::{Bool, F32, U8},
    check, rules,
};

/// Most voxels along a cell's side.
pub const MAX_CELL_VOXELS: u8 = 8;

/// Place of the window, and what counts as an obstacle. [`PlanningConfig::SETTINGS`] has the
/// ranges.
///
/// ```
/// use dynvox_core::{Problems, planning::PlanningConfig};
///
/// let drone = PlanningConfig { cell_voxels: 2, camera_height_m: 1.2, ..PlanningConfig::default() };
/// let mut problems = Problems::new();
/// drone.validate(&mut problems);
/// assert!(problems.is_empty());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct PlanningConfig {
    /// Voxels along a cell's side.
    pub cell_voxels: u8,
    /// Up in the world, x: with y and z a direction of any length above 0.
    pub up_x: f32,
    /// Up in the world, y.
    pub up_y: f32,
    /// Up in the world, z.
    pub up_z: f32,
    /// Distance below the camera at which the window begins, m.
    pub below_m: f32,
    /// Nearest depth that tells of free space, m.
    pub near_m: f32,
    /// Farthest cell called free from a frame, m.
    pub far_m: f32,
    /// Fewest observations with which a voxel counts, as for the mesh.
    pub min_weight: u8,
    /// Height of the camera above ground, m; 0 takes what the disparity image says.
    pub camera_height_m: f32,
    /// Steepest ground, rise over run.
    pub slope_max: f32,
    /// Highest step that still connects ground with ground, m.
    pub ground_step_m: f32,
    /// Highest step that a robot climbs, m.
    pub climb_m: f32,
    /// Lower limit of obstacles, m above ground.
    pub low_m: f32,
    /// Upper limit of obstacles, m above ground.
    pub high_m: f32,
    /// Limits that count from the ground below the camera, not from that of each column.
    pub level: bool,
    /// Cells never seen that count as obstacles in distance fields.
    pub unknown_is_obstacle: bool,
    /// Margin around a moving object's box, sigmas of its position.
    pub object_sigmas: f32,
}

impl Default for PlanningConfig {
    fn default() -> Self {
        Self {
            cell_voxels: 4,
            up_x: 0.0,
            up_y: -1.0,
            up_z: 0.0,
            below_m: 2.5,
            near_m: 0.5,
            far_m: 20.0,
            min_weight: 1,
            camera_height_m: 0.0,
            slope_max: 0.5774,
            ground_step_m: 0.25,
            climb_m: 0.25,
            low_m: 0.3,
            high_m: 2.0,
            level: false,
            unknown_is_obstacle: false,
            object_sigmas: 2.0,
        }
    }
}

type Row = Setting<PlanningConfig>;

/// Range of heights and distances of the window, m.
const METRES: Range = Range::Within(0.0, 1000.0);
/// Range of depths, m.
const DEPTH: Range = Range::Within(0.01, 1000.0);
/// Range of steps, m.
const STEP: Range = Range::Within(0.001, 10.0);
/// Range of limits, m.
const LIMIT: Range = Range::Within(-1000.0, 1000.0);

impl PlanningConfig {
    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::user("planning.cell_voxels", "voxels", |c| U8(&mut c.cell_voxels))
            .range(Range::Within(1.0, MAX_CELL_VOXELS as f32))
            .text("Voxels along a cell's side."),
        Row::user("planning.up_x", "", |c| F32(&mut c.up_x)).text(
            "Up in the world, x: together with y and z a direction of any length above 0, as an \
             inertial sensor tells it. The default is against the first camera's y, which is the \
             world's.",
        ),
        Row::user("planning.up_y", "", |c| F32(&mut c.up_y))
            .relation(&Relation {
                holds: |c| {
                    let squared_length = c.up_x * c.up_x + c.up_y * c.up_y + c.up_z * c.up_z;
                    (1e-6..=1e6).contains(&squared_length)
                },
                rule: "up must be a direction: from 0.001 to 1,000 long",
            })
            .text("Up in the world, y."),
        Row::user("planning.up_z", "", |c| F32(&mut c.up_z)).text("Up in the world, z."),
        Row::user("planning.below_m", "m", |c| F32(&mut c.below_m))
            .range(METRES)
            .text("Distance below the camera at which the window begins."),
        Row::expert("planning.near_m", "m", |c| F32(&mut c.near_m))
            .range(DEPTH)
            .text("Nearest depth that tells of free space."),
        Row::user("planning.far_m", "m", |c| F32(&mut c.far_m))
            .range(DEPTH)
            .relation(&Relation {
                holds: |c| c.far_m > c.near_m,
                rule: "must be above planning.near_m",
            })
            .text("Farthest cell called free from a frame."),
        Row::expert("planning.min_weight", "", |c| U8(&mut c.min_weight))
            .range(Range::Within(1.0, 255.0))
            .text("Fewest observations with which a voxel counts, as for the mesh."),
        Row::user("planning.camera_height_m", "m", |c| F32(&mut c.camera_height_m))
            .range(METRES)
            .text(
                "Height of the camera above ground; 0 takes what the disparity image says about \
                 the ground.",
            ),
        Row::user("planning.slope_max", "", |c| F32(&mut c.slope_max))
            .range(Range::Within(0.001, 2.0))
            .text("Steepest ground, rise over run. The default is 30 degrees."),
        Row::user("planning.ground_step_m", "m", |c| F32(&mut c.ground_step_m))
            .range(STEP)
            .text("Highest step that still connects ground with ground."),
        Row::user("planning.climb_m", "m", |c| F32(&mut c.climb_m))
            .range(STEP)
            .text("Highest step that a robot climbs: more is an obstacle."),
        Row::user("planning.low_m", "m", |c| F32(&mut c.low_m)).range(LIMIT).text(
            "Lower limit of obstacles: above ground, or above the camera's ground where `level` is \
             set.",
        ),
        Row::user("planning.high_m", "m", |c| F32(&mut c.high_m))
            .range(LIMIT)
            .relation(&Relation {
                holds: |c| c.high_m > c.low_m,
                rule: "must be above planning.low_m",
            })
            .text("Upper limit of obstacles."),
        Row::user("planning.level", "", |c| Bool(&mut c.level)).text(
            "Limits that count from one level, that of the ground below the camera, and not from \
             the ground of each column.",
        ),
        Row::user("planning.unknown_is_obstacle", "", |c| Bool(&mut c.unknown_is_obstacle))
            .text("Cells never seen that count as obstacles in distance fields."),
        Row::expert("planning.object_sigmas", "sigmas", |c| F32(&mut c.object_sigmas))
            .range(Range::Within(0.0, 10.0))
            .text("Margin around a moving object's box, in sigmas of its position."),
    ];

    pub(crate) const CHECKS: &'static [Rule<Self>] =
        &rules::<_, { Self::SETTINGS.len() }>(Self::SETTINGS);

    /// Notes everything wrong with the figures.
    pub fn validate(&self, problems: &mut Problems) {
        check(Self::CHECKS, self, problems);
    }
}
