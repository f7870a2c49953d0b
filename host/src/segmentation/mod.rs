//! Where masks come from: instance PNGs with a list beside them, KITTI-MOTS, MNC dumps, the synthetic street's own truth, the same with a
//! detector's faults, or nowhere.
//!
//! A source gives, frame by frame, owned [`Sighting`]s, which the core takes as `Detection`s. Where a source says something that cannot be
//! a mask (a file of another size, a line that is no row) the run ends with a sentence; where it says too much or nothing usable (an
//! instance without a row, an empty mask, a class nobody knows, more than the ceiling) that is counted in [`Refusals`]. Scores are the
//! core's to judge.
//!
//! Memory: at most [`MOST_SIGHTINGS`] masks and [`MOST_BYTES`] bytes of them in a frame, whatever the files hold.

mod exact;
mod indexed;
mod mnc;
mod mots;
mod noisy;
mod rle;
mod sighting;
mod source;
#[cfg(test)]
mod tests;

pub use sighting::{MOST_BYTES, MOST_SIGHTINGS, Refusals, Sighting, Sightings};
pub use source::{Choice, attach};

use crate::dataset::{DatasetError, Image, StereoImages};
use dynvox_core::tracking::Class;
use std::path::Path;

/// Gives the masks of a frame.
trait Segmenter: Send + Sync {
    /// What is seen in frame `index` of the data set, whose images are at hand.
    fn sightings(&self, index: usize, images: &StereoImages) -> Result<Sightings, DatasetError>;
}

/// A frame's images by name and size, as files of masks refer to them.
#[derive(Clone, Debug)]
struct Frames {
    /// File names without ending: `000123`.
    stems: Vec<String>,
    /// Size of the files' images, px.
    size: (usize, usize),
}

/// Masks that cannot be used.
fn unusable(path: &Path, reason: String) -> DatasetError {
    DatasetError::Masks { path: path.to_path_buf(), reason }
}

/// The class of a name, whatever stands for its spaces.
fn class_of(name: &str) -> Option<Class> {
    Class::from_name(name).or_else(|| Class::from_name(&name.replace(['_', '-'], " ")))
}

/// A PNG whose grey values, 8 or 16 bit, are numbers of instances.
fn read_labels(path: &Path, size: (usize, usize)) -> Result<Image<u16>, DatasetError> {
    let labels = crate::dataset::read_png_u16(path)?;
    let found = (labels.width(), labels.height());
    if found != size {
        let (width, height) = size;
        return Err(unusable(path, format!("it is {} x {} px, but the images are {width} x {height} px", found.0, found.1)));
    }
    Ok(labels)
}

/// A file's text, or `None` when there is no such file.
fn read_text(path: &Path) -> Result<Option<String>, DatasetError> {
    match std::fs::read_to_string(path) {
        Ok(text) => Ok(Some(text)),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(DatasetError::Read { path: path.to_path_buf(), source }),
    }
}
