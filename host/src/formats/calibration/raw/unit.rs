//! Mounting and noise of an inertial unit, as the files of calibration tools say them.
//!
//! | files | placement | noise |
//! |---|---|---|
//! | Kalibr, OpenVINS: `camchain-imucam.yaml`, `imu.yaml` | `T_cam_imu`, `T_imu_cam` of `cam0` | `gyroscope_noise_density` and so on |
//! | EuRoC, TUM VI: `imu0/sensor.yaml`, `cam0/sensor.yaml` | `T_BS` of both | as Kalibr |
//! | VINS-Fusion | `body_T_cam0` | `gyr_n`, `acc_n` |
//! | Basalt | `T_imu_cam`, the first | - |
//! | ORB-SLAM3 | `IMU.T_b_c1`, `Tbc` | `IMU.NoiseGyro` and so on |
//! | KITTI raw | `calib_imu_to_velo.txt`, `calib_velo_to_cam.txt` | - |
//! | 12 or 16 numbers | the matrix of unit to rectified left camera | - |

use super::pose::Pose;
use super::tree::{Node, Tree};
use super::unit_kitti;
use crate::formats::bounds::CALIBRATION_TEXT;
use crate::formats::rows::{lines_of, numbers_of};
use crate::formats::{FormatError, read_text_within};
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
    /// Reads the files of a calibration: one with the placement, others with the noise.
    ///
    /// # Errors
    /// A file cannot be read, none has a placement, or it is no rigid motion of a unit on a camera.
    pub fn read(paths: &[PathBuf]) -> Result<Self, FormatError> {
        Self::find(paths)?.ok_or_else(|| {
            FormatError::content(
                paths.first().map_or(Path::new(""), PathBuf::as_path),
                "it does not say how the inertial unit is mounted",
                "Give Kalibr's camchain with T_cam_imu, EuRoC's imu0/sensor.yaml and \
                 cam0/sensor.yaml, or the 12 numbers of the matrix of unit to left camera \
                 coordinates",
            )
        })
    }

    /// Reads files that may say nothing about a unit; `None` where they do not.
    ///
    /// # Errors
    /// A file cannot be read, or what it says cannot be used.
    pub fn find(paths: &[PathBuf]) -> Result<Option<Self>, FormatError> {
        let mut trees = Vec::new();
        for path in paths {
            if path.is_dir() || unit_kitti::is_part(path) {
                return unit_kitti::read(path).map(Some);
            }
            let text = read_text_within(path, &CALIBRATION_TEXT)?;
            if let Some(matrix) = matrix(path, &text) {
                return checked(&matrix, path)
                    .map(|t| Some(Self::new(t, UnitCamera::Rectified, path)));
            }
            trees.push(Tree::from_text(&text, path)?);
        }
        let roots: Vec<Node<'_>> = trees.iter().map(Tree::root).collect();
        let Some((at, pose)) = placement(&roots)? else { return Ok(None) };
        let path = at.path();
        let mut found = Self::new(checked(&pose, path)?, UnitCamera::Raw, path);
        found.clock_offset_s = clock_offset_s(&roots)?;
        found.noise = noise(&roots)?;
        Ok(Some(found))
    }

    fn new(t_camera_unit: Transform, camera: UnitCamera, path: &Path) -> Self {
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

/// The first placement that a file says, and the file.
fn placement<'t>(roots: &[Node<'t>]) -> Result<Option<(Node<'t>, Pose)>, FormatError> {
    for root in roots {
        let root = root.get("value0").unwrap_or(*root);
        if let Some(camera) = root.get("cam0") {
            if let Some(matrix) = camera.any(&["T_cam_imu", "T_ci"]) {
                return Ok(Some((matrix, Pose::from_matrix(matrix)?)));
            }
            if let Some(matrix) = camera.any(&["T_imu_cam", "T_ic"]) {
                return Ok(Some((matrix, Pose::from_matrix(matrix)?.inverse())));
            }
        }
        // Camera to body, of which the unit is the origin.
        if let Some(matrix) = root.any(&["body_T_cam0", "IMU.T_b_c1", "Tbc", "T_b_c1"]) {
            return Ok(Some((matrix, Pose::from_matrix(matrix)?.inverse())));
        }
        if let Some(first) = root.get("T_imu_cam").and_then(|list| list.elements().next()) {
            return Ok(Some((first, super::basalt::pose(first)?.inverse())));
        }
    }
    // EuRoC: a file for each sensor.
    let of_kind = |kind: &str| {
        let is = |root: &&Node<'t>| {
            root.get("sensor_type").is_some_and(|node| node.text().is_ok_and(|text| text == kind))
        };
        roots.iter().filter(is).find_map(|root| root.get("T_BS"))
    };
    let (Some(unit), Some(camera)) = (of_kind("imu"), of_kind("camera")) else { return Ok(None) };
    let (t_body_unit, t_body_camera) = (Pose::from_matrix(unit)?, Pose::from_matrix(camera)?);
    Ok(Some((unit, t_body_camera.inverse().after(&t_body_unit))))
}

/// Seconds to add to the unit's times: Kalibr's `timeshift_cam_imu` and VINS's `td` are what is
/// added to the camera's.
fn clock_offset_s(roots: &[Node<'_>]) -> Result<f64, FormatError> {
    for root in roots {
        let shift = root.get("cam0").and_then(|camera| camera.get("timeshift_cam_imu"));
        if let Some(shift) = shift.or_else(|| root.get("td")) {
            return shift.number().map(|shift_s| -shift_s);
        }
    }
    Ok(0.0)
}

/// The noise that files say.
fn noise(roots: &[Node<'_>]) -> Result<UnitNoise, FormatError> {
    let number = |keys: &[&str]| {
        let within = |root: &Node<'_>| {
            let inner = root.get("imu0").unwrap_or(*root);
            inner.any(keys)
        };
        roots.iter().find_map(within).map(|node| node.number()).transpose()
    };
    Ok(UnitNoise {
        turn_density: number(&["gyroscope_noise_density", "gyr_n", "IMU.NoiseGyro"])?,
        turn_walk: number(&["gyroscope_random_walk", "gyr_w", "IMU.GyroWalk"])?,
        force_density: number(&["accelerometer_noise_density", "acc_n", "IMU.NoiseAcc"])?,
        force_walk: number(&["accelerometer_random_walk", "acc_w", "IMU.AccWalk"])?,
    })
}

/// A matrix of 12 or 16 numbers that is all a file holds.
fn matrix(path: &Path, text: &str) -> Option<Pose> {
    let rows: Vec<Vec<f64>> =
        lines_of(text).map(|(_, row)| numbers_of(row)).collect::<Option<_>>()?;
    let numbers: Vec<f64> = rows.concat();
    if !matches!(numbers.len(), 12 | 16) {
        return None;
    }
    let tree = Tree::of_values(serde_json::json!({ "matrix": numbers }), text, path);
    tree.root().get("matrix").and_then(|node| Pose::from_matrix(node).ok())
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
