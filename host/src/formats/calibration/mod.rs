//! Calibration files of stereo cameras.

mod beside;
mod geometry;
mod hints;
mod kitti;
pub mod lens_table;
mod plain;
mod raw;
mod rectified_size;

pub use beside::beside;
pub use geometry::{CameraGeometry, FittedGeometry, RowDifference, SettledCameras};
pub use hints::{CalibrationHints, LengthUnit, LensFamily, Swap};
pub use kitti::{KittiCalibration, Projection};
pub use plain::read_rig;
pub use raw::{
    CALIBRATION_FORMATS, CalibrationFiles, CalibrationFormat, CalibrationRead, Cameras, Placement,
    RectifiedCameras, StereoCalibration, UnitCalibration, UnitCamera, UnitNoise, to_kalibr,
    to_toml,
};
pub use rectified_size::{LARGEST_PX, RectifiedSize};

use crate::formats::FormatError;
use dynvox_core::geometry::{RigProblem, StereoRig};
use std::path::Path;

/// A calibration that cannot be used.
fn unusable(path: &Path, reason: String, action: impl Into<String>) -> FormatError {
    FormatError::content(path, reason, action)
}

/// Refuses images of another size than a calibration's.
fn other_size(
    path: &Path,
    [known_width, known_height]: [u32; 2],
    [width, height]: [u32; 2],
) -> FormatError {
    FormatError::content(
        path,
        format!(
            "it is for images of {known_width} x {known_height} px, but these are {width} x \
             {height} px"
        ),
        "Give the calibration of these images, or the images as the camera delivers them",
    )
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
