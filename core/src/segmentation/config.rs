//! Settings of motion segmentation.

use crate::settings::{Problems, check};

/// Search for moving objects by their motion. Off by default: it adds to detections, or replaces
/// them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct SegmentationConfig {
    /// True if moving objects are searched for.
    pub enabled: bool,
    /// Farthest depth searched, m; above 0; 45.
    pub far_m: f32,
    /// Frames before an object was known to move, over which what it left in the static map is
    /// erased; 0 to 30, 0 is off; 8.
    pub erase_frames: u8,
}

impl Default for SegmentationConfig {
    fn default() -> Self {
        Self { enabled: false, far_m: 45.0, erase_frames: 8 }
    }
}

impl SegmentationConfig {
    /// Notes everything wrong with the settings.
    pub fn validate(&self, problems: &mut Problems) {
        check(Self::CHECKS, self, problems);
    }
}
