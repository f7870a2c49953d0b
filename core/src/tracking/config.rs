//! Settings of tracking. Speeds are in metres per second of real time: other frame rates need no
//! other thresholds.

use super::instances::InstancesConfig;
use crate::{
    egomotion::EgomotionConfig,
    settings::{Problems, check},
};

/// Largest reprojection error of an inlier over its four coordinates together, px; three quarters
/// of it at the last refinement.
const INLIER_PX: f32 = 2.0;

/// Overlap by which a detection is compared with a track.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
pub enum Overlap {
    /// Intersection over union of the masks.
    #[default]
    Mask,
    /// Overlap of the boxes (the original).
    Box,
}

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
    /// Overlap by which a detection is associated with a track. The original: boxes.
    pub overlap: Overlap,
    /// Overlap times the geometric mean of both scores times the discount for frames missed must be
    /// above this; 0 to 1; 0.1.
    pub association_min: f32,
    /// Frames without a detection over which a track is found again by how far it reached when it
    /// was last seen whole; at most 1000; 0 never; 10. The original: 0.
    pub extent_frames: u16,
    /// Frames after which a track not detected again is forgotten; 1 to 10000; 50.
    pub forget_frames: u16,
    /// Share of the image beyond which an object of unknown state is kept out of the camera's
    /// egomotion; 0 to 1; 0.05. The original: 1.
    pub large_share: f32,
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
            overlap: Overlap::Mask,
            association_min: 0.1,
            extent_frames: 10,
            forget_frames: 50,
            large_share: 0.05,
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

/// Estimation and filtering of an object's motion. The original: no filter.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct MotionConfig {
    /// Fewest matches for a first motion; 6 to 1000; 12 (the original: 18).
    pub matches_min: u16,
    /// Fewest matches once a motion is known; 6 to 1000; 9 (the original: 18 always).
    pub matches_again: u16,
    /// Most hypotheses; 1 to 10000; 200 (the original: 500).
    pub samples: u16,
    /// Initial speed, one sigma, m/s; above 0.
    pub speed_m_s: f32,
    /// By how much all disparities may be too small, px; at least 0. To a moving camera a static
    /// object then seems to move, by twice this share of its disparity of the speed it passes by.
    pub bias_px: f32,
    /// Bias of a match's disparity by the lens distortion that rectification left, at the left and
    /// right edge of the picture, px; at least 0. Grows with the fourth power of the distance from
    /// the middle. KITTI's colour cameras: 3, as parked cars 30 m away show.
    pub lens_px: f32,
    /// Error of the camera's own rotation per frame, one sigma, rad: at a distance it looks like
    /// speed; at least 0.
    pub camera_rad: f32,
}

impl Default for MotionConfig {
    fn default() -> Self {
        Self {
            matches_min: 12,
            matches_again: 9,
            samples: 200,
            speed_m_s: 20.0,
            bias_px: 0.25,
            lens_px: 3.0,
            camera_rad: 0.0004,
        }
    }
}

impl MotionConfig {
    /// The camera's estimator, set for objects.
    pub(super) fn estimator(&self) -> EgomotionConfig {
        EgomotionConfig {
            samples: self.samples,
            inlier_px: INLIER_PX,
            refined_inlier_px: 0.75 * INLIER_PX,
            matches_min: 6,
            inlier_share_min: 0.0,
            side_knee: 10.0,
            robust_px: 100.0,
            ..EgomotionConfig::default()
        }
    }
}

/// Classification of an object as dynamic or static.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct StateConfig {
    /// Certainly faster: dynamic, m/s; at least `static_m_s`. The published code: 5.5 (0.55 m a
    /// frame), its experiments: 2.
    pub dynamic_m_s: f32,
    /// Possibly slower than this and likely slower than `slow_m_s`: static, m/s; above 0. The
    /// published code: 0.3.
    pub static_m_s: f32,
    /// Speed below which an object that is not known to move is likely to be, to become static,
    /// m/s; at least `static_m_s`; 1.2, slower than a pedestrian. A dynamic object becomes static
    /// only if it is likely slower than `dynamic_m_s`.
    pub slow_m_s: f32,
    /// Number of sigmas that count as "certainly"; at least 0. The published code: 0.
    pub sigmas: f32,
    /// Number of sigmas that count as "likely"; at least 0. The published code: 0.
    pub static_sigmas: f32,
    /// Consecutive frames that confirm an uncertain object as dynamic; 1 to 100. The published
    /// code: 1.
    pub confirm_frames: u8,
    /// Frames in a row that must be classified as static to confirm it; 1 to 100; 2: the filter has
    /// averaged over several frames by then. The published code: 1.
    pub confirm_static_frames: u8,
    /// Consecutive frames that change a dynamic object to static, or the other way round; 1 to 100.
    /// The published code has no such change.
    pub change_frames: u8,
    /// Frames without a motion over which a static object stays static; 0 to 255; 5.
    pub static_frames: u8,
    /// Frames without a motion over which a dynamic object stays dynamic; 0 to 255; 3: the filter
    /// predicts its motion. The published code: 1, its experiments: 2.
    pub dynamic_frames: u8,
}

impl Default for StateConfig {
    fn default() -> Self {
        Self {
            dynamic_m_s: 0.6,
            static_m_s: 0.3,
            slow_m_s: 1.2,
            sigmas: 2.5,
            static_sigmas: 1.0,
            confirm_frames: 3,
            confirm_static_frames: 2,
            change_frames: 2,
            static_frames: 5,
            dynamic_frames: 3,
        }
    }
}
