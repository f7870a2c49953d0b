//! Calibrations of raw pairs: lenses, and how the cameras stand.
//!
//! Each format is a file with a row of the table [`CALIBRATION_FORMATS`].
//! The result of every format is checked here: baseline, sizes, rotations. Units are metres and
//! pixels.

mod camodocal;
mod euroc;
mod format;
mod kalibr;
mod kitti_raw;
mod lens;
mod opencv;
mod own;
mod ros;
#[cfg(test)]
mod tests;
mod tree;

pub use format::CalibrationFormat;
pub use kalibr::to_kalibr;
pub use own::to_toml;

use crate::formats::FormatError;
use dynvox_core::geometry::StereoRig;
use dynvox_core::rectify::{
    RawCamera, RawRig, Rectification, RectifyProblem, Sizing, TurnedCamera,
};
use format::Files;
use nalgebra::{Matrix3, Vector3};
use std::path::Path;

/// Longest distance of two cameras that is taken for metres.
pub const LONGEST_BASELINE_M: f64 = 10.0;
/// Shortest distance of two cameras that is taken for metres.
pub const SHORTEST_BASELINE_M: f64 = 0.001;

/// All formats. Files are of the first that matches them, so that what asks for less stands later.
pub static CALIBRATION_FORMATS: &[&CalibrationFormat] = &[
    &own::FORMAT,
    &kitti_raw::FORMAT,
    &kalibr::FORMAT,
    &euroc::FORMAT,
    &ros::FORMAT,
    &camodocal::FORMAT,
    &opencv::FORMAT,
];

/// Relative pose of the two cameras of a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Placement {
    /// The motion between them; rectification is ours to choose.
    Motion {
        /// Rotation of left camera coordinates to right ones.
        r_right_left: Matrix3<f64>,
        /// The left camera's centre in right camera coordinates, m.
        t_right_left_m: Vector3<f64>,
    },
    /// A rectification that the calibration gives.
    Rectified {
        /// Rotation of raw left camera coordinates to rectified ones.
        r_rectified_left: Matrix3<f64>,
        /// Rotation of raw right camera coordinates to rectified ones.
        r_rectified_right: Matrix3<f64>,
        /// The rectified rig.
        rig: StereoRig,
        /// Width and height of rectified images, px.
        size: [u32; 2],
    },
}

/// Calibration of a raw pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StereoCalibration {
    /// The left camera.
    pub left: RawCamera,
    /// The right camera.
    pub right: RawCamera,
    /// Relative pose of the cameras.
    pub placement: Placement,
    /// Name of the format it was read from.
    pub format: &'static str,
}

impl StereoCalibration {
    /// Reads the calibration in one, two or three files. `image_size` is the raw images' where it
    /// is known: some formats do not say it.
    ///
    /// # Errors
    /// What is wrong with which file, and what to do.
    pub fn read(paths: &[&Path], image_size: Option<[u32; 2]>) -> Result<Self, FormatError> {
        if !(1..=3).contains(&paths.len()) {
            let action =
                "Give one file with both cameras, or --calibration LEFT --calibration RIGHT";
            return Err(FormatError::content(
                paths.first().copied().unwrap_or(Path::new("")),
                "a calibration is 1 to 3 files",
                action,
            ));
        }
        Self::from_files(Files::read(paths, image_size)?)
    }

    /// Reads a left and a right `CameraInfo`, as the texts `camera_calibration` writes. `path`
    /// names their source in errors.
    ///
    /// # Errors
    /// As [`StereoCalibration::read`].
    pub fn of_camera_infos(path: &Path, texts: &[String; 2]) -> Result<Self, FormatError> {
        let files = texts.iter().map(|text| (path.to_path_buf(), text.clone())).collect();
        Self::from_files(Files::new(files, None))
    }

    /// Reads files by the first format that matches them.
    fn from_files(files: Files) -> Result<Self, FormatError> {
        match CALIBRATION_FORMATS.iter().find(|format| (format.matches)(&files)) {
            Some(format) => (format.read)(&files)?.checked(files.path()),
            None => {
                let known = |format: &&CalibrationFormat| {
                    format!("{} ({})", format.name, format.files.replace('`', ""))
                };
                let known: Vec<String> = CALIBRATION_FORMATS.iter().map(known).collect();
                Err(files.refuse(&known.join("; ")))
            }
        }
    }

