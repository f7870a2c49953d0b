//! Mounting of KITTI raw's inertial unit: `calib_imu_to_velo.txt` and `calib_velo_to_cam.txt` lead
//! to camera 0, and `R_rect_00` of `calib_cam_to_cam.txt` to that of rectified pictures.

use super::mounting::{UnitCalibration, UnitCamera, checked};
use super::pose::Pose;
use super::tree::Tree;
use crate::formats::FormatError;
use nalgebra::{Matrix3, Vector3};
use std::path::Path;

/// Files of the chain, unit first.
const CHAIN: [&str; 2] = ["calib_imu_to_velo.txt", "calib_velo_to_cam.txt"];
/// File with the rectification.
const CAMERAS: &str = "calib_cam_to_cam.txt";

/// Tells whether a path is the first file of the chain.
pub(super) fn is_part(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name == CHAIN[0])
}

/// Reads the files of a day's folder, or those next to the first of them.
pub(super) fn read(path: &Path) -> Result<UnitCalibration, FormatError> {
    let folder = if path.is_dir() { path } else { path.parent().unwrap_or(Path::new("")) };
    let [unit, velodyne] = CHAIN.map(|name| folder.join(name));
    let t_velodyne_unit = rigid(&unit)?;
    let t_camera_unit = rigid(&velodyne)?.after(&t_velodyne_unit);
    let cameras = folder.join(CAMERAS);
    let text = crate::formats::read_text(&cameras)?;
    let tree = Tree::of_lines(&text, &cameras);
    let r_rectified = Matrix3::from_row_slice(&tree.root().need("R_rect_00")?.array::<9>()?);
    let rectified = Pose { r: r_rectified, t_m: Vector3::zeros() }.after(&t_camera_unit);
    Ok(UnitCalibration::new(checked(&rectified, &unit)?, UnitCamera::Rectified, &unit))
}

/// A rigid motion in lines `R:` and `T:`.
fn rigid(path: &Path) -> Result<Pose, FormatError> {
    let text = crate::formats::read_text(path)?;
    let tree = Tree::of_lines(&text, path);
    let (r, t) = (tree.root().need("R")?.array::<9>()?, tree.root().need("T")?.array::<3>()?);
    Ok(Pose { r: Matrix3::from_row_slice(&r), t_m: Vector3::from(t) })
}
