//! Masks against true masks: how much of each true one its best mask covers, and which masks are of
//! nothing.
//!
//! The measure is intersection over union (IoU). A true mask is found when one of the frame's masks
//! has an IoU of at least [`FOUND_IOU`] with it, the threshold of COCO's and KITTI-MOTS's first
//! figures.

mod files;
mod moving;

pub use files::{AreaFigures, FileFigures, FoundMask, compare};
pub use moving::{ComparedMasks, MovingErrors, MovingFigures, RangeFigures};

use crate::formats::Image;
use std::collections::BTreeMap;

/// Least IoU of a mask with a true one that it finds.
pub const FOUND_IOU: f64 = 0.5;

/// Pixels of the labels of two images, and those they share. Label 0 is no mask.
#[derive(Debug, Default)]
pub struct Overlaps {
    found: BTreeMap<u16, u64>,
    truth: BTreeMap<u16, u64>,
    both: BTreeMap<(u16, u16), u64>,
}

impl Overlaps {
    /// Counts pairs of labels: found, true.
    pub fn from_pairs(pairs: impl Iterator<Item = (u16, u16)>) -> Self {
        let mut counted = Self::default();
        // Neither found nor true says nothing about masks.
        for (found, truth) in pairs.filter(|pair| *pair != (0, 0)) {
            *counted.both.entry((found, truth)).or_default() += 1;
        }
        for (&(found, truth), &count) in &counted.both {
            *counted.found.entry(found).or_default() += count;
            *counted.truth.entry(truth).or_default() += count;
        }
        // Pairs with label 0 counted for the sizes only: it is no mask.
        counted.both.retain(|(found, truth), _| *found > 0 && *truth > 0);
        counted.found.remove(&0);
        counted.truth.remove(&0);
        counted
    }

    /// Compares two images of labels of one size.
    pub fn of_images(found: &Image<u16>, truth: &Image<u16>) -> Self {
        Self::from_pairs(found.pixels().iter().copied().zip(truth.pixels().iter().copied()))
    }

    /// Masks found, each with its pixels.
    pub fn found(&self) -> impl Iterator<Item = (u16, u64)> {
        self.found.iter().map(|(&label, &pixels)| (label, pixels))
    }

    /// True masks, each with its pixels.
    pub fn truth(&self) -> impl Iterator<Item = (u16, u64)> {
        self.truth.iter().map(|(&label, &pixels)| (label, pixels))
    }

    /// Pixels of a true mask; 0 where it has none.
    pub fn truth_px(&self, label: u16) -> u64 {
        self.truth.get(&label).copied().unwrap_or_default()
    }

    /// Pixels of a mask found that lie in true masks for which `holds` is true.
    pub fn shared_px(&self, found: u16, holds: impl Fn(u16) -> bool) -> u64 {
        self.both
            .iter()
            .filter(|((label, truth), _)| *label == found && holds(*truth))
            .map(|(_, count)| count)
            .sum()
    }

    /// IoU of a mask found with a true one.
    pub fn iou(&self, found: u16, truth: u16) -> f64 {
        let of = |counts: &BTreeMap<u16, u64>, label: u16| {
            counts.get(&label).copied().unwrap_or_default()
        };
        let both = self.both.get(&(found, truth)).copied().unwrap_or_default();
        let either = of(&self.found, found) + of(&self.truth, truth) - both;
        if either == 0 { 0.0 } else { both as f64 / either as f64 }
    }

    /// The best mask for a true one: its label and their IoU.
    pub fn best_for_truth(&self, truth: u16) -> Option<(u16, f64)> {
        best(
            self.both
                .keys()
                .filter(|(_, label)| *label == truth)
                .map(|&(found, _)| (found, self.iou(found, truth))),
        )
    }

    /// The best true mask for one that was found.
    pub fn best_for_found(&self, found: u16) -> Option<(u16, f64)> {
        best(
            self.both
                .keys()
                .filter(|(label, _)| *label == found)
                .map(|&(_, truth)| (truth, self.iou(found, truth))),
        )
    }
}

/// The largest; of equals the first.
fn best(candidates: impl Iterator<Item = (u16, f64)>) -> Option<(u16, f64)> {
    candidates.fold(
        None,
        |best, one| if best.is_none_or(|(_, most)| one.1 > most) { Some(one) } else { best },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlaps_are_counted_and_the_best_pair_is_named() {
        // Label 1 covers the true mask 7 by half and has as much beside it; label 2 shares a pixel
        // with it.
        let pairs = [(1, 7), (1, 7), (1, 0), (1, 0), (2, 7), (0, 7), (0, 0), (3, 9)];
        let overlaps = Overlaps::from_pairs(pairs.into_iter());
        assert_eq!(overlaps.found().collect::<Vec<_>>(), [(1, 4), (2, 1), (3, 1)]);
        assert_eq!(overlaps.truth().collect::<Vec<_>>(), [(7, 4), (9, 1)]);
        assert_eq!(overlaps.best_for_truth(7), Some((1, 2.0 / 6.0)));
        assert_eq!(overlaps.best_for_found(2), Some((7, 0.25)));
        assert_eq!((overlaps.best_for_truth(8), overlaps.iou(3, 9)), (None, 1.0));
        assert_eq!(
            (overlaps.shared_px(1, |truth| truth == 7), overlaps.shared_px(1, |truth| truth == 9)),
            (2, 0)
        );
    }
}
