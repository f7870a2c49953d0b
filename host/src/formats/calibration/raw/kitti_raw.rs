//! KITTI raw's `calib_cam_to_cam.txt`: lenses (`K_00`, `D_00`, `S_00`) and the benchmark's own
//! rectification (`R_rect_00`, `P_rect_00`, `S_rect_00`) of cameras 0 (left) and 1 (right), the
//! grey pair; of 2 and 3, the colour pair, where there is no grey one.

use super::format::CalibrationFormat;
use super::{
    Placement, StereoCalibration, lens, ros,
    tree::{Node, Tree},
};
use crate::formats::FormatError;
use dynvox_core::rectify::RawCamera;
use nalgebra::Matrix3;
use std::path::Path;

/// KITTI's file.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "KITTI raw",
    files: "`calib_cam_to_cam.txt`",
    matches: |files| files.ends_in("txt"),
    read: |files| read(files.text(), files.path()),
    example: &[(
        "calib_cam_to_cam.txt",
        r"calib_time: 09-Jan-2012 13:57:47
S_00: 7.52e+02 4.80e+02
K_00: 458.6 0 367.2 0 457.2 248.3 0 0 1
D_00: -0.28 0.07 0.0002 0.00002 0
S_rect_00: 700 400
R_rect_00: 1 0 0 0 1 0 0 0 1
P_rect_00: 400 0 370 0 0 400 250 0 0 0 1 0
S_01: 7.52e+02 4.80e+02
K_01: 458.6 0 367.2 0 457.2 248.3 0 0 1
D_01: -0.28 0.07 0.0002 0.00002 0
S_rect_01: 700 400
R_rect_01: 1 0 0 0 1 0 0 0 1
P_rect_01: 400 0 370 -44 0 400 250 0 0 0 1 0
",
    )],
};

/// Reads the file's first pair.
fn read(text: &str, path: &Path) -> Result<StereoCalibration, FormatError> {
    let pair = if text.lines().any(|line| line.starts_with("K_00:")) { GREY } else { COLOUR };
    read_pair(text, path, pair)
}

/// Names of one camera's lines: size, matrix, distortion; then rectified size, rotation,
/// projection.
type Names = [&'static str; 6];
const GREY: [Names; 2] = [
    ["S_00", "K_00", "D_00", "S_rect_00", "R_rect_00", "P_rect_00"],
    ["S_01", "K_01", "D_01", "S_rect_01", "R_rect_01", "P_rect_01"],
];
const COLOUR: [Names; 2] = [
    ["S_02", "K_02", "D_02", "S_rect_02", "R_rect_02", "P_rect_02"],
    ["S_03", "K_03", "D_03", "S_rect_03", "R_rect_03", "P_rect_03"],
];

fn read_pair(
    text: &str,
    path: &Path,
    [left, right]: [Names; 2],
) -> Result<StereoCalibration, FormatError> {
    let tree = Tree::of_lines(text, path);
    let root = tree.root();
    let rotation = |names: Names| {
        Ok::<_, FormatError>(Matrix3::from_row_slice(&root.need(names[4])?.array::<9>()?))
    };
    let rig =
        ros::rectified_rig(root, &root.need(left[5])?.array()?, &root.need(right[5])?.array()?)?;
    Ok(StereoCalibration {
        left: camera(root, left)?,
        right: camera(root, right)?,
        placement: Placement::Rectified {
            r_rectified_left: rotation(left)?,
            r_rectified_right: rotation(right)?,
            rig,
            size: root.need(left[3])?.size()?,
        },
        format: FORMAT.name,
    })
}

fn camera(root: Node<'_>, names: Names) -> Result<RawCamera, FormatError> {
    let [fx, _, cx, _, fy, cy, ..] = root.need(names[1])?.array::<9>()?;
    let model = lens::radial_tangential(root, &root.need(names[2])?.numbers()?)?;
    lens::camera(root, [fx, fy, cx, cy], model, root.need(names[0])?.size()?)
}
