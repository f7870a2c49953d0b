//! Settings of motion segmentation.

use crate::settings::{Problems, check};

/// How moving objects are found by their motion. Off by default: it adds to detections, or stands
/// in for them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct SegmentationConfig {
    /// Whether moving objects are searched for.
    pub enabled: bool,
    /// Error of a match coordinate, one sigma, px; above 0; 0.35.
    pub noise_px: f32,
    /// Error of a disparity, one sigma, px; above 0; 0.45.
    pub disparity_noise_px: f32,
    /// Error of the camera's translation in a frame, one sigma, m; at least 0; 0.02.
    pub camera_m: f32,
    /// Error of the camera's rotation in a frame, one sigma, rad; at least 0; 0.0005.
    pub camera_rad: f32,
    /// Squared Mahalanobis distance from the static prediction beyond which a match is a candidate;
    /// above 0; 16.27 (chi-square, 3 degrees of freedom, 0.1 %).
    pub candidate_chi_square: f32,
    /// Farthest depth searched, m; above 0; 45.
    pub far_m: f32,
    /// Fewest members of a group; 3 to 1000; 8.
    pub members_min: u16,
    /// The same beyond `sparse_from_m`; 3 to 1000; 5.
    pub far_members_min: u16,
    /// Depth from which on groups are smaller, m; at least 0; 25.
    pub sparse_from_m: f32,
    /// Least share of candidates among all matches within a group's box; 0 to 1; 0.85.
    pub candidate_share_min: f32,
    /// Least motion of a group in a frame, m; at least 0; 0.1. 0.0008 m for each square metre of
    /// squared depth comes on top.
    pub motion_min_m: f32,
    /// Of the last three frames, in how many a group's motion must agree before it is an object; 1
    /// to 3; 2.
    pub confirm_frames: u8,
    /// Frames without a group over which an object's mask is predicted; 0 to 10; 3.
    pub predict_frames: u8,
    /// Frames before an object was known to move, over which what it left in the static map is
    /// erased; 0 to 30, 0 is off; 8.
    pub erase_frames: u8,
}

impl Default for SegmentationConfig {
    fn default() -> Self {
        Self {
            enabled: false,
            noise_px: 0.35,
            disparity_noise_px: 0.45,
            camera_m: 0.02,
            camera_rad: 0.0005,
            candidate_chi_square: 16.27,
            far_m: 45.0,
            members_min: 8,
            far_members_min: 5,
            sparse_from_m: 25.0,
            candidate_share_min: 0.85,
            motion_min_m: 0.1,
            confirm_frames: 2,
            predict_frames: 3,
            erase_frames: 8,
        }
    }
}

impl SegmentationConfig {
    /// Notes everything wrong with the settings.
    pub fn validate(&self, problems: &mut Problems) {
        check(Self::CHECKS, self, problems);
    }
}
