//! EuRoC's `sensor.yaml`, one a camera: `T_BS` maps camera coordinates to the body's. TUM VI's
//! files are alike.

use super::format::CalibrationFormat;
use super::{StereoCalibration, kalibr, pose::Pose, tree::Node};
use crate::formats::FormatError;
use crate::formats::calibration::hints::LengthUnit;

/// EuRoC's and TUM VI's files.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "EuRoC",
    files: "EuRoC, TUM VI, Kimera: `sensor.yaml` with `T_BS`, one for each camera",
    unit: LengthUnit::METRE,
    matches: |files| files.has("T_BS"),
    read: |files| read(&files.roots()).map(Into::into),
    example: &[
        (
            "left.yaml",
            r"sensor_type: camera
T_BS:
  cols: 4
  rows: 4
  data: [1, 0, 0, -0.02, 0, 1, 0, 0.02, 0, 0, 1, 0.01, 0, 0, 0, 1]
resolution: [752, 480]
camera_model: pinhole
intrinsics: [458.6, 457.2, 367.2, 248.3]
distortion_model: radial-tangential
distortion_coefficients: [-0.28, 0.07, 0.0002, 0.00002]
",
        ),
        (
            "right.yaml",
            r"sensor_type: camera
T_BS:
  cols: 4
  rows: 4
  data: [1, 0, 0, 0.09, 0, 1, 0, 0.02, 0, 0, 1, 0.01, 0, 0, 0, 1]
resolution: [752, 480]
camera_model: pinhole
intrinsics: [458.6, 457.2, 367.2, 248.3]
distortion_model: radial-tangential
distortion_coefficients: [-0.28, 0.07, 0.0002, 0.00002]
",
        ),
    ],
};

/// Reads the left and the right camera's file.
fn read(roots: &[Node<'_>]) -> Result<StereoCalibration, FormatError> {
    let [left, right] = *roots else {
        return Err(two_files(roots, "sensor.yaml"));
    };
    let [t_body_left, t_body_right] =
        [Pose::from_matrix(left.need("T_BS")?)?, Pose::from_matrix(right.need("T_BS")?)?];
    Ok(StereoCalibration {
        left: kalibr::camera(left)?,
        right: kalibr::camera(right)?,
        placement: t_body_right.inverse().after(&t_body_left).placement(),
        format: FORMAT.name,
    })
}

/// A format that has a file a camera.
pub fn two_files(roots: &[Node<'_>], name: &str) -> FormatError {
    let reason = format!(
        "{} {name} of a pair that has two",
        if roots.len() == 1 { "it is one" } else { "it is among more than two" }
    );
    let action = "Give --calibration twice: the left camera's file, then the right one's";
    roots.first().map_or_else(
        || FormatError::content(std::path::Path::new(""), "there is no file", action),
        |root| root.refuse(&reason, action),
    )
}
