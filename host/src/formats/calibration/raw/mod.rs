//! Calibrations: lenses, and how the cameras stand.
//!
//! Each format is a file with a row of the table [`CALIBRATION_FORMATS`].
//! The result of every format is checked here: baseline, sizes, rotations. Units are metres and
//! pixels.

mod basalt;
mod camodocal;
mod check;
mod depthai;
mod euroc;
mod family;
mod files;
mod format;
mod kalibr;
mod keys;
mod kitti_raw;
mod lens;
mod middlebury;
mod mounting;
mod opencv;
mod orbslam;
mod ost;
mod own;
mod pose;
mod read;
mod rectified;
mod robotcar;
mod ros;
mod sections;
#[cfg(test)]
mod tests;
mod tree;
mod unit;
mod unit_kitti;
mod vertical;
mod vins;
mod zed;

pub use format::{CalibrationFormat, Cameras};
pub use kalibr::to_kalibr;
pub use mounting::{UnitCalibration, UnitCamera, UnitNoise};
pub use own::to_toml;
pub use read::{CalibrationFiles, CalibrationRead};

use crate::formats::FormatError;
use dynvox_core::geometry::StereoRig;
use dynvox_core::rectify::{
    RawCamera, RawRig, Rectification, RectifyProblem, Sizing, TurnedCamera,
};
use nalgebra::{Matrix3, Vector3};
use std::path::Path;

/// All formats. Files are of the first that matches them, so that what asks for less stands later.
pub static CALIBRATION_FORMATS: &[&CalibrationFormat] = &[
    &own::FORMAT,
    &zed::FORMAT,
    &ost::FORMAT,
    &kitti_raw::FORMAT,
    &middlebury::FORMAT,
    &robotcar::FORMAT,
    &rectified::KEYS,
    &rectified::KITTI,
    &rectified::MATRIX,
    &basalt::FORMAT,
    &depthai::FORMAT,
    &vins::FORMAT,
    &orbslam::FORMAT,
    &kalibr::FORMAT,
    &euroc::FORMAT,
    &ros::FORMAT,
    &camodocal::FORMAT,
    &opencv::FORMAT,
];

/// Two cameras whose images come rectified.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RectifiedCameras {
    /// The left camera, and the distance to the right one.
    pub rig: StereoRig,
    /// Distance by which the right camera's principal point lies further right, px: what must be
    /// added to disparities.
    pub offset_px: f64,
    /// Width and height of the images, px, where the files say it.
    pub size: Option<[u32; 2]>,
}

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
    /// The motion between cameras one above the other: rectified images are turned by a quarter.
    Vertical {
        /// Rotation of the first camera's coordinates to the second's.
        r_right_left: Matrix3<f64>,
        /// The first camera's centre in the second's coordinates, m.
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
    /// Reads the calibration of raw cameras. `image_size` is the raw images' where it is known:
    /// some formats do not say it.
    ///
    /// # Errors
    /// What is wrong with which file, and what to do.
    pub fn read(paths: &[&Path], image_size: Option<[u32; 2]>) -> Result<Self, FormatError> {
        let paths: Vec<_> = paths.iter().map(|path| path.to_path_buf()).collect();
        CalibrationFiles::read(&paths, Default::default())?.cameras(image_size)?.raw(image_size)
    }

    /// Distance of the cameras, m.
    pub fn baseline_m(&self) -> f64 {
        match &self.placement {
            Placement::Motion { t_right_left_m, .. }
            | Placement::Vertical { t_right_left_m, .. } => t_right_left_m.norm(),
            Placement::Rectified { rig, .. } => rig.baseline_m,
        }
    }

    /// Angle between the cameras, degrees.
    pub fn angle_deg(&self) -> f64 {
        let r = match &self.placement {
            Placement::Motion { r_right_left, .. } | Placement::Vertical { r_right_left, .. } => {
                *r_right_left
            }
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
            (Placement::Vertical { .. }, _) => vertical::rectify(&self.raw_rig(), sizing),
            _ => Rectification::new(&self.raw_rig(), sizing),
        }
    }

    /// The cameras and the motion between them.
    fn raw_rig(&self) -> RawRig {
        let (r_right_left, t_right_left_m) = match self.placement {
            Placement::Motion { r_right_left, t_right_left_m }
            | Placement::Vertical { r_right_left, t_right_left_m } => {
                (r_right_left, t_right_left_m)
            }
            Placement::Rectified { r_rectified_left, r_rectified_right, rig, .. } => {
                let back = r_rectified_right.transpose();
                (back * r_rectified_left, back * Vector3::new(-rig.baseline_m, 0.0, 0.0))
            }
        };
        RawRig { left: self.left, right: self.right, r_right_left, t_right_left_m }
    }

    /// The calibration with lengths multiplied.
    fn scaled(mut self, factor: f64) -> Self {
        match &mut self.placement {
            Placement::Motion { t_right_left_m, .. }
            | Placement::Vertical { t_right_left_m, .. } => *t_right_left_m *= factor,
            Placement::Rectified { rig, .. } => rig.baseline_m *= factor,
        }
        self
    }

    /// The second camera first.
    fn exchanged(self) -> Self {
        let placement = match self.placement {
            Placement::Motion { r_right_left, t_right_left_m }
            | Placement::Vertical { r_right_left, t_right_left_m } => {
                let back = r_right_left.transpose();
                Placement::Motion { r_right_left: back, t_right_left_m: -(back * t_right_left_m) }
            }
            Placement::Rectified { r_rectified_left, r_rectified_right, rig, size } => {
                Placement::Rectified {
                    r_rectified_left: r_rectified_right,
                    r_rectified_right: r_rectified_left,
                    rig: StereoRig { baseline_m: -rig.baseline_m, ..rig },
                    size,
                }
            }
        };
        Self { left: self.right, right: self.left, placement, ..self }
    }

    /// Takes a motion between the cameras as that of one above the other.
    fn vertical(mut self) -> Self {
        if let Placement::Motion { r_right_left, t_right_left_m } = self.placement {
            self.placement = Placement::Vertical { r_right_left, t_right_left_m };
        }
        self
    }

    /// Cameras of rectified images whose principal points differ: the right images move.
    fn from_rectified(
        cameras: &RectifiedCameras,
        size: [u32; 2],
        format: &'static str,
    ) -> Result<Self, dynvox_core::rectify::LensProblem> {
        let RectifiedCameras { rig, offset_px, .. } = *cameras;
        let camera = |offset_px: f64| {
            let center_px = [rig.center_u_px + offset_px, rig.center_v_px];
            let lens = dynvox_core::rectify::Lens::new(
                [rig.focal_px; 2],
                center_px,
                dynvox_core::rectify::LensModel::IDEAL,
            )?;
            Ok(RawCamera { lens, width: size[0], height: size[1] })
        };
        let none = Matrix3::identity();
        let placement =
            Placement::Rectified { r_rectified_left: none, r_rectified_right: none, rig, size };
        Ok(Self { left: camera(0.0)?, right: camera(offset_px)?, placement, format })
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
        Err(super::other_size(path, known, [width, height]))
    }
}
