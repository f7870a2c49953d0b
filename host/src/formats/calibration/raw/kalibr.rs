//! Kalibr's `camchain.yaml`: `cam0` is left, `cam1` right; `T_cn_cnm1` maps coordinates of the
//! first to the second. OpenVINS has `T_imu_cam` or `T_cam_imu` of each camera instead.

use super::format::CalibrationFormat;
use super::{StereoCalibration, lens, pose::Pose, tree::Node};
use crate::formats::FormatError;
use crate::formats::calibration::hints::LengthUnit;
use dynvox_core::rectify::{LensModel, RawCamera, RawRig};

/// Kalibr's file.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "Kalibr",
    files: "`camchain.yaml`, also with an IMU or of OpenVINS: `cam0` left, `cam1` right",
    unit: LengthUnit::METRE,
    matches: |files| files.has("cam0"),
    read: |files| read(files.root_with("cam0").map_or_else(|| files.root(), Ok)?).map(Into::into),
    example: &[(
        "camchain.yaml",
        r"cam0:
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]
  distortion_model: radtan
  intrinsics: [458.6, 457.2, 367.2, 248.3]
  resolution: [752, 480]
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.11]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]
  distortion_model: radtan
  intrinsics: [458.6, 457.2, 367.2, 248.3]
  resolution: [752, 480]
",
    )],
};

/// Reads both cameras.
fn read(root: Node<'_>) -> Result<StereoCalibration, FormatError> {
    let left = root.need("cam0")?;
    let Some(right) = root.get("cam1") else {
        return Err(left.refuse(
            "it is of one camera: cam1 is missing",
            "Calibrate both cameras together, and give the file with cam0 and cam1",
        ));
    };
    Ok(StereoCalibration {
        left: camera(left)?,
        right: camera(right)?,
        placement: motion(left, right)?.placement(),
        format: FORMAT.name,
    })
}

/// Motion of left camera coordinates to right ones.
fn motion(left: Node<'_>, right: Node<'_>) -> Result<Pose, FormatError> {
    if let Some(motion) = right.get("T_cn_cnm1") {
        return Pose::from_matrix(motion);
    }
    let both = |key: &str| Some((left.get(key)?, right.get(key)?));
    if let Some((left, right)) = both("T_cam_imu") {
        return Ok(Pose::from_matrix(right)?.after(&Pose::from_matrix(left)?.inverse()));
    }
    if let Some((left, right)) = both("T_imu_cam") {
        return Ok(Pose::from_matrix(right)?.inverse().after(&Pose::from_matrix(left)?));
    }
    Err(right.refuse(
        "T_cn_cnm1 is missing in cam1",
        "Give it, or T_cam_imu or T_imu_cam of both cameras",
    ))
}

/// A camera of Kalibr's models; EuRoC's files name theirs alike.
pub fn camera(node: Node<'_>) -> Result<RawCamera, FormatError> {
    let size = node.need("resolution")?.size()?;
    let intrinsics = node.need("intrinsics")?;
    let coefficients =
        node.get("distortion_coeffs").or_else(|| node.get("distortion_coefficients"));
    let coefficients = coefficients.map_or(Ok(Vec::new()), |node| node.numbers())?;
    let name = node.get("distortion_model").map_or(Ok("none"), |node| node.text())?;
    let (pinhole, model) = match node.need("camera_model")?.text()?.to_ascii_lowercase().as_str() {
        "pinhole" => (intrinsics.array()?, lens::distortion(node, name, &coefficients)?),
        "ds" => {
            let [xi, alpha, fx, fy, cx, cy] = intrinsics.array()?;
            ([fx, fy, cx, cy], LensModel::DoubleSphere { xi, alpha })
        }
        "eucm" => {
            let [alpha, beta, fx, fy, cx, cy] = intrinsics.array()?;
            ([fx, fy, cx, cy], LensModel::ExtendedUnified { alpha, beta })
        }
        "omni" => {
            let [xi, fx, fy, cx, cy] = intrinsics.array()?;
            lens::unified(node, xi, [fx, fy, cx, cy], &coefficients)?
        }
        other => {
            let reason = format!("the camera model {other} is not known");
            return Err(node.refuse(
                &reason,
                "Known are pinhole, ds, eucm and omni: calibrate again with one of them",
            ));
        }
    };
    lens::camera(node, pinhole, model, size)
}

/// The calibration as a `camchain.yaml`; `None` for a lens Kalibr does not have. A rectification
/// that the calibration gives is left out: Kalibr knows the motion between the cameras alone.
pub fn to_kalibr(calibration: &StereoCalibration) -> Option<String> {
    let RawRig { r_right_left: r, t_right_left_m: t, .. } = calibration.raw_rig();
    let mut text = String::from("cam0:\n");
    text.push_str(&camera_keys(&calibration.left)?);
    text.push_str("cam1:\n  T_cn_cnm1:\n");
    for row in 0..3 {
        text.push_str(&format!(
            "  - [{}, {}, {}, {}]\n",
            r[(row, 0)],
            r[(row, 1)],
            r[(row, 2)],
            t[row]
        ));
    }
    text.push_str("  - [0.0, 0.0, 0.0, 1.0]\n");
    text.push_str(&camera_keys(&calibration.right)?);
    Some(text)
}

fn camera_keys(camera: &RawCamera) -> Option<String> {
    let ([fx, fy], [cx, cy]) = (camera.lens.focal_px(), camera.lens.center_px());
    let list = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
    let (model, name, coefficients, before) = match *camera.lens.model() {
        LensModel::RadialTangential {
            radial: [k1, k2, 0.0, 0.0, 0.0, 0.0],
            tangential: [p1, p2],
        } => ("pinhole", "radtan", vec![k1, k2, p1, p2], vec![]),
        LensModel::Equidistant { radial } => ("pinhole", "equidistant", radial.to_vec(), vec![]),
        LensModel::DoubleSphere { xi, alpha } => ("ds", "none", vec![], vec![xi, alpha]),
        LensModel::ExtendedUnified { alpha, beta } => ("eucm", "none", vec![], vec![alpha, beta]),
        _ => return None,
    };
    Some(format!(
        "  camera_model: {model}\n  distortion_coeffs: [{}]\n  distortion_model: {name}\n  \
         intrinsics: [{}]\n  resolution: [{}, {}]\n",
        list(&coefficients),
        list(&[before, vec![fx, fy, cx, cy]].concat()),
        camera.width,
        camera.height
    ))
}
