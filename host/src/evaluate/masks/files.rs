//! A folder of masks against another one, frame by frame.

use super::{FOUND_IOU, Overlaps};
use crate::input::InputError;
use crate::input::masks::label_pairs;
use serde::Serialize;
use std::path::Path;

/// Least pixels of a true mask that counts, and of a large one.
const AREAS_PX: [u64; 2] = [400, 4_000];

/// A mask that was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FoundMask {
    /// Name of its frame.
    pub frame: String,
    /// Value of the instance's pixels in the picture.
    pub id: u16,
    /// Number of pixels with this value.
    pub pixels: u64,
    /// The true mask it overlaps most, and their IoU.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub best: Option<(u16, f64)>,
}

/// A folder of masks against a folder of true ones.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FileFigures {
    /// Frames that both folders have.
    pub frames: usize,
    /// Every mask that was found.
    pub found: Vec<FoundMask>,
    /// Masks that find no true one.
    pub false_masks: usize,
    /// True masks of more than 400 px, and of more than 4,000 px.
    pub truth: [AreaFigures; 2],
}

/// True masks from a number of pixels on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct AreaFigures {
    /// Pixels they have at least.
    pub pixels_min: u64,
    /// Number of masks compared.
    pub masks: u64,
    /// Number of them that were found.
    pub found: u64,
    /// Mean IoU of all with their best mask, 0 without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_iou: Option<f64>,
    /// Mean IoU of those found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_iou_found: Option<f64>,
}

/// Compares the pictures of instances that two folders have under one name.
///
/// # Errors
/// A picture cannot be read, or two differ in size.
pub fn compare(found: &Path, truth: &Path) -> Result<FileFigures, InputError> {
    let mut figures = FileFigures::default();
    let mut sums = [[0.0; 2]; 2];
    for pair in label_pairs(found, truth)? {
        let (frame, [found, truth]) = pair?;
        let overlaps = Overlaps::of_images(&found, &truth);
        figures.frames += 1;
        // A mask that matches no true one well is false.
        for (id, pixels) in overlaps.found() {
            let best = overlaps.best_for_found(id);
            figures.false_masks += usize::from(best.is_none_or(|(_, iou)| iou < FOUND_IOU));
            figures.found.push(FoundMask { frame: frame.clone(), id, pixels, best });
        }
        for (id, pixels) in overlaps.truth() {
            let iou = overlaps.best_for_truth(id).map_or(0.0, |(_, iou)| iou);
            for ((area, sums), least) in figures.truth.iter_mut().zip(&mut sums).zip(AREAS_PX) {
                let is_found = iou >= FOUND_IOU;
                // The sums of an area stand for all true masks larger than its bound.
                if pixels > least {
                    area.masks += 1;
                    area.found += u64::from(is_found);
                    sums[0] += iou;
                    sums[1] += if is_found { iou } else { 0.0 };
                }
            }
        }
    }
    for ((area, [all, found]), least) in figures.truth.iter_mut().zip(sums).zip(AREAS_PX) {
        area.pixels_min = least;
        area.mean_iou = (area.masks > 0).then(|| all / area.masks as f64);
        area.mean_iou_found = (area.found > 0).then(|| found / area.found as f64);
    }
    Ok(figures)
}
