//! Kalibr's `camchain.yaml`: `cam0` is left, `cam1` right; `T_cn_cnm1` maps coordinates of the first to the second.

use super::{Placement, StereoCalibration, lens, tree::Node};
use crate::formats::FormatError;
use dynvox_core::rectify::{LensModel, RawCamera};
use nalgebra::{Matrix3, Matrix4, Vector3};

/// Reads both cameras.
pub fn read(root: Node<'_>) -> Result<StereoCalibration, FormatError> {
    let [left, right] = [root.need("cam0")?, root.need("cam1")?];
    let (r_right_left, t_right_left_m) = rigid(right.need("T_cn_cnm1")?)?;
    Ok(StereoCalibration {
        left: camera(left)?,
        right: camera(right)?,
        placement: Placement::Motion { r_right_left, t_right_left_m },
        format: "Kalibr",
    })
}

/// Rotation and translation of a 4 x 4 matrix.
pub fn rigid(node: Node<'_>) -> Result<(Matrix3<f64>, Vector3<f64>), FormatError> {
    let matrix = Matrix4::from_row_slice(&node.array::<16>()?);
    Ok((matrix.fixed_view::<3, 3>(0, 0).into(), matrix.fixed_view::<3, 1>(0, 3).into()))
}

/// A camera of Kalibr's models; EuRoC's files name theirs alike.
pub fn camera(node: Node<'_>) -> Result<RawCamera, FormatError> {
    let size = node.need("resolution")?.size()?;
    let intrinsics = node.need("intrinsics")?;
    let coefficients = node.get("distortion_coeffs").or_else(|| node.get("distortion_coefficients"));
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
            return Err(node.refuse(&reason, "Known are pinhole, ds, eucm, and omni without distortion: calibrate again with one of them"));
        }
    };
    lens::camera(node, pinhole, model, size)
}
