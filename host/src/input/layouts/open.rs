//! Guessing a layout from its path, and saying what was found.

use super::{CameraPair, folder, kitti};
use crate::input::source::{FrameSource, InputError};
use std::path::Path;

/// Data sets named at most where a folder is none itself but holds some.
const HINTS: usize = 8;

/// How many folders up a data set is looked for around one that is none itself.
const AROUND: usize = 3;

/// The known layouts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Layout {
    /// KITTI odometry: `sequences/NN/{image_0,image_1,calib.txt}`.
    KittiOdometry,
    /// KITTI tracking: `training/{image_02,image_03}/NNNN`, `training/calib/NNNN.txt`.
    KittiTracking,
    /// A folder with `left/`, `right/`, `calib.txt`.
    Folder,
}

impl Layout {
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::KittiOdometry => "kitti-odometry",
            Self::KittiTracking => "kitti-tracking",
            Self::Folder => "folder",
        }
    }

    /// The layout at `path`.
    pub fn guess(path: &Path) -> Result<Self, InputError> {
        if !path.exists() {
            return Err(InputError::Absent { path: path.to_path_buf() });
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
            let mut below: Vec<_> = entries.filter(|folder| Self::of(folder).is_some()).take(HINTS).collect();
            below.sort();
            InputError::Layout { path: path.to_path_buf(), below }
        })
    }

    fn of(path: &Path) -> Option<Self> {
        if kitti::odometry_root(path).is_some() || kitti::is_odometry_sequence(path) {
            Some(Self::KittiOdometry)
        } else if kitti::tracking_split(path).is_some() {
            Some(Self::KittiTracking)
        } else {
            folder::is_stereo_folder(path).then_some(Self::Folder)
        }
    }
}

/// Opens the data set at `path`; the layout is guessed unless `kind` says it.
pub fn open(path: &Path, kind: Option<Layout>, sequence: Option<&str>, images: CameraPair) -> Result<Box<dyn FrameSource>, InputError> {
    if !path.exists() {
        return Err(InputError::Absent { path: path.to_path_buf() });
    }
    let kind = kind.map_or_else(|| Layout::guess(path), Ok)?;
    Ok(match kind {
        Layout::KittiOdometry => Box::new(kitti::open_odometry(path, sequence, images)?),
        Layout::KittiTracking => Box::new(kitti::open_tracking(path, sequence)?),
        Layout::Folder => Box::new(folder::open(path)?),
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
pub fn sequences_at(path: &Path, kind: Layout) -> Result<Vec<String>, InputError> {
    match kind {
        Layout::KittiOdometry => kitti::odometry_root(path).map_or(Ok(Vec::new()), |root| kitti::sequences(&root)),
        Layout::KittiTracking => kitti::tracking_split(path).map_or(Ok(Vec::new()), |split| kitti::tracking_sequences(&split)),
        Layout::Folder => Ok(Vec::new()),
    }
}

/// Opens everything at `path`.
pub fn survey(path: &Path, kind: Option<Layout>) -> Result<(Layout, Vec<Found>), InputError> {
    let kind = kind.map_or_else(|| Layout::guess(path), Ok)?;
    let names = sequences_at(path, kind)?;
    let names: Vec<Option<String>> = if names.is_empty() { vec![None] } else { names.into_iter().map(Some).collect() };
    let found = |sequence: Option<String>| Found { opened: open(path, Some(kind), sequence.as_deref(), CameraPair::Auto), sequence };
    Ok((kind, names.into_iter().map(found).collect()))
}
