//! KITTI-MOTS (Voigtlaender et al., *MOTS: Multi-Object Tracking and Segmentation*, CVPR 2019), as
//! PNGs or as text.
//!
//! A 16-bit PNG a frame: `class * 1000 + instance`, 0 nothing, 10000 a region to ignore. Or one
//! text file a sequence, a row a mask: `frame id class height width runs`, with `id` as in the PNGs
//! and [`crate::formats::rle`] for the runs. Class 1 is car, 2 pedestrian, 10 the region to ignore.
//! There are no scores: all are 1. The tracks in the numbers are not used.

use super::format::{MaskFormat, OpenedMasks, frames_of};
use super::shapes::{around_runs, mask_of_runs};
use super::{Frames, MaskSource, read_labels};
use crate::formats::rle;
use crate::input::source::{FrameMasks, InputError, StereoImages, bounding_boxes};
use dynvox_core::tracking::Class;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Instances of a class in the numbers.
const PER_CLASS: u16 = 1_000;
/// Class of regions to ignore.
const IGNORE: u16 = 10;

/// The class of a number.
fn class(number: u16, masks: &mut FrameMasks) -> Class {
    match number {
        1 => Class::Car,
        2 => Class::Person,
        _ => {
            masks.refusals.unknown_class += 1;
            Class::Other
        }
    }
}

/// KITTI-MOTS, as pictures or text.
pub static FORMAT: MaskFormat = MaskFormat {
    name: "mots",
    value: "DIR or FILE",
    summary: "KITTI-MOTS",
    open: |path, dataset| {
        let frames = frames_of(dataset);
        if path.is_file() {
            return Ok(OpenedMasks::masks(MotsText::open(path, frames)?, dataset.len()));
        }
        let (pictures, there) = MotsPictures::open(path, frames);
        Ok(OpenedMasks::masks(pictures, there))
    },
};

/// A folder of PNGs.
pub(super) struct MotsPictures {
    folder: PathBuf,
    frames: Frames,
}

impl MotsPictures {
    /// The folder, and how many of the frames it has masks for.
    pub fn open(folder: &Path, frames: Frames) -> (Self, usize) {
        let there = frames.files(folder, "png");
        (Self { folder: folder.to_path_buf(), frames }, there)
    }
}

impl MaskSource for MotsPictures {
    fn masks(&self, index: usize, _: &StereoImages) -> Result<FrameMasks, InputError> {
        let stem = self.frames.stems.get(index).map(|stem| self.folder.join(format!("{stem}.png")));
        let Some(path) = stem.filter(|path| path.is_file()) else {
            return Ok(FrameMasks::missing());
        };
        let labels = read_labels(&path, self.frames.size)?;
        let boxes = bounding_boxes(&labels);
        let mut masks = FrameMasks::default();
        let instances = boxes.keys().filter(|label| **label / PER_CLASS != IGNORE);
        let named =
            instances.map(|&label| (label, class(label / PER_CLASS, &mut masks), 1.0)).collect();
        masks.extract(&labels, &boxes, named);
        Ok(masks)
    }
}

/// A mask in the text file.
struct Row {
    class: u16,
    runs: String,
    line: usize,
}

/// A text file.
pub(super) struct MotsText {
    path: PathBuf,
    frames: Frames,
    rows: BTreeMap<usize, Vec<Row>>,
}

impl MotsText {
    /// Reads the file. Frames it does not name are such in which nothing is seen.
    pub fn open(path: &Path, frames: Frames) -> Result<Self, InputError> {
        let text = super::read_text(path)?.unwrap_or_default();
        let mut rows = BTreeMap::<usize, Vec<Row>>::new();
        for (line, row) in (1..).zip(text.lines()).filter(|(_, row)| !row.trim().is_empty()) {
            let wrong = || {
                InputError::masks(
                    path,
                    format!("line {line} is not `frame id class height width runs`"),
                )
            };
            let words: Vec<&str> = row.split_whitespace().collect();
            let [frame, _, class, height, width, runs] = words[..] else { return Err(wrong()) };
            let numbers: Option<Vec<usize>> =
                [frame, class, height, width].iter().map(|word| word.parse().ok()).collect();
            let [frame, class, height, width] = numbers.ok_or_else(wrong)?[..] else {
                return Err(wrong());
            };
            if (width, height) != frames.size {
                let (w, h) = frames.size;
                return Err(InputError::masks(
                    path,
                    format!(
                        "the mask of line {line} is {width} x {height} px, but the images are {w} \
                         x {h} px"
                    ),
                ));
            }
            let class = u16::try_from(class).map_err(|_| wrong())?;
            rows.entry(frame).or_default().push(Row { class, runs: runs.to_owned(), line });
        }
        Ok(Self { path: path.to_path_buf(), frames, rows })
    }
}

impl MaskSource for MotsText {
    fn masks(&self, index: usize, _: &StereoImages) -> Result<FrameMasks, InputError> {
        let number = self.frames.number(index);
        let (width, height) = self.frames.size;
        let mut masks = FrameMasks::default();
        for row in self.rows.get(&number).into_iter().flatten().filter(|row| row.class != IGNORE) {
            let runs = rle::runs(&row.runs, width, height).map_err(|reason| {
                InputError::masks(&self.path, format!("line {}: {reason}", row.line))
            })?;
            let class = class(row.class, &mut masks);
            let Some(pixels) = around_runs(&runs, height) else {
                masks.refusals.empty += 1;
                continue;
            };
            if masks.reserve(pixels.area() as usize) {
                masks.push(Some(mask_of_runs(class, 1.0, pixels, &runs, height)));
            }
        }
        Ok(masks)
    }
}
