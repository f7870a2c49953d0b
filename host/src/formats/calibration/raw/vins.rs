//! VINS-Fusion's configuration: `body_T_cam0` and `body_T_cam1`, and the camodocal files of both
//! cameras, named by `cam0_calib` and `cam1_calib` or given with it.

use super::files::Files;
use super::format::CalibrationFormat;
use super::{
    StereoCalibration, camodocal,
    pose::Pose,
    tree::{Node, Tree},
};
use crate::formats::FormatError;
use crate::formats::calibration::hints::LengthUnit;
use dynvox_core::rectify::RawCamera;

/// VINS-Fusion's files.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "VINS-Fusion",
    files: "its configuration with `body_T_cam0` and `body_T_cam1`, and the files that \
            `cam0_calib` and `cam1_calib` name beside it",
    unit: LengthUnit::METRE,
    matches: |files| files.has("body_T_cam0"),
    read: |files| read(files).map(Into::into),
    example: &[
        (
            "config.yaml",
            r"%YAML:1.0
cam0_calib: cam0.yaml
cam1_calib: cam1.yaml
body_T_cam0: !!opencv-matrix
   data: [1, 0, 0, -0.02, 0, 1, 0, 0.02, 0, 0, 1, 0.01, 0, 0, 0, 1]
body_T_cam1: !!opencv-matrix
   data: [1, 0, 0, 0.09, 0, 1, 0, 0.02, 0, 0, 1, 0.01, 0, 0, 0, 1]
",
        ),
        ("cam0.yaml", camodocal::FORMAT.example[0].1),
        ("cam1.yaml", camodocal::FORMAT.example[1].1),
    ],
};

/// Reads the configuration and the cameras it names.
fn read(files: &Files<'_>) -> Result<StereoCalibration, FormatError> {
    let config = files.root_with("body_T_cam0").map_or_else(|| files.root(), Ok)?;
    let pose = |key: &str| Pose::from_matrix(config.need(key)?);
    let (t_body_left, t_body_right) = (pose("body_T_cam0")?, pose("body_T_cam1")?);
    let given: Vec<Node<'_>> =
        files.roots().into_iter().filter(|root| root.has("model_type")).collect();
    let [left, right] = match *given.as_slice() {
        [left, right] => [camodocal::camera(left)?, camodocal::camera(right)?],
        _ => [named(config, "cam0_calib")?, named(config, "cam1_calib")?],
    };
    Ok(StereoCalibration {
        left,
        right,
        placement: t_body_right.inverse().after(&t_body_left).placement(),
        format: FORMAT.name,
    })
}

/// The camera of a file that the configuration names, beside it.
fn named(config: Node<'_>, key: &str) -> Result<RawCamera, FormatError> {
    let name = config.need(key)?;
    let path = config.path().with_file_name(name.text()?);
    if !path.is_file() {
        return Err(name.refuse(
            &format!("{key} names {}, which is not beside it", name.text()?),
            "Put the file there, or give it with the configuration: three times --calibration",
        ));
    }
    camodocal::camera(Tree::read(&path)?.root())
}
