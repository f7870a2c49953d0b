//! Where masks come from: instance PNGs with a list beside them or without, KITTI-MOTS, COCO, YOLO,
//! MNC dumps, boxes, the synthetic street's own truth, the same with a detector's faults, or
//! nowhere.
//!
//! A source gives, frame by frame, owned [`crate::input::InstanceMask`]s, which the core takes as
//! `Detection`s. Where a source says something that cannot be a mask (a file of another size, a
//! line that is not a row) the run ends with a sentence; where it says too much or nothing usable
//! (an instance without a row, an empty mask, an unknown class, more than the limits) that is
//! counted in
//! [`crate::input::MaskRefusals`]. The core validates the scores.
//!
//! Memory: at most `MAX_MASKS` masks and `MAX_BYTES` bytes of them in a frame; masks beyond that
//! are counted.

mod boxes;
mod choice;
mod coco;
mod coco_values;
mod exact;
mod format;
mod ids;
mod indexed;
mod mnc;
mod mots;
#[cfg(feature = "onnx")]
mod network;
mod noisy;
mod open;
mod pairs;
mod save;
mod shapes;
#[cfg(test)]
mod tests;
mod yolo;

pub use choice::{MASK_FORMATS, MaskChoice};
pub use format::MaskFormat;
pub use indexed::FORMAT as INDEXED_PNGS;
#[cfg(feature = "onnx")]
pub use network::{run_networks_in, serve as serve_network};
pub use open::attach;
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

impl Frames {
    /// The number that tables of a sequence have for a frame: its name, where that is one.
    fn number(&self, index: usize) -> usize {
        self.stems.get(index).and_then(|stem| stem.parse().ok()).unwrap_or(index)
    }

    /// Counts the frames that have a file of their name in a folder.
    fn files(&self, folder: &Path, ending: &str) -> usize {
        self.stems.iter().filter(|stem| folder.join(format!("{stem}.{ending}")).is_file()).count()
    }
}

/// The class of a name; `_` and `-` may stand for spaces.
fn class_of(name: &str) -> Option<Class> {
    Class::from_name(name).or_else(|| Class::from_name(&name.replace(['_', '-'], " ")))
}

/// The class at a position of COCO's list of 80, which most networks have.
fn coco_class(index: usize) -> Option<Class> {
    Some(match index {
        0 => Class::Person,
        1 => Class::Bicycle,
        2 => Class::Car,
        3 => Class::Motorcycle,
        5 => Class::Bus,
        6 => Class::Train,
        7 => Class::Truck,
        14..=23 => Class::Animal,
        _ if index < 80 => Class::Other,
        _ => return None,
    })
}

/// A PNG whose grey values, 8 or 16 bit, are numbers of instances.
fn read_labels(path: &Path, size: (usize, usize)) -> Result<Image<u16>, InputError> {
    let labels = read_png_u16(path).map_err(InputError::masks_format)?;
    let found = (labels.width(), labels.height());
    if found == size {
        Ok(labels)
    } else {
        Err(InputError::masks_format(FormatError::other_size(path, found, size)))
    }
}

/// A file's text, or `None` when there is no such file.
fn read_text(path: &Path) -> Result<Option<String>, InputError> {
    if !path.exists() {
        return Ok(None);
    }
    Ok(Some(crate::formats::read_text(path)?))
}
