//! The table of data sets: a layout is guessed from a path, or chosen by its name, and opened.

use super::bags;
use super::data_set::{Layout, OpenOptions};
use super::layouts::{
    argoverse, cityscapes, driving_stereo, euroc, folder, kitti, kitti_raw, spring, vkitti,
};
use super::source::{FrameSource, InputError};
use clap::builder::PossibleValue;
use serde::Deserialize;
use serde::de::{Deserializer, Error as _};
use std::path::Path;

/// All data sets. A path is of the first that matches it, so that what holds less stands later.
pub static DATA_SETS: &[Layout] = &[
    bags::DATA_SET,
    kitti::ODOMETRY,
    cityscapes::DATA_SET,
    euroc::DATA_SET,
    kitti_raw::KITTI_360,
    kitti_raw::KITTI_RAW,
    kitti::TRACKING,
    vkitti::DATA_SET,
    spring::DATA_SET,
    driving_stereo::DATA_SET,
    argoverse::DATA_SET,
    folder::DATA_SET,
];

/// Data sets named at most if a folder is none itself but holds some.
const HINTS: usize = 8;

/// Folders above one that is no data set in which one is looked for.
const AROUND: usize = 3;

impl clap::ValueEnum for Layout {
    fn value_variants<'a>() -> &'a [Self] {
        DATA_SETS
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.name()).help(self.row().summary))
    }
}

impl<'de> Deserialize<'de> for Layout {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Self::named(&name).ok_or_else(|| {
            let known: Vec<_> = DATA_SETS.iter().map(|layout| layout.name()).collect();
            D::Error::custom(format!(
                "no data set is named {name}: use one of {}",
                known.join(", ")
            ))
        })
    }
}

impl Layout {
    /// Finds a layout by its name.
    pub fn named(name: &str) -> Option<Self> {
        DATA_SETS.iter().copied().find(|layout| layout.name() == name)
    }

    /// Guesses the layout at `path`.
    ///
    /// # Errors
    /// There is nothing, or nothing of a known layout.
    pub fn guess(path: &Path) -> Result<Self, InputError> {
        if !path.exists() {
            return Err(InputError::Absent { path: path.to_path_buf() });
        }
        if path.is_file() && !(bags::DATA_SET.row().matches)(path) {
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
        DATA_SETS.iter().copied().find(|layout| (layout.row().matches)(path))
    }
}

/// Opens the recording at `path`.
///
/// # Errors
/// The data set or a file of it is missing, or cannot be used.
pub fn open(path: &Path, options: &OpenOptions) -> Result<Box<dyn FrameSource>, InputError> {
    if !path.exists() {
        return Err(InputError::Absent { path: path.to_path_buf() });
    }
    let layout = layout_of(path, options)?;
    super::inertial::attached((layout.row().open)(path, options)?, options)
}

/// The layout that is asked for, else the one at a path. A folder of pictures is one where their
/// calibration is given.
fn layout_of(path: &Path, options: &OpenOptions) -> Result<Layout, InputError> {
    match options.layout.map_or_else(|| Layout::guess(path), Ok) {
        Err(InputError::Layout { .. } | InputError::Within { .. })
            if !options.calibration.is_empty() && folder::holds_pictures(path) =>
        {
            Ok(folder::DATA_SET)
        }
        found => found,
    }
}

/// One sequence at a path, as `inspect` shows it.
pub struct Found {
    /// Name for `--sequence`; absent where the path is the sequence itself.
    pub sequence: Option<String>,
    /// The sequence, or why it cannot be used.
    pub opened: Result<Box<dyn FrameSource>, InputError>,
}

/// Lists the names of the sequences at `path`; none if the path is one sequence itself.
///
/// # Errors
/// A folder cannot be read.
pub fn sequences_at(path: &Path, layout: Layout) -> Result<Vec<String>, InputError> {
    (layout.row().sequences)(path)
}

/// Opens everything at `path`; the options' sequence is not looked at.
pub fn survey(path: &Path, options: &OpenOptions) -> Result<(Layout, Vec<Found>), InputError> {
    let layout = layout_of(path, options)?;
    let names = sequences_at(path, layout)?;
    let names: Vec<Option<String>> =
        if names.is_empty() { vec![None] } else { names.into_iter().map(Some).collect() };
    let found = |sequence: Option<String>| {
        let options =
            OpenOptions { layout: Some(layout), sequence: sequence.clone(), ..options.clone() };
        Found { opened: open(path, &options), sequence }
    };
    Ok((layout, names.into_iter().map(found).collect()))
}
