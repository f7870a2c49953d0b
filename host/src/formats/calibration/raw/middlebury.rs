//! `calib.txt` of Middlebury's and ETH3D's two-view benchmarks: `cam0`, `cam1`, `baseline` in
//! millimetres, `doffs` by which the principal points differ.

use super::files::Files;
use super::format::{CalibrationFormat, Cameras};
use super::{RectifiedCameras, sections, tree::Node};
use crate::formats::FormatError;
use crate::formats::calibration::hints::LengthUnit;
use dynvox_core::geometry::StereoRig;

/// The benchmarks' file.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "Middlebury",
    files: "`calib.txt` of Middlebury and ETH3D: `cam0`, `cam1`, `doffs`, `baseline` in mm",
    unit: LengthUnit::MILLIMETRE,
    matches: |files| {
        let has = |key: &str| files.text().lines().any(|line| line.trim_start().starts_with(key));
        has("cam0=[") && has("baseline=")
    },
    read: |files| read(files).map(Cameras::Rectified),
    example: &[(
        "calib.txt",
        "cam0=[999.421 0 294.182; 0 999.421 252.932; 0 0 1]
cam1=[999.421 0 326.96; 0 999.421 252.932; 0 0 1]
doffs=32.778
baseline=110
width=741
height=497
",
    )],
};

/// Reads the file.
fn read(files: &Files<'_>) -> Result<RectifiedCameras, FormatError> {
    let tree = sections::tree_of(files.text(), files.path());
    let root = tree.root().need("")?;
    let (left, right) = (matrix(root.need("cam0")?)?, matrix(root.need("cam1")?)?);
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-3 * (1.0 + a.abs());
    if !(near(left[0], left[4]) && [0, 4, 5].iter().all(|&at| near(left[at], right[at]))) {
        return Err(root.need("cam1")?.refuse(
            "cam0 and cam1 differ in focal length or in the height of the principal point",
            "Give the calibration of the rectified images",
        ));
    }
    let apart = right[2] - left[2];
    let offset_px = match root.get("doffs") {
        None => apart,
        Some(offset) => {
            let written = offset.number()?;
            if (written - apart).abs() > 0.5 {
                return Err(offset.refuse(
                    &format!(
                        "doffs is {written}, but the principal points are {apart:.3} px apart"
                    ),
                    "Correct the one that is wrong",
                ));
            }
            written
        }
    };
    let size = root.get("width").zip(root.get("height"));
    let size =
        size.map(|(width, height)| Ok::<_, FormatError>([width.pixels()?, height.pixels()?]));
    Ok(RectifiedCameras {
        rig: StereoRig {
            focal_px: left[0],
            center_u_px: left[2],
            center_v_px: left[5],
            baseline_m: root.need("baseline")?.number()?,
        },
        offset_px,
        size: size.transpose()?,
    })
}

/// Nine numbers of `[f 0 cx; 0 f cy; 0 0 1]`.
fn matrix(node: Node<'_>) -> Result<[f64; 9], FormatError> {
    let text = node.text()?.replace(['[', ']', ';', ','], " ");
    let numbers: Option<Vec<f64>> = text
        .split_whitespace()
        .map(|word| word.parse().ok().filter(|number: &f64| number.is_finite()))
        .collect();
    numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| {
        node.refuse(
            &format!("{} is no matrix of 9 numbers", node.key()),
            "Write it as [f 0 cx; 0 f cy; 0 0 1]",
        )
    })
}
