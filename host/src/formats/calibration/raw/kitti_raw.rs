//! KITTI raw's `calib_cam_to_cam.txt`: lenses (`K_00`, `D_00`, `S_00`) and the benchmark's own
//! rectification (`R_rect_00`, `P_rect_00`, `S_rect_00`) of cameras 0 (left) and 1 (right), the
//! grey pair; of 2 and 3, the colour pair, where there is no grey one.

use super::files::Files;
use super::format::{CalibrationFormat, Cameras};
use super::{
    Placement, RectifiedCameras, StereoCalibration, lens, ros,
    tree::{Node, Tree},
};
use crate::formats::FormatError;
use crate::formats::calibration::hints::LengthUnit;
use dynvox_core::rectify::RawCamera;
use nalgebra::Matrix3;

/// KITTI's file.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "KITTI raw",
    files: "`calib_cam_to_cam.txt`",
    unit: LengthUnit::METRE,
    matches: |files| ["K_00:", "K_02:"].iter().any(|key| files.text().contains(key)),
    read,
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

/// Reads the pair that is wanted, else the first. Images of the rectified size are rectified.
fn read(files: &Files<'_>) -> Result<Cameras, FormatError> {
    let (text, path) = (files.text(), files.path());
    let has = |key: &str| text.lines().any(|line| line.starts_with(key));
    let colour = !has("K_00:") || (files.wants_colour() && has("K_02:"));
    // Early recordings name the rectified lines the other way round.
    let text = ["S", "R", "P"].iter().fold(text.to_owned(), |text, kind| {
        (0..4).fold(text, |text, camera| {
            text.replace(&format!("{kind}_0{camera}_rect:"), &format!("{kind}_rect_0{camera}:"))
        })
    });
    let names = if colour { COLOUR } else { GREY };
    let tree = Tree::of_lines(&text, path);
    let root = tree.root();
    let [raw_size, rectified_size] =
        [root.need(names[0][0])?.size()?, root.need(names[0][3])?.size()?];
    if raw_size != rectified_size && files.known_size() == Some(rectified_size) {
        let p_right = root.need(names[1][5])?;
        let p_left = root.need(names[0][5])?.array()?;
        let cameras = ros::rectified_rig(p_right, &p_left, &p_right.array()?)?;
        return Ok(Cameras::Rectified(RectifiedCameras { size: Some(rectified_size), ..cameras }));
    }
    read_pair(root, names).map(Cameras::Raw)
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

fn read_pair(root: Node<'_>, [left, right]: [Names; 2]) -> Result<StereoCalibration, FormatError> {
    let rotation = |names: Names| {
        Ok::<_, FormatError>(Matrix3::from_row_slice(&root.need(names[4])?.array::<9>()?))
    };
    let p_right = root.need(right[5])?;
    let cameras = ros::rectified_rig(p_right, &root.need(left[5])?.array()?, &p_right.array()?)?;
    Ok(StereoCalibration {
        left: camera(root, left)?,
        right: camera(root, right)?,
        placement: Placement::Rectified {
            r_rectified_left: rotation(left)?,
            r_rectified_right: rotation(right)?,
            rig: cameras.rig,
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
