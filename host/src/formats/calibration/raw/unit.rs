//! Mounting and noise of an inertial unit, as the files of calibration tools say them.
//!
//! | files | placement | noise |
//! |---|---|---|
//! | Kalibr, OpenVINS | `T_cam_imu`, `T_imu_cam` | `gyroscope_noise_density` |
//! | EuRoC, TUM VI: of unit and camera | `T_BS` of both | as Kalibr |
//! | VINS-Fusion | `body_T_cam0` | `gyr_n`, `acc_n` |
//! | Basalt | `T_imu_cam`, the first | - |
//! | ORB-SLAM3 | `IMU.T_b_c1`, `Tbc` | `IMU.NoiseGyro` |
//! | KITTI raw | `calib_imu_to_velo.txt`, `calib_velo_to_cam.txt` | - |
//! | 12 or 16 numbers | unit to rectified left camera | - |

use super::mounting::{UnitCalibration, UnitCamera, UnitNoise, checked};
use super::pose::Pose;
use super::tree::{Node, Tree};
use super::unit_kitti;
use crate::formats::bounds::CALIBRATION_TEXT;
use crate::formats::rows::{lines_of, numbers_of};
use crate::formats::{FormatError, read_text_within};
use std::path::{Path, PathBuf};

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
        // Camera to body; the unit is the body's origin.
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
        let inner = roots.iter().map(|root| root.get("imu0").unwrap_or(*root));
        inner.filter_map(|root| root.any(keys)).next().map(|node| node.number()).transpose()
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
