//! Oxford RobotCar's camera models (`stereo_narrow_left.txt`): focal lengths and centre of
//! undistorted images, and a matrix of axes. The distance of the cameras is in no file.

use super::files::Files;
use super::format::{CalibrationFormat, Cameras};
use crate::formats::FormatError;
use crate::formats::calibration::hints::LengthUnit;

/// RobotCar's files, which are refused with what to write instead.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "RobotCar",
    files: "camera models `stereo_*_left.txt`: refused with the calib.txt to write, as no file has \
            the baseline",
    unit: LengthUnit::METRE,
    matches: |files| numbers(files.text()).is_some(),
    read,
    example: &[],
};

/// The first line's numbers, where four lines of four follow it.
fn numbers(text: &str) -> Option<[f64; 4]> {
    let rows: Option<Vec<[f64; 4]>> = text
        .lines()
        .filter(|line| !line.trim().is_empty())
        .map(|line| {
            let words: Option<Vec<f64>> =
                line.split_whitespace().map(|word| word.parse().ok()).collect();
            words?.try_into().ok()
        })
        .collect();
    let rows = rows?;
    let axes = rows.get(1..)?.iter().flatten().all(|number| number.abs() <= 1.0);
    (rows.len() == 5 && axes).then(|| rows[0])
}

fn read(files: &Files<'_>) -> Result<Cameras, FormatError> {
    let [focal_px, _, u, v] = numbers(files.text()).unwrap_or_default();
    Err(FormatError::content(
        files.path(),
        "a camera model of RobotCar does not say how far the cameras are apart",
        format!(
            "Undistort the images with the SDK, and write a calib.txt with the lines `focal_px \
             {focal_px}`, `center_u_px {u}`, `center_v_px {v}` and `baseline_m 0.24` (wide pair) \
             or `baseline_m 0.12` (narrow pair)"
        ),
    ))
}