    /// Distance of the cameras, m.
    pub fn baseline_m(&self) -> f64 {
        match &self.placement {
            Placement::Motion { t_right_left_m, .. } => t_right_left_m.norm(),
            Placement::Rectified { rig, .. } => rig.baseline_m,
        }
    }

    /// Angle between the cameras, degrees.
    pub fn angle_deg(&self) -> f64 {
        let r = match &self.placement {
            Placement::Motion { r_right_left, .. } => *r_right_left,
            Placement::Rectified { r_rectified_left, r_rectified_right, .. } => {
                r_rectified_right.transpose() * r_rectified_left
            }
        };
        let rig = RawRig {
            left: self.left,
            right: self.right,
            r_right_left: r,
            t_right_left_m: Vector3::zeros(),
        };
        rig.angle_rad().to_degrees()
    }

    /// Returns the rectification: as the calibration gives it, unless it gives none or another size
    /// is asked for.
    ///
    /// # Errors
    /// The cameras cannot be rectified.
    pub fn rectify(&self, sizing: Sizing) -> Result<(Rectification, StereoRig), RectifyProblem> {
        match (self.placement, sizing) {
            (
                Placement::Rectified { r_rectified_left, r_rectified_right, rig, size },
                Sizing::Automatic { max_width, max_height },
            ) if size[0] <= max_width && size[1] <= max_height => {
                let left = TurnedCamera { raw: self.left, r_rectified_raw: r_rectified_left };
                let right = TurnedCamera { raw: self.right, r_rectified_raw: r_rectified_right };
                Ok((Rectification::given(left, right, size)?, rig))
            }
            _ => Rectification::new(&self.raw_rig(), sizing),
        }
    }

    /// The cameras and the motion between them.
    fn raw_rig(&self) -> RawRig {
        let (r_right_left, t_right_left_m) = match self.placement {
            Placement::Motion { r_right_left, t_right_left_m } => (r_right_left, t_right_left_m),
            Placement::Rectified { r_rectified_left, r_rectified_right, rig, .. } => {
                let back = r_rectified_right.transpose();
                (back * r_rectified_left, back * Vector3::new(-rig.baseline_m, 0.0, 0.0))
            }
        };
        RawRig { left: self.left, right: self.right, r_right_left, t_right_left_m }
    }

    /// The calibration, if a pair can be rectified by it.
    fn checked(self, path: &Path) -> Result<Self, FormatError> {
        let refuse = |reason: String, action: &str| Err(FormatError::content(path, reason, action));
        let baseline_m = self.baseline_m();
        if baseline_m > LONGEST_BASELINE_M {
            let reason = format!("the cameras are {baseline_m} m apart. Is it in millimetres?");
            return refuse(reason, "Translations are in metres: divide them by 1000");
        }
        if baseline_m.is_finite() && baseline_m > 0.0 && baseline_m < SHORTEST_BASELINE_M {
            return refuse(
                format!("the cameras are {} mm apart", 1e3 * baseline_m),
                "Translations are in metres: correct their unit",
            );
        }
        if let Err(problem) =
            self.rectify(Sizing::Automatic { max_width: 4_096, max_height: 4_096 })
        {
            let action = match problem {
                RectifyProblem::NotARotation => {
                    "A rotation has three rows of length 1 at right angles: copy it whole from the \
                     calibration tool"
                }
                RectifyProblem::NoBaseline => "Give the translation between the cameras in metres",
                RectifyProblem::Exchanged => "Exchange the two cameras: the first is the left one",
                RectifyProblem::NotSideBySide => {
                    "Pairs above or behind each other cannot be matched: check the order of \
                     rotation and translation"
                }
                RectifyProblem::Diverging => {
                    "Check the rotation between the cameras, and which way it maps"
                }
                RectifyProblem::RawSize => "Correct width and height",
                _ => "Check focal lengths, principal points and image sizes",
            };
            return refuse(problem.to_string(), action);
        }
        Ok(self)
    }

    /// Refuses images of another size than the calibration's.
    ///
    /// # Errors
    /// They differ.
    pub fn fits(&self, path: &Path, [width, height]: [u32; 2]) -> Result<(), FormatError> {
        let known = [self.left.width, self.left.height];
        if known == [width, height] && [self.right.width, self.right.height] == known {
            return Ok(());
        }
        let [known_width, known_height] = known;
        Err(FormatError::content(
            path,
            format!(
                "it is for images of {known_width} x {known_height} px, but these are {width} x \
                 {height} px"
            ),
            "Give the calibration of these images, or the images as the camera delivers them",
        ))
    }
}
