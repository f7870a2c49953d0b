//! Our own format: TOML with units in its keys.

use super::format::CalibrationFormat;
use super::{Placement, StereoCalibration};
use crate::formats::FormatError;
use crate::formats::calibration::{hints::LengthUnit, lens_table};
use dynvox_core::geometry::StereoRig;
use dynvox_core::rectify::{Lens, LensModel, RawCamera};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Our own file.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "dynvox",
    files: "TOML with units in its keys",
    unit: LengthUnit::METRE,
    matches: |files| files.ends_in("toml"),
    read: |files| read(files.text(), files.path()).map(Into::into),
    example: &[(
        "own.toml",
        r#"[left]
width_px = 752
height_px = 480
focal_px = [458.6, 457.2]
center_px = [367.2, 248.3]
[left.lens]
model = "radial_tangential"
radial = [-0.28, 0.07, 0.0, 0.0, 0.0, 0.0]
tangential = [0.0002, 0.00002]
[right]
width_px = 752
height_px = 480
focal_px = [458.6, 457.2]
center_px = [367.2, 248.3]
[right.lens]
model = "radial_tangential"
radial = [-0.28, 0.07, 0.0, 0.0, 0.0, 0.0]
tangential = [0.0002, 0.00002]
[right_from_left]
rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
translation_m = [-0.11, 0.0, 0.0]
"#,
    )],
};

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    left: Camera,
    right: Camera,
    #[serde(skip_serializing_if = "Option::is_none")]
    right_from_left: Option<Motion>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rectified: Option<Rectified>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Camera {
    width_px: u32,
    height_px: u32,
    focal_px: [f64; 2],
    center_px: [f64; 2],
    #[serde(with = "lens_table")]
    lens: LensModel,
}

/// Left camera coordinates to right ones.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Motion {
    rotation: [[f64; 3]; 3],
    translation_m: [f64; 3],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Rectified {
    width_px: u32,
    height_px: u32,
    focal_px: f64,
    center_px: [f64; 2],
    baseline_m: f64,
    rotation_left: [[f64; 3]; 3],
    rotation_right: [[f64; 3]; 3],
}

fn matrix(rows: &[[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_row_slice(rows.as_flattened())
}

fn rows(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    matrix.transpose().into()
}

impl Camera {
    fn of(camera: &RawCamera) -> Self {
        Self {
            width_px: camera.width,
            height_px: camera.height,
            focal_px: camera.lens.focal_px(),
            center_px: camera.lens.center_px(),
            lens: *camera.lens.model(),
        }
    }

    fn raw(&self, path: &Path) -> Result<RawCamera, FormatError> {
        let lens = Lens::new(self.focal_px, self.center_px, self.lens).map_err(|problem| {
            FormatError::content(path, problem.to_string(), "Correct the lens's numbers")
        })?;
        Ok(RawCamera { lens, width: self.width_px, height: self.height_px })
    }
}

/// Reads a file.
fn read(text: &str, path: &Path) -> Result<StereoCalibration, FormatError> {
    let file: File = toml::from_str(text).map_err(|error| {
        let reason = error.message().trim().replace('\n', " ");
        FormatError::content(
            path,
            format!("it is not a calibration: {reason}"),
            "`dynvox calibration` writes such a file from any format it reads",
        )
    })?;
    let placement = match (&file.right_from_left, &file.rectified) {
        (Some(motion), None) => Placement::Motion {
            r_right_left: matrix(&motion.rotation),
            t_right_left_m: Vector3::from(motion.translation_m),
        },
        (None, Some(given)) => Placement::Rectified {
            r_rectified_left: matrix(&given.rotation_left),
            r_rectified_right: matrix(&given.rotation_right),
            rig: StereoRig {
                focal_px: given.focal_px,
                center_u_px: given.center_px[0],
                center_v_px: given.center_px[1],
                baseline_m: given.baseline_m,
            },
            size: [given.width_px, given.height_px],
        },
        _ => {
            let reason = "it needs either [right_from_left] or [rectified]";
            return Err(FormatError::content(path, reason, "Give one of the two sections"));
        }
    };
    Ok(StereoCalibration {
        left: file.left.raw(path)?,
        right: file.right.raw(path)?,
        placement,
        format: FORMAT.name,
    })
}

/// The calibration as a file of our own.
pub fn to_toml(calibration: &StereoCalibration) -> String {
    let (motion, rectified) = match &calibration.placement {
        Placement::Motion { r_right_left, t_right_left_m }
        | Placement::Vertical { r_right_left, t_right_left_m } => (
            Some(Motion { rotation: rows(r_right_left), translation_m: (*t_right_left_m).into() }),
            None,
        ),
        Placement::Rectified { r_rectified_left, r_rectified_right, rig, size } => {
            let given = Rectified {
                width_px: size[0],
                height_px: size[1],
                focal_px: rig.focal_px,
                center_px: [rig.center_u_px, rig.center_v_px],
                baseline_m: rig.baseline_m,
                rotation_left: rows(r_rectified_left),
                rotation_right: rows(r_rectified_right),
            };
            (None, Some(given))
        }
    };
    let file = File {
        left: Camera::of(&calibration.left),
        right: Camera::of(&calibration.right),
        right_from_left: motion,
        rectified,
    };
    let head = "# Calibration of a raw stereo pair, as `--calibration` takes it. Camera axes: x right, y down, z forward.\n\
                # right_from_left maps left camera coordinates to right ones; rotation_left and \
                _right raw coordinates to rectified ones.\n";
    // Numbers and tables are always TOML.
    format!("{head}{}", toml::to_string(&file).unwrap_or_default())
}
