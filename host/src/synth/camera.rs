//! Pose of the camera: along the street at constant speed, with a driver's and a car's small
//! motions.

use dynvox_core::geometry::{StereoRig, Transform};
use nalgebra::Vector3;

use super::config::StreetConfig;
use super::optics::Optics;
use super::path::RoadSpan;
use super::random::Rng;

/// Amplitude and frequency of each small motion, two waves each.
const PITCH: [(f64, f64); 2] = [(0.0040, 0.53), (0.0018, 1.37)];
const ROLL: [(f64, f64); 2] = [(0.0035, 0.31), (0.0020, 0.97)];
const YAW: [(f64, f64); 2] = [(0.0080, 0.17), (0.0015, 0.71)];
const BOUNCE_M: [(f64, f64); 2] = [(0.012, 0.61), (0.006, 1.53)];
const DRIFT_M: [(f64, f64); 2] = [(0.14, 0.06), (0.03, 0.23)];

/// Time from one side to the other and back, s.
const SWAY_S: f64 = 2.0;

/// Height of the cameras above the road, m.
pub const CAMERA_HEIGHT_M: f64 = 1.65;

/// Returns the camera's distance along the street at a time, m.
pub fn along_m(config: &StreetConfig, time_s: f64) -> f64 {
    config.speed_m_s * time_s
}

/// Returns the camera's pose on the street at a time.
pub fn t_street_camera(config: &StreetConfig, span: &RoadSpan<'_>, time_s: f64) -> Transform {
    carried(config, time_s, |right_m, yaw_rad| {
        span.t_street_local(along_m(config, time_s), right_m, yaw_rad)
    })
}

/// Returns the camera's pose at a time. `on_road` gives the car's frame on the road for a shift, m,
/// and a turn, rad, both to the right.
pub fn carried(
    config: &StreetConfig,
    time_s: f64,
    on_road: impl FnOnce(f64, f64) -> Transform,
) -> Transform {
    // One generator for all waves: their phases depend on the seed only, not on the time.
    let mut rng = Rng::new(config.seed, 0x00CA_3E2A, 0);
    let mut wave = |parts: [(f64, f64); 2]| {
        let full_circle_rad = 2.0 * core::f64::consts::PI;
        let sum: f64 = parts
            .iter()
            .map(|&(size, rate)| size * libm::sin(full_circle_rad * (rate * time_s + rng.unit())))
            .sum();
        sum * config.shake
    };
    let (pitch, roll, yaw, bounce, drift) =
        (wave(PITCH), wave(ROLL), wave(YAW), wave(BOUNCE_M), wave(DRIFT_M));
    // A street without sway keeps the bits it had before there was any.
    let yaw = if config.sway_deg_s == 0.0 { yaw } else { yaw + sway_rad(config, time_s) };
    // Rotations in the order yaw, pitch, roll, as a car's body moves on its springs.
    let height = Vector3::new(0.0, bounce - CAMERA_HEIGHT_M, 0.0);
    on_road(drift, yaw)
        * Transform::new(Vector3::zeros(), height)
        * Transform::new(Vector3::new(pitch, 0.0, 0.0), Vector3::zeros())
        * Transform::new(Vector3::new(0.0, 0.0, roll), Vector3::zeros())
}

/// Turn to the side at a time, rad.
fn sway_rad(config: &StreetConfig, time_s: f64) -> f64 {
    let full_circle_rad = 2.0 * core::f64::consts::PI;
    let widest_rad = config.sway_deg_s.to_radians() * SWAY_S / full_circle_rad;
    widest_rad * libm::sin(full_circle_rad * time_s / SWAY_S)
}

/// The rig of a configured street: KITTI's proportions.
fn rig(config: &StreetConfig) -> StereoRig {
    StereoRig {
        focal_px: config.focal_px(),
        center_u_px: 0.5 * (f64::from(config.width) - 1.0),
        center_v_px: libm::floor(0.46 * f64::from(config.height)),
        baseline_m: config.baseline_m,
    }
}

/// Cameras of a configured street.
pub fn optics(config: &StreetConfig) -> Optics {
    Optics {
        section: "street",
        seed: config.seed,
        size: [config.width, config.height],
        rig: rig(config),
        lens: config.lens.clone(),
        rig_error: config.rig_error,
        noise_sigma: config.noise_sigma,
        gain_difference: config.gain_difference,
    }
}
