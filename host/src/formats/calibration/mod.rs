//! Calibration files of stereo cameras.

mod geometry;
mod kitti;
pub mod lens_table;
mod plain;
mod raw;

pub use geometry::{CameraGeometry, FittedGeometry, LARGEST_PX, RectifiedSize, beside};
pub use kitti::{KittiCalibration, Projection};
pub use plain::read_rig;
pub use raw::{
    CALIBRATION_FORMATS, CalibrationFormat, LONGEST_BASELINE_M, Placement, SHORTEST_BASELINE_M,
    StereoCalibration, to_kalibr, to_toml,
};

use crate::formats::FormatError;
use dynvox_core::geometry::{RigProblem, StereoRig};
use std::path::Path;

/// A calibration that cannot be used.
fn unusable(path: &Path, reason: String, action: impl Into<String>) -> FormatError {
    FormatError::content(path, reason, action)
}

/// The rig, if it can be one.
fn checked(rig: StereoRig, path: &Path) -> Result<StereoRig, FormatError> {
    let (reason, action) = match rig.validate() {
        Ok(()) => return Ok(rig),
        Err(RigProblem::Focal) => {
            (format!("the focal length is {} px", rig.focal_px), "It must be above 0")
        }
        Err(RigProblem::Center) => (
            "the principal point is not finite".to_owned(),
            "Give it in pixels from the image's corner",
        ),
        Err(RigProblem::Baseline) => (
            format!("the baseline is {} m", rig.baseline_m),
            "The right camera must stand to the right of the left one: exchange the two cameras, \
             or correct the sign of the fourth number",
        ),
        Err(problem) => (problem.to_string(), "Correct the calibration file"),
    };
    Err(unusable(path, reason, action))
}
