//! camodocal: one YAML file a camera, and `extrinsics.yaml`, whose transform maps left camera
//! coordinates to right ones.

use super::format::CalibrationFormat;
use super::{
    StereoCalibration, lens,
    pose::Pose,
    tree::{Node, Tree},
};
use crate::formats::FormatError;
use crate::formats::calibration::hints::LengthUnit;
use dynvox_core::rectify::{LensModel, RawCamera};

/// camodocal's files.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "camodocal",
    files: "one YAML file for each camera, and `extrinsics.yaml`",
    unit: LengthUnit::METRE,
    matches: |files| files.has("model_type"),
    read: |files| read(&files.roots()).map(Into::into),
    example: &[
        (
            "left.yaml",
            r"%YAML:1.0
---
model_type: PINHOLE
image_width: 752
image_height: 480
distortion_parameters:
   k1: -0.28
   k2: 0.07
   p1: 0.0002
   p2: 0.00002
projection_parameters:
   fx: 458.6
   fy: 457.2
   cx: 367.2
   cy: 248.3
",
        ),
        (
            "right.yaml",
            r"%YAML:1.0
---
model_type: PINHOLE
image_width: 752
image_height: 480
distortion_parameters:
   k1: -0.28
   k2: 0.07
   p1: 0.0002
   p2: 0.00002
projection_parameters:
   fx: 458.6
   fy: 457.2
   cx: 367.2
   cy: 248.3
",
        ),
        (
            "extrinsics.yaml",
            r"%YAML:1.0
---
transform:
   q_x: 0.
   q_y: 0.
   q_z: 0.
   q_w: 1.
   t_x: -0.11
   t_y: 0.
   t_z: 0.
",
        ),
    ],
};

/// Reads two camera files; the extrinsics from a third, or from `extrinsics.yaml` beside the first.
fn read(roots: &[Node<'_>]) -> Result<StereoCalibration, FormatError> {
    let (&[left, right], rest) = roots
        .split_first_chunk::<2>()
        .ok_or_else(|| super::euroc::two_files(roots, "camera file"))?;
    let beside = match rest.first() {
        Some(_) => None,
        None => Some(Tree::read(&left.path().with_file_name("extrinsics.yaml"))?),
    };
    let extrinsics = rest.first().copied().or_else(|| beside.as_ref().map(Tree::root));
    let extrinsics = extrinsics.unwrap_or(left);
    let transform = extrinsics.need("transform")?;
    let number = |key| transform.need(key)?.number();
    let quaternion = [number("q_x")?, number("q_y")?, number("q_z")?, number("q_w")?];
    let translation = [number("t_x")?, number("t_y")?, number("t_z")?];
    let motion = Pose::from_quaternion(quaternion, translation).ok_or_else(|| {
        transform.refuse(
            "the quaternion does not have length 1",
            "Copy q_x, q_y, q_z, q_w from the calibration's output",
        )
    })?;
    Ok(StereoCalibration {
        left: camera(left)?,
        right: camera(right)?,
        placement: motion.placement(),
        format: FORMAT.name,
    })
}

/// A camera of camodocal's models.
pub fn camera(node: Node<'_>) -> Result<RawCamera, FormatError> {
    let projection = node.need("projection_parameters")?;
    let parameters = |of: Node<'_>, keys: [&'static str; 4]| -> Result<[f64; 4], FormatError> {
        let mut values = [0.0; 4];
        for (value, key) in values.iter_mut().zip(keys) {
            *value = of.value_of(key)?;
        }
        Ok(values)
    };
    let (pinhole, model) = match node.need("model_type")?.text()? {
        "PINHOLE" => {
            let coefficients =
                parameters(node.need("distortion_parameters")?, ["k1", "k2", "p1", "p2"])?;
            (
                parameters(projection, ["fx", "fy", "cx", "cy"])?,
                lens::radial_tangential(node, &coefficients)?,
            )
        }
        "KANNALA_BRANDT" => {
            let radial = parameters(projection, ["k2", "k3", "k4", "k5"])?;
            (parameters(projection, ["mu", "mv", "u0", "v0"])?, LensModel::Equidistant { radial })
        }
        "MEI" => {
            let coefficients =
                parameters(node.need("distortion_parameters")?, ["k1", "k2", "p1", "p2"])?;
            let xi = node.need("mirror_parameters")?.need("xi")?.number()?;
            lens::unified(
                node,
                xi,
                parameters(projection, ["gamma1", "gamma2", "u0", "v0"])?,
                &coefficients,
            )?
        }
        other => {
            let reason = format!("the camera model {other} is not known");
            return Err(node.refuse(&reason, "Known are PINHOLE, KANNALA_BRANDT and MEI"));
        }
    };
    lens::camera(
        node,
        pinhole,
        model,
        [node.need("image_width")?.pixels()?, node.need("image_height")?.pixels()?],
    )
}
