//! Basalt's `calib.json`: `T_imu_cam` as positions and quaternions, one of Basalt's lens models for
//! each camera.

use super::format::CalibrationFormat;
use super::{StereoCalibration, lens, pose::Pose, tree::Node};
use crate::formats::FormatError;
use crate::formats::calibration::hints::LengthUnit;
use dynvox_core::rectify::{LensModel, RawCamera};

/// Basalt's file.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "Basalt",
    files: "`calib.json`: `T_imu_cam`, `intrinsics`, `resolution` of two cameras",
    unit: LengthUnit::METRE,
    matches: |files| {
        files.root().is_ok_and(|root| inner(root).has("T_imu_cam") && inner(root).has("intrinsics"))
    },
    read: |files| read(inner(files.root()?)).map(Into::into),
    example: &[(
        "calib.json",
        r#"{"value0": {
  "T_imu_cam": [
    {"px": -0.02, "py": 0, "pz": 0, "qx": 0, "qy": 0, "qz": 0, "qw": 1},
    {"px": 0.09, "py": 0, "pz": 0, "qx": 0, "qy": 0, "qz": 0, "qw": 1}
  ],
  "intrinsics": [
    {"camera_type": "pinhole-radtan8", "intrinsics": {
      "fx": 458.6, "fy": 457.2, "cx": 367.2, "cy": 248.3,
      "k1": -0.28, "k2": 0.07, "p1": 0.0002, "p2": 0.00002, "k3": 0, "k4": 0, "k5": 0, "k6": 0}},
    {"camera_type": "pinhole-radtan8", "intrinsics": {
      "fx": 458.6, "fy": 457.2, "cx": 367.2, "cy": 248.3,
      "k1": -0.28, "k2": 0.07, "p1": 0.0002, "p2": 0.00002, "k3": 0, "k4": 0, "k5": 0, "k6": 0}}
  ],
  "resolution": [[752, 480], [752, 480]]
}}
"#,
    )],
};

/// The values, below the name that Basalt's serializer gives them.
fn inner(root: Node<'_>) -> Node<'_> {
    root.get("value0").unwrap_or(root)
}

/// Reads the first two cameras.
fn read(root: Node<'_>) -> Result<StereoCalibration, FormatError> {
    let two = |key: &str| {
        let list = root.need(key)?;
        let mut elements = list.elements();
        elements.next().zip(elements.next()).ok_or_else(|| {
            list.refuse(&format!("{key} has fewer than two cameras"), "Calibrate two cameras")
        })
    };
    let (t_body_left, t_body_right) = two("T_imu_cam")?;
    let (left, right) = two("intrinsics")?;
    let (left_size, right_size) = two("resolution")?;
    Ok(StereoCalibration {
        left: camera(left, left_size.size()?)?,
        right: camera(right, right_size.size()?)?,
        placement: pose(t_body_right)?.inverse().after(&pose(t_body_left)?).placement(),
        format: FORMAT.name,
    })
}

pub(super) fn pose(node: Node<'_>) -> Result<Pose, FormatError> {
    let numbers = |keys: [&str; 3]| -> Result<[f64; 3], FormatError> {
        let [a, b, c] = keys;
        Ok([node.value_of(a)?, node.value_of(b)?, node.value_of(c)?])
    };
    let [x, y, z] = numbers(["qx", "qy", "qz"])?;
    Pose::from_quaternion([x, y, z, node.value_of("qw")?], numbers(["px", "py", "pz"])?).ok_or_else(
        || {
            node.refuse(
                "the quaternion of T_imu_cam does not have length 1",
                "Copy qx, qy, qz, qw from the calibration's output",
            )
        },
    )
}

fn camera(node: Node<'_>, size: [u32; 2]) -> Result<RawCamera, FormatError> {
    let kind = node.need("camera_type")?;
    let numbers = node.need("intrinsics")?;
    let number = |key: &str| numbers.value_of(key);
    let or_zero = |key: &str| numbers.get(key).map_or(Ok(0.0), |value| value.number());
    let pinhole = [number("fx")?, number("fy")?, number("cx")?, number("cy")?];
    let (pinhole, model) = match kind.text()? {
        "pinhole" => (pinhole, LensModel::IDEAL),
        "pinhole-radtan8" | "pinhole-radtan5" => {
            let mut k = [0.0; 8];
            for (k, key) in k.iter_mut().zip(["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"]) {
                *k = or_zero(key)?;
            }
            (pinhole, lens::radial_tangential(numbers, &k)?)
        }
        "ds" => (pinhole, LensModel::DoubleSphere { xi: number("xi")?, alpha: number("alpha")? }),
        "eucm" => {
            let (alpha, beta) = (number("alpha")?, number("beta")?);
            (pinhole, LensModel::ExtendedUnified { alpha, beta })
        }
        "ucm" => (pinhole, LensModel::ExtendedUnified { alpha: number("alpha")?, beta: 1.0 }),
        "kb4" => {
            let k = [number("k1")?, number("k2")?, number("k3")?, number("k4")?];
            (pinhole, lens::equidistant(numbers, &k)?)
        }
        other => {
            return Err(kind.refuse(
                &format!("the camera model {other} is not known"),
                "Known are pinhole, pinhole-radtan8, ds, eucm, ucm and kb4: calibrate again with \
                 one of them",
            ));
        }
    };
    lens::camera(kind, pinhole, model, size)
}
