//! Calibrations of rectified images: a key and a value on each line, KITTI's projection matrices,
//! or a camera matrix and the baseline below it.

use super::RectifiedCameras;
use super::files::Files;
use super::format::{CalibrationFormat, Cameras};
use crate::formats::FormatError;
use crate::formats::calibration::hints::LengthUnit;
use crate::formats::calibration::{KittiCalibration, plain};
use dynvox_core::geometry::StereoRig;

/// Lines `key value`.
pub static KEYS: CalibrationFormat = CalibrationFormat {
    name: "keys",
    files: "of rectified images: one line each for `focal_px`, `center_u_px`, `center_v_px`, \
            `baseline_m`",
    unit: LengthUnit::METRE,
    matches: |files| plain::has_keys(files.text()),
    read: |files| {
        let rig = plain::parse(files.text(), files.path())?;
        Ok(Cameras::Rectified(RectifiedCameras { rig, offset_px: 0.0, size: None }))
    },
    example: &[(
        "calib.txt",
        "focal_px 458.6\ncenter_u_px 367.2\ncenter_v_px 248.3\nbaseline_m 0.11\n",
    )],
};

/// KITTI's lines.
pub static KITTI: CalibrationFormat = CalibrationFormat {
    name: "KITTI",
    files: "of rectified images: `calib.txt` with `P0:` and `P1:`, or `P2:` and `P3:`",
    unit: LengthUnit::METRE,
    matches: |files| has_projections(files.text()),
    read: |files| {
        let file = KittiCalibration::parse(&plain::without_comments(files.text()), files.path())?;
        let grey = [0, 1].iter().all(|&camera| file.camera(camera).is_ok());
        let colour = [2, 3].iter().all(|&camera| file.camera(camera).is_ok());
        let (left, right) = if colour && (files.wants_colour() || !grey) { (2, 3) } else { (0, 1) };
        file.cameras(left, right).map(Cameras::Rectified)
    },
    example: &[(
        "calib.txt",
        "P0: 458.6 0 367.2 0 0 458.6 248.3 0 0 0 1 0
P1: 458.6 0 367.2 -50.446 0 458.6 248.3 0 0 0 1 0
",
    )],
};

/// Tells whether a line names a projection matrix, or is twelve numbers.
fn has_projections(text: &str) -> bool {
    let number = |word: &str| word.parse::<f64>().is_ok();
    let named = |line: &str| {
        let Some((label, values)) = line.trim_start().split_once(':') else { return false };
        let known = ["P0", "P1", "P2", "P3"].contains(&label)
            || ["P_rect_0", "P_rect_1"].iter().any(|start| label.starts_with(start));
        known && values.split_whitespace().next().is_some_and(number)
    };
    let bare = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        words.len() == 12 && words.into_iter().all(number)
    };
    !text.trim_start().starts_with(['<', '{', '%'])
        && text.lines().any(|line| named(line) || bare(line))
}

/// A camera matrix, and the baseline.
pub static MATRIX: CalibrationFormat = CalibrationFormat {
    name: "K and baseline",
    files: "of rectified images: `K.txt` with the nine numbers of the camera matrix and a line \
            with the baseline",
    unit: LengthUnit::METRE,
    matches: |files| matrix(files.text()).is_some(),
    read,
    example: &[("K.txt", "458.6 0 367.2 0 458.6 248.3 0 0 1\n0.11\n")],
};

/// The ten numbers, if the text has no other.
fn matrix(text: &str) -> Option<[f64; 10]> {
    let numbers: Option<Vec<f64>> = text
        .split_whitespace()
        .map(|word| word.trim_end_matches(',').parse().ok().filter(|x: &f64| x.is_finite()))
        .collect();
    let numbers: [f64; 10] = numbers?.try_into().ok()?;
    (numbers[6..9] == [0.0, 0.0, 1.0]).then_some(numbers)
}

fn read(files: &Files<'_>) -> Result<Cameras, FormatError> {
    let [fx, _, u, _, fy, v, .., baseline_m] = matrix(files.text()).unwrap_or_default();
    if (fx - fy).abs() > 1e-3 * (1.0 + fx.abs()) {
        return Err(FormatError::content(
            files.path(),
            format!("the focal lengths {fx} and {fy} px differ, so that images are not rectified"),
            "Give the matrix of the rectified images, or the calibration of the raw ones",
        ));
    }
    let rig = StereoRig { focal_px: fx, center_u_px: u, center_v_px: v, baseline_m };
    Ok(Cameras::Rectified(RectifiedCameras { rig, offset_px: 0.0, size: None }))
}
