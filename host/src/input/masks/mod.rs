//! Where masks come from: instance PNGs with a list beside them, KITTI-MOTS, MNC dumps, the synthetic street's own truth, the same with a
//! detector's faults, or nowhere.
//!
//! A source gives, frame by frame, owned [`crate::input::InstanceMask`]s, which the core takes as `Detection`s. Where a source says something that cannot be
//! a mask (a file of another size, a line that is not a row) the run ends with a sentence; where it says too much or nothing usable (an
//! instance without a row, an empty mask, an unknown class, more than the limits) that is counted in
//! [`crate::input::MaskRefusals`]. The core validates the scores.
//!
//! Memory: at most `MAX_MASKS` masks and `MAX_BYTES` bytes of them in a frame; masks beyond that are counted.

mod choice;
mod exact;
mod indexed;
mod mnc;
mod mots;
mod noisy;
mod pairs;
mod save;
#[cfg(test)]
mod tests;

pub use choice::{MaskChoice, attach};
pub use pairs::{LabelPair, label_pairs};
pub use save::{save_masks, save_masks_in_order};

use crate::formats::{FormatError, Image, read_png_u16};
use crate::input::source::{FrameMasks, InputError, StereoImages};
use dynvox_core::tracking::Class;
use std::path::Path;

/// Gives the masks of a frame.
trait MaskSource: Send + Sync {
    /// The masks of frame `index` of a source of frames, whose images are at hand.
    fn masks(&self, index: usize, images: &StereoImages) -> Result<FrameMasks, InputError>;
}

/// A frame's images by name and size, as files of masks refer to them.
#[derive(Clone, Debug)]
struct Frames {
    /// File names without ending: `000123`.
    stems: Vec<String>,
    /// Size of the files' images, px.
    size: (usize, usize),
}

/// The class of a name; `_` and `-` may stand for spaces.
fn class_of(name: &str) -> Option<Class> {
    Class::from_name(name).or_else(|| Class::from_name(&name.replace(['_', '-'], " ")))
}

/// A PNG whose grey values, 8 or 16 bit, are numbers of instances.
fn read_labels(path: &Path, size: (usize, usize)) -> Result<Image<u16>, InputError> {
    let labels = read_png_u16(path).map_err(InputError::masks_format)?;
    let found = (labels.width(), labels.height());
    if found == size { Ok(labels) } else { Err(InputError::masks_format(FormatError::other_size(path, found, size))) }
}

/// A file's text, or `None` when there is no such file.
fn read_text(path: &Path) -> Result<Option<String>, InputError> {
    if !path.exists() {
        return Ok(None);
    }
    Ok(Some(crate::formats::read_text(path)?))
}
