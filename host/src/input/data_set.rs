//! A data set's row in the table of data sets, and the options that open one.
//!
//! Each file of [`super::layouts`] and [`super::bags`] holds such a row as `DATA_SET`;
//! [`super::data_sets`] lists them.

use super::inertial::choice::InertialChoice;
use super::source::{FrameSource, InputError, Stacking};
use crate::formats::calibration::{CalibrationHints, CameraGeometry, RectifiedSize};
use crate::formats::{BayerPattern, FormatError};
use dynvox_core::geometry::StereoRig;
use serde::{Deserialize, Serialize, Serializer};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Layout of recordings on disk: how it is recognized, listed and opened.
#[derive(Debug)]
pub struct DataSet {
    /// Name on the command line.
    pub name: &'static str,
    /// Folders and files of the layout, one sentence for the help.
    pub summary: &'static str,
    /// Describes how the images lie at a path, for `inspect`.
    pub describe: fn(&Path) -> String,
    /// Recognizes the layout at a path, by names of folders and files only.
    pub matches: fn(&Path) -> bool,
    /// Lists the sequences at a path; none if the path is one sequence itself.
    pub sequences: fn(&Path) -> Result<Vec<String>, InputError>,
    /// Opens the sequence that the options name.
    pub open: OpenSequence,
}

/// Function that opens a sequence at a path.
pub type OpenSequence = fn(&Path, &OpenOptions) -> Result<Box<dyn FrameSource>, InputError>;

/// Row of the table of data sets, by which a layout is chosen. Two are equal if their names are.
#[derive(Clone, Copy)]
pub struct Layout(&'static DataSet);

impl Layout {
    /// Makes a row of the table.
    pub(super) const fn new(row: &'static DataSet) -> Self {
        Self(row)
    }

    /// Columns of the row.
    pub(super) fn row(self) -> &'static DataSet {
        self.0
    }

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        self.0.name
    }

    /// Describes how the images lie at `path`, for `inspect`.
    pub fn describe(self, path: &Path) -> String {
        (self.0.describe)(path)
    }
}

impl PartialEq for Layout {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl Eq for Layout {}

impl std::fmt::Debug for Layout {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl Serialize for Layout {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// Lists the sequences of a layout whose path is always one sequence.
pub(super) fn no_sequences(_: &Path) -> Result<Vec<String>, InputError> {
    Ok(Vec::new())
}

/// Choices made when a recording is opened.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OpenOptions {
    /// Layout of the recording; guessed from the path if absent.
    pub layout: Option<Layout>,
    /// Sequence within the recording.
    pub sequence: Option<String>,
    /// Camera pair of KITTI odometry.
    pub cameras: CameraPair,
    /// Significant bits of 16-bit images; told from the data where they are not said.
    pub bits: Option<u32>,
    /// Colour filters of images that are mosaics.
    pub bayer: Option<BayerPattern>,
    /// Arrangement of both images in one file; told from the calibration if absent.
    pub stacking: Option<Stacking>,
    /// Topics of the left and the right camera in a recording of ROS; told by their names where
    /// they are not said.
    pub topics: Option<Topics>,
    /// Files of a calibration to use instead of the recording's own; empty for its own.
    pub calibration: Vec<PathBuf>,
    /// Answers of a person to what the files of a calibration leave open.
    pub hints: CalibrationHints,
    /// Size to which raw pairs are rectified.
    pub rectified: RectifiedSize,
    /// Source of inertial samples.
    pub inertial: InertialChoice,
    /// Files with the inertial unit's mounting instead of the recording's own.
    pub inertial_calibration: Vec<PathBuf>,
}

impl OpenOptions {
    /// The cameras by the given calibration, else by the recording's own.
    ///
    /// # Errors
    /// Neither can be used.
    pub fn cameras_or(
        &self,
        own: impl FnOnce() -> Result<StereoRig, FormatError>,
    ) -> Result<CameraGeometry, FormatError> {
        if self.calibration.is_empty() {
            own().map(CameraGeometry::Rectified)
        } else {
            self.cameras_of(&self.calibration)
        }
    }

    /// The cameras of calibration files.
    ///
    /// # Errors
    /// See [`CameraGeometry::read`].
    pub fn cameras_of(&self, files: &[PathBuf]) -> Result<CameraGeometry, FormatError> {
        let colour = self.hints.colour || self.cameras == CameraPair::Colour;
        CameraGeometry::read(files, CalibrationHints { colour, ..self.hints })
    }
}

/// Camera pair of KITTI odometry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum CameraPair {
    /// The grey pair where it is there, else the colour pair.
    #[default]
    Auto,
    /// `image_0` and `image_1`.
    Grey,
    /// `image_2` and `image_3`: matched in grey, fused in colour.
    Colour,
}

/// The two topics by name: `LEFT,RIGHT`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Topics(pub [String; 2]);

impl FromStr for Topics {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let sides =
            text.split_once(',').filter(|(left, right)| !left.is_empty() && !right.is_empty());
        sides
            .map(|(left, right)| Self([left.to_owned(), right.to_owned()]))
            .ok_or_else(|| "must be LEFT,RIGHT".to_owned())
    }
}
