//! ROS `CameraInfo` as `camera_calibration` writes it: one YAML file a camera, with the
//! rectification and its projection.

use super::format::CalibrationFormat;
use super::{Placement, StereoCalibration, euroc, lens, tree::Node};
use crate::formats::FormatError;
use dynvox_core::geometry::StereoRig;
use dynvox_core::rectify::RawCamera;
use nalgebra::Matrix3;

/// ROS's files.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "ROS CameraInfo",
    files: "`CameraInfo` of `camera_calibration`, one YAML file for each camera",
    matches: |files| files.has("projection_matrix") || files.has("rectification_matrix"),
    read: |files| read(&files.roots()),
    example: &[
        (
            "left.yaml",
            r"image_width: 752
image_height: 480
camera_matrix:
  data: [458.6, 0, 367.2, 0, 457.2, 248.3, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  data: [-0.28, 0.07, 0.0002, 0.00002, 0]
rectification_matrix:
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  data: [400, 0, 370, 0, 0, 400, 250, 0, 0, 0, 1, 0]
",
        ),
        (
            "right.yaml",
            r"image_width: 752
image_height: 480
camera_matrix:
  data: [458.6, 0, 367.2, 0, 457.2, 248.3, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  data: [-0.28, 0.07, 0.0002, 0.00002, 0]
rectification_matrix:
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  data: [400, 0, 370, -44, 0, 400, 250, 0, 0, 0, 1, 0]
",
        ),
    ],
};

/// Reads the left and the right camera's file.
fn read(roots: &[Node<'_>]) -> Result<StereoCalibration, FormatError> {
    let [left, right] = *roots else {
        return Err(euroc::two_files(roots, "CameraInfo file"));
    };
    let rotation = |node: Node<'_>| {
        Ok::<_, FormatError>(Matrix3::from_row_slice(
            &node.need("rectification_matrix")?.array::<9>()?,
        ))
    };
    let [p_left, p_right]: [[f64; 12]; 2] =
        [left.need("projection_matrix")?.array()?, right.need("projection_matrix")?.array()?];
    Ok(StereoCalibration {
        left: camera(left)?,
        right: camera(right)?,
        placement: Placement::Rectified {
            r_rectified_left: rotation(left)?,
            r_rectified_right: rotation(right)?,
            rig: rectified_rig(right, &p_left, &p_right)?,
            size: [left.need("image_width")?.pixels()?, left.need("image_height")?.pixels()?],
        },
        format: FORMAT.name,
    })
}

/// The rig of two projection matrices with one focal length and centre.
pub fn rectified_rig(
    at: Node<'_>,
    p_left: &[f64; 12],
    p_right: &[f64; 12],
) -> Result<StereoRig, FormatError> {
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-3 * (1.0 + a.abs());
    let shared = [0, 5, 2, 6].iter().all(|&entry| near(p_left[entry], p_right[entry]))
        && near(p_left[0], p_left[5]);
    if !shared {
        let reason = "the two projection matrices differ in focal length or principal point";
        return Err(at.refuse(
            reason,
            "Rectify with zero disparity at infinity (CALIB_ZERO_DISPARITY), or \
                               give rotation and translation instead",
        ));
    }
    let rig = StereoRig {
        focal_px: p_left[0],
        center_u_px: p_left[2],
        center_v_px: p_left[6],
        baseline_m: (p_left[3] - p_right[3]) / p_left[0],
    };
    super::super::checked(rig, at.path())
}

fn camera(node: Node<'_>) -> Result<RawCamera, FormatError> {
    let [fx, _, cx, _, fy, cy, ..] = node.need("camera_matrix")?.array::<9>()?;
    let name = node.get("distortion_model").map_or(Ok("plumb_bob"), |node| node.text())?;
    let coefficients = node.need("distortion_coefficients")?.numbers()?;
    let model = lens::distortion(node, name, &coefficients)?;
    lens::camera(
        node,
        [fx, fy, cx, cy],
        model,
        [node.need("image_width")?.pixels()?, node.need("image_height")?.pixels()?],
    )
}
