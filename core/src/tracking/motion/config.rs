//! Settings of motions. Speeds are in metres per second of real time: other frame rates need no
//! other thresholds.

use crate::egomotion::EgomotionConfig;

/// Largest reprojection error of an inlier over its four coordinates together, px; three quarters
/// of it at the last refinement.
const INLIER_PX: f32 = 2.0;

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
    /// Consecutive frames that confirm an uncertain object as dynamic; 1 to 100. The published
    /// code: 1.
    pub confirm_frames: u8,
    /// Frames in a row that must be classified as static to confirm it; 1 to 100; 2: the filter has
    /// averaged over several frames by then. The published code: 1.
    pub confirm_static_frames: u8,
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
            confirm_frames: 3,
            confirm_static_frames: 2,
            dynamic_frames: 3,
        }
    }
}
