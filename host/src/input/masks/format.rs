//! A mask format's row in the table of formats, and what opening one gives.
//!
//! Each format's file holds such a row as `FORMAT`; [`super::open`] lists them.

use super::{Frames, MaskSource};
use crate::input::source::{FrameSource, InputError};
use std::fmt;
use std::path::Path;

/// Format of files of masks, or of boxes to make masks of.
pub struct MaskFormat {
    /// Name on the command line, before the colon.
    pub name: &'static str,
    /// Value after the colon: `DIR`, `FILE` or both.
    pub value: &'static str,
    /// Note for the help, in brackets; empty if the name says it.
    pub summary: &'static str,
    /// Opens the files at a path that exists.
    pub(super) open: fn(&Path, &dyn FrameSource) -> Result<OpenedMasks, InputError>,
}

/// Two formats are equal if their names are.
impl PartialEq for MaskFormat {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for MaskFormat {}

impl fmt::Debug for MaskFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// Files of masks that were opened for a data set.
pub(super) struct OpenedMasks {
    pub source: Box<dyn MaskSource>,
    /// Frames that have masks; none if the files belong to another data set.
    pub there: usize,
    /// Masks have the size of the images as they are mapped, not as they are in files.
    pub fits_scaled: bool,
}

impl OpenedMasks {
    /// Masks for `there` frames, of the size of the images in files.
    pub fn masks(source: impl MaskSource + 'static, there: usize) -> Self {
        Self { source: Box::new(source), there, fits_scaled: false }
    }
}

/// Names and size of a data set's images.
pub(super) fn frames_of(dataset: &dyn FrameSource) -> Frames {
    Frames {
        stems: (0..dataset.len())
            .map(|index| dataset.stem(index).unwrap_or_else(|| format!("{index:06}")))
            .collect(),
        size: dataset.full_size(),
    }
}

/// All frames of a data set if there are any files: a frame without one is one in which nothing was
/// found, and only a folder without any is wrong.
pub(super) fn all_if_any(there: usize, dataset: &dyn FrameSource) -> usize {
    if there > 0 { dataset.len() } else { 0 }
}
