//! Mounting of an inertial unit on the left camera.

use super::pose::Pose;
use crate::formats::FormatError;
use dynvox_core::geometry::Transform;
use nalgebra::Matrix3;
use std::path::{Path, PathBuf};

/// Farthest that a unit sits from its camera, m.
const FARTHEST_M: f64 = 10.0;
/// Largest error of a rotation's rows.
const ROTATION_ERROR: f64 = 1e-3;

/// Camera coordinates that a placement leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnitCamera {
    /// The left camera as it takes its pictures.
    Raw,
    /// The left camera of rectified pictures.
    Rectified,
}

/// White noise and random walks of a unit's readings, where files say them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UnitNoise {
    /// White noise of turn rates, rad/s/sqrt(Hz).
    pub turn_density: Option<f64>,
    /// Random walk of the turn rates' bias, rad/s2/sqrt(Hz).
    pub turn_walk: Option<f64>,
    /// White noise of accelerations, m/s2/sqrt(Hz).
    pub force_density: Option<f64>,
    /// Random walk of the accelerations' bias, m/s3/sqrt(Hz).
    pub force_walk: Option<f64>,
}

/// Mounting of an inertial unit on the left camera.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitCalibration {
    /// Unit to camera coordinates.
    pub t_camera_unit: Transform,
    /// Camera coordinates meant.
    pub camera: UnitCamera,
    /// Seconds to add to the times of samples so that they are on the cameras' clock; 0 where
    /// files say nothing.
    pub clock_offset_s: f64,
    /// Noise of its readings.
    pub noise: UnitNoise,
    /// File with the placement.
    pub path: PathBuf,
}

impl UnitCalibration {
    /// A placement without clock and noise.
    pub(super) fn new(t_camera_unit: Transform, camera: UnitCamera, path: &Path) -> Self {
        Self {
            t_camera_unit,
            camera,
            clock_offset_s: 0.0,
            noise: UnitNoise::default(),
            path: path.to_path_buf(),
        }
    }

    /// Unit to the rectified left camera, for raw cameras that rectification turns by
    /// `r_rectified_raw`.
    pub fn t_rectified_unit(&self, r_rectified_raw: Option<&Matrix3<f64>>) -> Transform {
        match (self.camera, r_rectified_raw) {
            (UnitCamera::Raw, Some(r)) => {
                let row = |row: usize| [r[(row, 0)], r[(row, 1)], r[(row, 2)]];
                let turned = Transform::from_rotation_matrix(&[row(0), row(1), row(2)], [0.0; 3]);
                (turned * self.t_camera_unit).normalized()
            }
            _ => self.t_camera_unit,
        }
    }
}

/// A placement that may be that of a unit on a camera.
pub(super) fn checked(pose: &Pose, path: &Path) -> Result<Transform, FormatError> {
    let error = (pose.r * pose.r.transpose() - Matrix3::identity()).abs().max();
    let is_rotation = error <= ROTATION_ERROR && pose.r.determinant() > 0.0;
    if !is_rotation || !pose.t_m.iter().all(|side| side.is_finite()) {
        return Err(FormatError::content(
            path,
            "the inertial unit's placement is no rotation and translation",
            "A rotation has three rows of length 1 at right angles, and turns right-handed axes \
             into right-handed ones: copy the matrix whole",
        ));
    }
    let distance_m = pose.t_m.norm();
    if distance_m > FARTHEST_M {
        return Err(FormatError::content(
            path,
            format!("the inertial unit is {distance_m:.1} m from the camera"),
            "Give its translation in metres",
        ));
    }
    let row = |row: usize| [pose.r[(row, 0)], pose.r[(row, 1)], pose.r[(row, 2)]];
    let t = Transform::from_rotation_matrix(&[row(0), row(1), row(2)], pose.t_m.into());
    Ok(t.normalized())
}
