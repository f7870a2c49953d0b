//! Settings of the depth tracker.

use crate::problem::{Problems, require};

/// Most levels of the pyramid.
pub const MAX_LEVELS: u8 = 4;

/// Settings of the depth tracker.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct IcpConfig {
    /// Levels of the pyramid, the finest at half the image's size; 1..=[`MAX_LEVELS`]; 3.
    pub levels: u8,
    /// Most steps a level; 1..=50; 10.
    pub steps: u8,
    /// Distance up to which a point is paired with the map, m, on the finest level; it doubles with
    /// every coarser one. Above 0; 0.1, as in InfiniTAM.
    pub distance_m: f32,
    /// Noise of a disparity, px: a point may be off by three times what that is in depth, and
    /// weighs by it. 0 or more; 0, as in InfiniTAM, which was made for cameras of another kind.
    /// With 0.3 it follows the synthetic street, and slides on a real one.
    pub noise_px: f32,
    /// Least share of the points in view of the map that must be paired in the end; in 0..=1; 0.25.
    pub pairs_min: f32,
    /// Least share of the pairs that must hold the direction held worst: a flat wall holds none; in
    /// 0..=1; 0.0005.
    pub held_min: f32,
    /// Largest motion between two frames, m; above 0; 2.
    pub step_max_m: f32,
    /// Largest rotation between two frames, rad; above 0; 0.35.
    pub step_max_rad: f32,
    /// Least share of the matches of the images, which the tracker does not use, that its motion
    /// must explain; in 0..=1; 0.5. 0 does not ask them.
    pub explained_min: f32,
    /// Distance within which a match counts as explained, px over its four coordinates; above 0; 5.
    pub explained_px: f32,
}

impl Default for IcpConfig {
    fn default() -> Self {
        Self {
            levels: 3,
            steps: 10,
            distance_m: 0.1,
            noise_px: 0.0,
            pairs_min: 0.25,
            held_min: 0.0005,
            step_max_m: 2.0,
            step_max_rad: 0.35,
            explained_min: 0.5,
            explained_px: 5.0,
        }
    }
}

impl IcpConfig {
    /// Notes what is wrong with the settings.
    pub fn validate(&self, problems: &mut Problems) {
        let positive = |value: f32| value.is_finite() && value > 0.0;
        let share = |value: f32| (0.0..=1.0).contains(&value);
        require(
            problems,
            (1..=MAX_LEVELS).contains(&self.levels),
            "icp.levels",
            "must be in 1..=4",
        );
        require(problems, (1..=50).contains(&self.steps), "icp.steps", "must be in 1..=50");
        require(problems, positive(self.distance_m), "icp.distance_m", "must be above 0");
        require(
            problems,
            self.noise_px.is_finite() && self.noise_px >= 0.0,
            "icp.noise_px",
            "must be 0 or more",
        );
        require(problems, share(self.pairs_min), "icp.pairs_min", "must be in 0..=1");
        require(problems, share(self.held_min), "icp.held_min", "must be in 0..=1");
        require(problems, positive(self.step_max_m), "icp.step_max_m", "must be above 0");
        require(problems, positive(self.step_max_rad), "icp.step_max_rad", "must be above 0");
        require(problems, share(self.explained_min), "icp.explained_min", "must be in 0..=1");
        require(problems, positive(self.explained_px), "icp.explained_px", "must be above 0");
    }
}
