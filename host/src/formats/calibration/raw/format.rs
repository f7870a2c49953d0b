//! A calibration format's row in the table of formats.
//!
//! Each format's file holds such a row as `FORMAT`; [`super::CALIBRATION_FORMATS`] lists them.

use super::files::Files;
use super::{RectifiedCameras, StereoCalibration};
use crate::formats::FormatError;
use crate::formats::calibration::hints::LengthUnit;

/// Format of a calibration.
pub struct CalibrationFormat {
    /// Name in messages and tables.
    pub name: &'static str,
    /// Files and their keys, as the documentation and refusals list them.
    pub files: &'static str,
    /// Unit of translations, unless a person says another.
    pub unit: LengthUnit,
    /// Recognizes the format by what the files hold.
    pub(super) matches: fn(&Files) -> bool,
    /// Reads files that match.
    pub(super) read: fn(&Files) -> Result<Cameras, FormatError>,
    /// Names and texts of the files of an example: two cameras 0.11 m apart.
    pub example: &'static [(&'static str, &'static str)],
}

/// Two cameras as a file has them, before anything is checked.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "one is made for each calibration that is read")]
pub enum Cameras {
    /// Images come rectified.
    Rectified(RectifiedCameras),
    /// Images come raw.
    Raw(StereoCalibration),
}

impl From<StereoCalibration> for Cameras {
    fn from(calibration: StereoCalibration) -> Self {
        Self::Raw(calibration)
    }
}

impl Cameras {
    /// The cameras with lengths multiplied.
    pub(super) fn scaled(self, unit: LengthUnit) -> Self {
        match self {
            Self::Rectified(mut cameras) => {
                cameras.rig.baseline_m *= unit.0;
                Self::Rectified(cameras)
            }
            Self::Raw(calibration) => Self::Raw(calibration.scaled(unit.0)),
        }
    }

    /// The cameras as ones that stand one above the other.
    pub(super) fn vertical(self) -> Self {
        match self {
            Self::Raw(calibration) => Self::Raw(calibration.vertical()),
            rectified => rectified,
        }
    }

    /// The second camera first.
    pub(super) fn exchanged(self) -> Self {
        match self {
            Self::Rectified(mut cameras) => {
                cameras.rig.center_u_px += cameras.offset_px;
                cameras.rig.baseline_m = -cameras.rig.baseline_m;
                cameras.offset_px = -cameras.offset_px;
                Self::Rectified(cameras)
            }
            Self::Raw(calibration) => Self::Raw(calibration.exchanged()),
        }
    }
}
