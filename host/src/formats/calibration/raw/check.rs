//! Checks that the cameras of every format pass, and questions that only a person can answer.

use super::format::Cameras;
use super::vertical::Quarter;
use super::{Placement, RectifiedCameras, StereoCalibration};
use crate::formats::FormatError;
use crate::formats::calibration::hints::CalibrationHints;
use dynvox_core::rectify::{RectifyProblem, Sizing};
use std::path::Path;

/// Longest distance of two cameras that is taken for metres without a question, m.
const LONGEST_M: f64 = 1.0;
/// Longest distance that may be metres, m.
const LONGEST_LIKELY_M: f64 = 10.0;
/// Shortest distance of two cameras that is taken for metres without a question, m.
const SHORTEST_M: f64 = 0.01;
/// Largest side rectification is tried for, px.
const TRIED_PX: u32 = 4_096;

/// Next action where the second camera stands to the left of the first.
const EXCHANGE: &str = "The first camera must be the left one: give --swap=calibration if only the \
                        calibration has them in this order, --swap if the images have it, too";
/// Next action where one camera stands above the other.
pub const VERTICAL: &str = "Give --vertical: rectified images, and the map's axes, are then turned \
                            by a quarter. If the cameras stand side by side, check the order of \
                            rotation and translation";
/// Next action where one camera stands behind the other.
const BEHIND: &str = "Check the order of rotation and translation; cameras one behind the other \
                      see no depth between them";
/// Next action where cameras said to stand one above the other do not.
const NOT_VERTICAL: &str = "Leave out --vertical, or check the order of rotation and translation";

/// The cameras, if a pair can be mapped by them.
///
/// # Errors
/// Names the fault and the next action.
pub fn checked(
    cameras: Cameras,
    path: &Path,
    hints: &CalibrationHints,
) -> Result<Cameras, FormatError> {
    // In a wrong unit other checks fail, too, and say less.
    if hints.unit.is_none() {
        check_unit(baseline_m(&cameras).abs(), path)?;
    }
    match &cameras {
        Cameras::Rectified(rectified) => check_rectified(rectified, path)?,
        Cameras::Raw(calibration) => check_raw(calibration, path)?,
    }
    Ok(cameras)
}

/// Distance of the cameras, m; negative where the second stands to the left of the first.
pub fn baseline_m(cameras: &Cameras) -> f64 {
    match cameras {
        Cameras::Rectified(rectified) => rectified.rig.baseline_m,
        Cameras::Raw(calibration) => calibration.baseline_m(),
    }
}

/// Tells whether the second camera stands to the left of the first.
pub fn is_exchanged(cameras: &Cameras) -> bool {
    match cameras {
        Cameras::Rectified(rectified) => rectified.rig.baseline_m < 0.0,
        Cameras::Raw(calibration) => match calibration.placement {
            Placement::Rectified { rig, .. } => rig.baseline_m < 0.0,
            Placement::Motion { .. } | Placement::Vertical { .. } => {
                calibration.rectify(TRIED) == Err(RectifyProblem::Exchanged)
            }
        },
    }
}

const TRIED: Sizing = Sizing::Automatic { max_width: TRIED_PX, max_height: TRIED_PX };

/// Asks for the unit where a baseline in metres is unlikely.
fn check_unit(baseline_m: f64, path: &Path) -> Result<(), FormatError> {
    let refuse = |reason: String, action: String| Err(FormatError::content(path, reason, action));
    if baseline_m > LONGEST_LIKELY_M {
        return refuse(
            format!("the cameras are {baseline_m} m apart. Is it in millimetres?"),
            format!(
                "Give --calibration-unit mm (they are then {:.4} m apart), or m if it is right",
                1e-3 * baseline_m
            ),
        );
    }
    if baseline_m > LONGEST_M {
        return refuse(
            format!(
                "the cameras are {baseline_m} m apart. Are these centimetres, or squares of the \
                 calibration board?"
            ),
            format!(
                "Give --calibration-unit cm (they are then {:.4} m apart), inch, or the side of a \
                 square in metres (with 0.025 they are {:.4} m apart); m if it is right",
                1e-2 * baseline_m,
                0.025 * baseline_m
            ),
        );
    }
    if baseline_m > 0.0 && baseline_m < SHORTEST_M {
        return refuse(
            format!("the cameras are {} mm apart. Is it in another unit?", 1e3 * baseline_m),
            "Give --calibration-unit m if it is right, else mm, cm, inch, or the side of the \
             board's squares in metres"
                .to_owned(),
        );
    }
    Ok(())
}

fn check_rectified(cameras: &RectifiedCameras, path: &Path) -> Result<(), FormatError> {
    if cameras.rig.baseline_m < 0.0 {
        let baseline_m = cameras.rig.baseline_m;
        let reason = format!(
            "the baseline is {baseline_m} m: the right camera stands to the left of the left one"
        );
        return Err(FormatError::content(path, reason, EXCHANGE));
    }
    if !cameras.offset_px.is_finite() {
        let reason = "the principal points' difference is not finite";
        return Err(FormatError::content(path, reason, "Correct the calibration file"));
    }
    super::super::checked(cameras.rig, path).map(|_| ())
}

fn check_raw(calibration: &StereoCalibration, path: &Path) -> Result<(), FormatError> {
    let refuse = |reason: &str, action: &str| Err(FormatError::content(path, reason, action));
    let quarter = match calibration.placement {
        Placement::Motion { r_right_left, t_right_left_m } => {
            Quarter::new(&r_right_left, &t_right_left_m)
        }
        _ => None,
    };
    let problem = match calibration.placement {
        Placement::Rectified { rig, .. } if rig.baseline_m < 0.0 => Some(RectifyProblem::Exchanged),
        Placement::Rectified { rig, .. } if rig.baseline_m == 0.0 => {
            Some(RectifyProblem::NoBaseline)
        }
        Placement::Rectified { rig, .. } => {
            super::super::checked(rig, path)?;
            calibration.rectify(TRIED).err()
        }
        Placement::Motion { .. } | Placement::Vertical { .. } => calibration.rectify(TRIED).err(),
    };
    let Some(problem) = problem else { return Ok(()) };
    let action = match problem {
        RectifyProblem::NotARotation => {
            "A rotation has three rows of length 1 at right angles: copy it whole from the \
             calibration tool"
        }
        RectifyProblem::NoBaseline => "Give the translation between the cameras in metres",
        RectifyProblem::Exchanged => EXCHANGE,
        RectifyProblem::NotSideBySide => {
            if let Some(quarter) = quarter {
                let position = quarter.second_stands();
                return refuse(&format!("the second camera stands {position} the first"), VERTICAL);
            }
            if matches!(calibration.placement, Placement::Vertical { .. }) {
                return refuse("the cameras do not stand one above the other", NOT_VERTICAL);
            }
            BEHIND
        }
        RectifyProblem::Diverging => {
            "Check the rotation between the cameras, and which way it maps"
        }
        RectifyProblem::RawSize => "Correct width and height",
        _ => "Check focal lengths, principal points and image sizes",
    };
    refuse(&problem.to_string(), action)
}
