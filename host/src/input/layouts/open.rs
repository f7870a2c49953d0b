//! Guessing a layout from its path, and saying what was found.

use super::{CameraPair, Stacking, cityscapes, euroc, folder, kitti, kitti_raw};
use crate::formats::FormatError;
use crate::formats::calibration::{CameraGeometry, RectifiedSize};
use crate::input::bags::{self, Topics};
use crate::input::source::{FrameSource, InputError};
use dynvox_core::geometry::StereoRig;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Data sets named at most where a folder is none itself but holds some.
const HINTS: usize = 8;

/// How many folders up a data set is looked for around one that is none itself.
const AROUND: usize = 3;

/// The known layouts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Layout {
    /// KITTI odometry: `sequences/NN/{image_0,image_1,calib.txt}`.
    KittiOdometry,
    /// KITTI tracking: `training/{image_02,image_03}/NNNN`, `training/calib/NNNN.txt`.
    KittiTracking,
    /// KITTI raw: `DAY/DRIVE_sync/{image_00,image_01}/data`, `DAY/calib_cam_to_cam.txt`.
    KittiRaw,
    /// KITTI-360: `data_2d_raw/DRIVE/{image_00,image_01}/data_rect`, `calibration/perspective.txt`.
    #[value(name = "kitti-360")]
    #[serde(rename = "kitti-360")]
    Kitti360,
    /// Cityscapes: `leftImg8bit_sequence`, `rightImg8bit_sequence`, `camera`.
    Cityscapes,
    /// EuRoC and TUM VI: `mav0/{cam0,cam1}/data`, `data.csv`.
    Euroc,
    /// ROS 2: an MCAP file, or the folder of a recording with one.
    Mcap,
    /// Two folders of images, one with prefixes or suffixes, or images that hold both cameras; and
    /// `calib.txt`.
    Folder,
}

impl Layout {
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::KittiOdometry => "kitti-odometry",
            Self::KittiTracking => "kitti-tracking",
            Self::KittiRaw => "kitti-raw",
            Self::Kitti360 => "kitti-360",
            Self::Cityscapes => "cityscapes",
            Self::Euroc => "euroc",
            Self::Mcap => "mcap",
            Self::Folder => "folder",
        }
    }

    /// How the images lie at `path`, for `inspect`.
    pub fn describe(self, path: &Path) -> String {
        match self {
            Self::KittiOdometry => "KITTI odometry: image_0 to image_3 of each sequence".to_owned(),
            Self::KittiTracking => {
                "KITTI tracking: image_02 and image_03 of each sequence".to_owned()
            }
            Self::KittiRaw => {
                "KITTI raw: image_00 to image_03 of each drive, times of timestamps.txt".to_owned()
            }
            Self::Kitti360 => {
                "KITTI-360: image_00 and image_01 of each drive, times of timestamps.txt".to_owned()
            }
            Self::Cityscapes => "Cityscapes: left and right images of each sequence".to_owned(),
            Self::Euroc => "EuRoC or TUM VI: mav0/cam0 and mav0/cam1, times of data.csv".to_owned(),
            Self::Mcap => "ROS 2: an MCAP file, stamps and calibration of its messages".to_owned(),
            Self::Folder => folder::describe(path),
        }
    }

    /// The layout at `path`.
    pub fn guess(path: &Path) -> Result<Self, InputError> {
        if !path.exists() {
            return Err(InputError::Absent { path: path.to_path_buf() });
        }
        if bags::file_at(path).is_some() {
            return Ok(Self::Mcap);
        }
        if let Some(action) = bags::conversion(path) {
            return Err(InputError::bag(
                path,
                format!("it is a recording of ROS in another format than MCAP. {action}"),
            ));
        }
        if path.is_file() {
            return Err(InputError::File { path: path.to_path_buf() });
        }
        Self::of(path).ok_or_else(|| {
            let mut around = path.ancestors().skip(1).take(AROUND);
            if let Some(root) = around.find(|folder| Self::of(folder).is_some()) {
                return InputError::Within { path: path.to_path_buf(), root: root.to_path_buf() };
            }
            let entries = path.read_dir().into_iter().flatten().flatten().map(|entry| entry.path());
            let mut below: Vec<_> =
                entries.filter(|folder| Self::of(folder).is_some()).take(HINTS).collect();
            below.sort();
            InputError::Layout { path: path.to_path_buf(), below }
        })
    }

    fn of(path: &Path) -> Option<Self> {
        if kitti::odometry_root(path).is_some() || kitti::is_odometry_sequence(path) {
            Some(Self::KittiOdometry)
        } else if cityscapes::left_root(path).is_some() {
            Some(Self::Cityscapes)
        } else if euroc::sensors_of(path).is_some() {
            Some(Self::Euroc)
        } else if kitti_raw::drives_360(path).is_some() || kitti_raw::is_drive_360(path) {
            Some(Self::Kitti360)
        } else if kitti_raw::is_drive(path)
            || kitti_raw::drives(path).is_ok_and(|drives| !drives.is_empty())
        {
            Some(Self::KittiRaw)
        } else if kitti::tracking_split(path).is_some() {
            Some(Self::KittiTracking)
        } else {
            folder::is_stereo_folder(path).then_some(Self::Folder)
        }
    }
}

