//! PNGs of instance numbers without a list, `STEM.png`, 8 or 16 bit: k is instance k of this frame,
//! of no class, taken as a car. Or Cityscapes' `*_instanceIds.png`: `label * 1000 + k` an instance,
//! numbers below 1000 are regions without instances.

use super::format::{MaskFormat, OpenedMasks, frames_of};
use super::{Frames, MaskSource, read_labels};
use crate::input::source::{FrameMasks, InputError, StereoImages, bounding_boxes};
use dynvox_core::tracking::Class;
use std::path::{Path, PathBuf};

/// Instances of a label in Cityscapes' numbers.
const PER_LABEL: u16 = 1_000;
/// Cityscapes' labels that have instances, from 24 on.
const CITYSCAPES: [Class; 10] = [
    Class::Person,
    Class::Rider,
    Class::Car,
    Class::Truck,
    Class::Bus,
    Class::Truck, // caravan
    Class::Truck, // trailer
    Class::Train,
    Class::Motorcycle,
    Class::Bicycle,
];

/// PNGs of instance numbers.
pub static FORMAT: MaskFormat = MaskFormat {
    name: "ids",
    value: "DIR",
    summary: "PNG of numbers",
    open: |path, dataset| {
        let (masks, there) = Ids::open(path, frames_of(dataset));
        Ok(OpenedMasks::masks(masks, there))
    },
};

/// A folder of instance numbers.
pub(super) struct Ids {
    folder: PathBuf,
    frames: Frames,
}

impl Ids {
    /// The folder, and how many of the frames it has numbers for.
    pub fn open(folder: &Path, frames: Frames) -> (Self, usize) {
        let ids = Self { folder: folder.to_path_buf(), frames };
        let there = ids.frames.stems.iter().filter(|stem| ids.file(stem).is_some()).count();
        (ids, there)
    }

    /// The file of a frame, and whether its numbers are Cityscapes'.
    fn file(&self, stem: &str) -> Option<(PathBuf, bool)> {
        let cityscapes = stem.strip_suffix("_leftImg8bit").unwrap_or(stem);
        let names = [
            (format!("{stem}.png"), false),
            (format!("{cityscapes}_gtFine_instanceIds.png"), true),
        ];
        names
            .into_iter()
            .map(|(name, named)| (self.folder.join(name), named))
            .find(|(path, _)| path.is_file())
    }
}

impl MaskSource for Ids {
    fn masks(&self, index: usize, _: &StereoImages) -> Result<FrameMasks, InputError> {
        let file = self.frames.stems.get(index).and_then(|stem| self.file(stem));
        let Some((path, cityscapes)) = file else { return Ok(FrameMasks::missing()) };
        let labels = read_labels(&path, self.frames.size)?;
        let boxes = bounding_boxes(&labels);
        let mut masks = FrameMasks::default();
        let mut named = Vec::new();
        for &label in boxes.keys() {
            let class = match label / PER_LABEL {
                0 if cityscapes => continue,
                _ if !cityscapes => Some(Class::Car),
                number => {
                    number.checked_sub(24).and_then(|at| CITYSCAPES.get(usize::from(at))).copied()
                }
            };
            masks.refusals.unknown_class += u32::from(class.is_none());
            named.push((label, class.unwrap_or_default(), 1.0));
        }
        masks.extract(&labels, &boxes, named);
        Ok(masks)
    }
}
