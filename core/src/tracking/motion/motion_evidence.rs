//! Evidence of a motion: an object's speed in a frame, and its errors.

use super::{CameraMotion, MotionConfig, MotionFilter, MotionState, StateConfig};
use crate::geometry::StereoRig;

/// Sigmas that count as "certainly"; the published code: 0.
const SIGMAS: f32 = 2.5;
/// Sigmas that count as "likely"; the published code: 0.
const STATIC_SIGMAS: f32 = 1.0;

/// Measurement of an object's speed in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MotionEvidence {
    /// Speed over ground, m/s.
    pub speed_m_s: f32,
    /// Standard deviation along the direction of motion, m/s.
    pub sigma_m_s: f32,
    /// Standard deviation in all directions together, m/s: the direction of an apparently static
    /// object is meaningless.
    pub spread_m_s: f32,
    /// By how much the cameras' own errors may make it too high, m/s: they can make a static object
    /// seem to move.
    pub bias_m_s: f32,
}

impl MotionEvidence {
    /// The speed of a filter that a frame updated, with the errors that the camera adds to it;
    /// `None` without the camera's own motion.
    pub fn new(
        config: &MotionConfig,
        rig: &StereoRig,
        camera: &CameraMotion,
        filter: &MotionFilter,
        interval_s: f64,
    ) -> Option<Self> {
        let t_current_previous = camera.t_current_previous?;
        let [speed, sigma, spread] = filter.speed();
        // The camera's error of rotation grows with the distance.
        let camera_world = camera.t_world_camera.inverse();
        let static_prediction = camera_world.transform_point(filter.center_world());
        let rotation_error = f64::from(config.camera_rad) * static_prediction.z / interval_s;
        // Depth goes with the inverse of disparity, its change with the inverse square.
        let now = static_prediction + camera_world.rotate(filter.velocity()) * interval_s;
        let passing = (now - t_current_previous.inverse().transform_point(static_prediction))
            .norm()
            / interval_s;
        let side = rig.focal_px * static_prediction.x / (static_prediction.z * rig.center_u_px);
        let error_px =
            f64::from(config.bias_px) + f64::from(config.lens_px) * side * side * side * side;
        let bias = passing * 2.0 * error_px * static_prediction.z / rig.focal_baseline_px_m();
        let with_rotation =
            |sigma: f64| libm::sqrt(sigma * sigma + rotation_error * rotation_error) as f32;
        Some(Self {
            speed_m_s: speed as f32,
            sigma_m_s: with_rotation(sigma),
            spread_m_s: with_rotation(spread),
            bias_m_s: bias as f32,
        })
    }

    /// The state it is classified as; `Uncertain` when neither, or not a number.
    pub fn classify(&self, config: &StateConfig, state: MotionState) -> MotionState {
        let least = self.speed_m_s - self.bias_m_s - SIGMAS * self.sigma_m_s;
        let most = self.speed_m_s + STATIC_SIGMAS * self.spread_m_s;
        let slow_m_s =
            if state == MotionState::Dynamic { config.dynamic_m_s } else { config.slow_m_s };
        if least > config.dynamic_m_s {
            MotionState::Dynamic
        } else if least < config.static_m_s && most < slow_m_s {
            MotionState::Static
        } else {
            MotionState::Uncertain
        }
    }
}
