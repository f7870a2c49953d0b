//! Settings of tracking. Speeds are in metres per second of real time: other frame rates need no
//! other thresholds.

use super::{
    instances::InstancesConfig,
    matches::MatchesConfig,
    motion::{MotionConfig, StateConfig},
    tracks::TracksConfig,
};
use crate::settings::{Problems, check};

/// Acceptance and tracking of detections, part by part. Defaults are the original's published ones
/// unless said otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct TrackingConfig {
    /// True if objects that may move are kept out of the static map. False fuses everything into
    /// one map (the paper's robust odometry baseline).
    pub dynamic: bool,
    /// Time between two frames, s; above 0; 0.1.
    pub frame_interval_s: f32,
    /// Acceptance of detections.
    pub instances: InstancesConfig,
    /// Association of instances with tracks.
    pub tracks: TracksConfig,
    /// Assignment of matches to instances.
    pub matches: MatchesConfig,
    /// Estimation of motions.
    pub motion: MotionConfig,
    /// Classification as moving or static.
    pub state: StateConfig,
}

impl Default for TrackingConfig {
    fn default() -> Self {
        Self {
            dynamic: true,
            frame_interval_s: 0.1,
            instances: InstancesConfig::default(),
            tracks: TracksConfig::default(),
            matches: MatchesConfig::default(),
            motion: MotionConfig::default(),
            state: StateConfig::default(),
        }
    }
}

impl TrackingConfig {
    /// Notes what is wrong with the settings.
    pub fn validate(&self, problems: &mut Problems) {
        check(Self::CHECKS, self, problems);
    }
}
