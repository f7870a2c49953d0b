//! Mounting, clock and noise of an inertial unit.

use crate::{
    geometry::Transform,
    settings::{Problems, require},
};

/// Inertial unit that is fixed to the left camera.
///
/// ```
/// use dynvox_core::{Config, geometry::{StereoRig, Transform}, inertial::InertialUnit};
///
/// let rig = StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// let unit = InertialUnit::new(Transform::IDENTITY);
/// let config = Config { inertial: Some(unit), ..Config::for_rig(rig) };
/// assert!(config.validate().is_empty());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct InertialUnit {
    /// Unit's axes to those of the rectified left camera.
    pub t_camera_unit: Transform,
    /// Seconds to add to the samples' times so that they are on the camera's clock, where they are
    /// known; what remains is found from the turns. From -1 to 1; 0.
    pub clock_offset_s: f64,
    /// Noise density of turn rates, rad/s/sqrt(Hz); above 0; 0.001.
    pub turn_density: f64,
    /// Bias of turn rates that the unit may begin with, one sigma, rad/s; above 0; 0.1.
    pub turn_bias_sigma: f64,
    /// Random walk of that bias, rad/s2/sqrt(Hz); 0 and more; 0.0001.
    pub turn_walk: f64,
    /// Constant error of the specific force, one sigma, m/s2; above 0; 0.03.
    pub force_bias_sigma: f64,
    /// Largest turn rate that an axis can show, rad/s: a sample at it is saturated; above 0; 34.
    pub turn_range: f64,
    /// Largest specific force that an axis can show, m/s2; above 0; 150.
    pub force_range: f64,
}

/// Largest clock offset that can be configured, s.
const CLOCK_OFFSET_MAX_S: f64 = 1.0;

impl InertialUnit {
    /// A unit of the common kind (MEMS) in that place; set what a calibration knows better.
    pub fn new(t_camera_unit: Transform) -> Self {
        Self {
            t_camera_unit,
            clock_offset_s: 0.0,
            turn_density: 0.001,
            turn_bias_sigma: 0.1,
            turn_walk: 0.0001,
            force_bias_sigma: 0.03,
            turn_range: 34.0,
            force_range: 150.0,
        }
    }

    /// Notes everything wrong with the unit.
    pub fn validate(&self, problems: &mut Problems) {
        require(
            problems,
            self.t_camera_unit.is_finite() && self.t_camera_unit.is_rotation(),
            "inertial.t_camera_unit",
            "must be a rotation and a translation",
        );
        require(
            problems,
            libm::fabs(self.clock_offset_s) <= CLOCK_OFFSET_MAX_S,
            "inertial.clock_offset_s",
            "must be from -1 to 1",
        );
        let positive = |value: f64| value.is_finite() && value > 0.0;
        let sizes = [
            (positive(self.turn_density), "inertial.turn_density"),
            (positive(self.turn_bias_sigma), "inertial.turn_bias_sigma"),
            (positive(self.turn_walk) || self.turn_walk == 0.0, "inertial.turn_walk"),
            (positive(self.force_bias_sigma), "inertial.force_bias_sigma"),
            (positive(self.turn_range), "inertial.turn_range"),
            (positive(self.force_range), "inertial.force_range"),
        ];
        for (holds, key) in sizes {
            require(problems, holds, key, "must be a positive number");
        }
    }
}
