//! Settings of the maps for planners.

use crate::problem::{Problems, require};

/// Most voxels along a cell's side.
pub const MAX_CELL_VOXELS: u8 = 8;

/// How the window lies and what counts as an obstacle.
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
    /// Voxels along a cell's side, 1 to [`MAX_CELL_VOXELS`]; 4.
    pub cell_voxels: u8,
    /// Up in the world, x: together with y and z a direction of any length above 0, as an inertial
    /// sensor tells it. The default is against the first camera's y, which is the world's; 0.
    pub up_x: f32,
    /// Up in the world, y; -1.
    pub up_y: f32,
    /// Up in the world, z; 0.
    pub up_z: f32,
    /// How far below the camera the window begins, m. At least 0; 2.5.
    pub below_m: f32,
    /// Nearest depth that tells of free space, m. Above 0; 0.5.
    pub near_m: f32,
    /// Farthest cell called free from a frame, m. Above `near_m`; 20.
    pub far_m: f32,
    /// Disparity error to be expected, px: a cell is free where the surface behind it is seen
    /// beyond it in spite of such an error. At least 0; 0.5.
    pub margin_px: f32,
    /// Observations that make a voxel count, as for the mesh. At least 1; 1.
    pub min_weight: u8,
    /// Height of the camera above ground, m; 0 takes what the disparity image says about the
    /// ground; 0.
    pub camera_height_m: f32,
    /// Steepest ground, rise over run. Above 0 and up to 2; 0.5774, which is 30 degrees.
    pub slope_max: f32,
    /// Highest step that still connects ground with ground, m. Above 0; 0.25.
    pub ground_step_m: f32,
    /// Highest step a robot climbs, m: more is an obstacle. Above 0; 0.25.
    pub climb_m: f32,
    /// Lower limit of what is an obstacle, m: above ground, or above the camera's ground where
    /// `level` is set. 0.3.
    pub low_m: f32,
    /// Upper limit of what is an obstacle, m. Above `low_m`; 2.
    pub high_m: f32,
    /// Whether the limits are counted from one level, that of the ground below the camera, and not
    /// from the ground of each column; false.
    pub level: bool,
    /// Whether what was never seen counts as an obstacle in distance fields; false.
    pub unknown_is_obstacle: bool,
    /// Sigmas of position added around a moving object's box. At least 0; 2.
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
            margin_px: 0.5,
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

impl PlanningConfig {
    /// Notes everything wrong with the figures.
    pub fn validate(&self, problems: &mut Problems) {
        let within =
            |value: f32, low: f32, high: f32| value.is_finite() && (low..=high).contains(&value);
        let up = [self.up_x, self.up_y, self.up_z];
        let length = up.iter().map(|c| c * c).sum::<f32>();
        require(
            problems,
            (1..=MAX_CELL_VOXELS).contains(&self.cell_voxels),
            "planning.cell_voxels",
            "must be from 1 to 8",
        );
        require(
            problems,
            within(length, 1e-6, 1e6),
            "planning.up_y",
            "up must be a direction: from 0.001 to 1,000 long",
        );
        require(
            problems,
            within(self.below_m, 0.0, 1_000.0),
            "planning.below_m",
            "must be from 0 to 1,000 m",
        );
        require(
            problems,
            within(self.near_m, 0.01, 1_000.0),
            "planning.near_m",
            "must be from 0.01 to 1,000 m",
        );
        require(
            problems,
            within(self.far_m, 0.01, 1_000.0) && self.far_m > self.near_m,
            "planning.far_m",
            "must be above planning.near_m",
        );
        require(
            problems,
            within(self.margin_px, 0.0, 100.0),
            "planning.margin_px",
            "must be from 0 to 100 px",
        );
        require(problems, self.min_weight >= 1, "planning.min_weight", "must be from 1 to 255");
        require(
            problems,
            within(self.camera_height_m, 0.0, 1_000.0),
            "planning.camera_height_m",
            "must be from 0 to 1,000 m",
        );
        require(
            problems,
            within(self.slope_max, 0.001, 2.0),
            "planning.slope_max",
            "must be from 0.001 to 2",
        );
        require(
            problems,
            within(self.ground_step_m, 0.001, 10.0),
            "planning.ground_step_m",
            "must be from 0.001 to 10 m",
        );
        require(
            problems,
            within(self.climb_m, 0.001, 10.0),
            "planning.climb_m",
            "must be from 0.001 to 10 m",
        );
        require(
            problems,
            within(self.low_m, -1_000.0, 1_000.0),
            "planning.low_m",
            "must be from -1,000 to 1,000 m",
        );
        let high = within(self.high_m, -1_000.0, 1_000.0) && self.high_m > self.low_m;
        require(problems, high, "planning.high_m", "must be above planning.low_m");
        require(
            problems,
            within(self.object_sigmas, 0.0, 10.0),
            "planning.object_sigmas",
            "must be from 0 to 10",
        );
    }
}