/// What to open of a recording, and how.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OpenOptions {
    /// The layout; guessed from the path where it is not said.
    pub layout: Option<Layout>,
    /// Sequence within the recording.
    pub sequence: Option<String>,
    /// Camera pair of KITTI odometry.
    pub cameras: CameraPair,
    /// Significant bits of 16-bit images; told from the data where they are not said.
    pub bits: Option<u32>,
    /// How both images of a pair lie in one file; told from the calibration where it is not said.
    pub stacking: Option<Stacking>,
    /// Topics of the left and the right camera in a recording of ROS; told by their names where
    /// they are not said.
    pub topics: Option<Topics>,
    /// Files of a calibration in place of the recording's own; none for that one.
    pub calibration: Vec<PathBuf>,
    /// How large raw pairs are rectified.
    pub rectified: RectifiedSize,
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
            CameraGeometry::read(&self.calibration, None)
        }
    }
}

/// Opens the recording at `path`.
///
/// # Errors
/// What is not there, or cannot be used.
pub fn open(path: &Path, options: &OpenOptions) -> Result<Box<dyn FrameSource>, InputError> {
    if !path.exists() {
        return Err(InputError::Absent { path: path.to_path_buf() });
    }
    let layout = options.layout.map_or_else(|| Layout::guess(path), Ok)?;
    Ok(match layout {
        Layout::KittiOdometry => Box::new(kitti::open_odometry(path, options)?),
        Layout::KittiTracking => Box::new(kitti::open_tracking(path, options)?),
        Layout::KittiRaw => Box::new(kitti_raw::open_raw(path, options)?),
        Layout::Kitti360 => Box::new(kitti_raw::open_360(path, options)?),
        Layout::Cityscapes => Box::new(cityscapes::open(path, options)?),
        Layout::Euroc => Box::new(euroc::open(path, options)?),
        Layout::Mcap => Box::new(bags::open(path, options)?),
        Layout::Folder => Box::new(folder::open(path, options)?),
    })
}

/// One sequence at a path, as `inspect` shows it.
pub struct Found {
    /// Name for `--sequence`; absent where the path is the sequence itself.
    pub sequence: Option<String>,
    /// The sequence, or why it cannot be used.
    pub opened: Result<Box<dyn FrameSource>, InputError>,
}

/// The names of the sequences at `path`; empty where the path is one sequence itself.
pub fn sequences_at(path: &Path, layout: Layout) -> Result<Vec<String>, InputError> {
    match layout {
        Layout::KittiOdometry => {
            kitti::odometry_root(path).map_or(Ok(Vec::new()), |root| kitti::sequences(&root))
        }
        Layout::KittiTracking => kitti::tracking_split(path)
            .map_or(Ok(Vec::new()), |split| kitti::tracking_sequences(&split)),
        Layout::KittiRaw if kitti_raw::is_drive(path) => Ok(Vec::new()),
        Layout::KittiRaw => kitti_raw::drives(path),
        Layout::Kitti360 => {
            kitti_raw::drives_360(path).map_or(Ok(Vec::new()), |drives| kitti::sequences(&drives))
        }
        Layout::Cityscapes => cityscapes::names(path),
        Layout::Euroc | Layout::Mcap | Layout::Folder => Ok(Vec::new()),
    }
}

/// Opens everything at `path`.
pub fn survey(path: &Path, layout: Option<Layout>) -> Result<(Layout, Vec<Found>), InputError> {
    let layout = layout.map_or_else(|| Layout::guess(path), Ok)?;
    let names = sequences_at(path, layout)?;
    let names: Vec<Option<String>> =
        if names.is_empty() { vec![None] } else { names.into_iter().map(Some).collect() };
    let found = |sequence: Option<String>| {
        let options = OpenOptions {
            layout: Some(layout),
            sequence: sequence.clone(),
            ..OpenOptions::default()
        };
        Found { opened: open(path, &options), sequence }
    };
    Ok((layout, names.into_iter().map(found).collect()))
}
