//! Masks of what moves, against exact ones, by distance.

use super::{FOUND_IOU, Overlaps};
use crate::input::TrueObject;
use dynvox_core::geometry::Transform;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Frame of an object's sight from which on it counts.
pub const COUNTS_FROM: u32 = 4;
/// Upper ends of the ranges of distance, m.
const RANGES_M: [f64; 3] = [10.0, 20.0, 32.0];

/// Sums over the moving objects of a range of distance.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct RangeSums {
    objects: u64,
    found: u64,
    iou: f64,
}

/// Collects masks frame by frame.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct MovingErrors {
    frames: u64,
    ranges: [RangeSums; 3],
    false_masks: u64,
    /// For each object in sight, since how many frames it moves in sight.
    in_sight: BTreeMap<u32, u32>,
}

/// Masks of what moves, against exact ones.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MovingFigures {
    /// Frames compared.
    pub frames: u64,
    /// By distance.
    pub ranges: Vec<RangeFigures>,
    /// Mean IoU of all that were found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_iou: Option<f64>,
    /// Masks of moving objects, found by motion, less than half of whose pixels show one; over all
    /// frames.
    pub false_masks: u64,
}

/// Moving objects of a range of distance, from their fourth frame in sight on; over all frames.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RangeFigures {
    /// The range, m.
    pub distance_m: [f64; 2],
    /// Objects.
    pub objects: u64,
    /// Number of them that were found.
    pub found: u64,
    /// Share of them that were found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recall: Option<f64>,
    /// Mean IoU of those found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_iou: Option<f64>,
}

/// Masks of a frame to compare with the exact ones.
pub struct ComparedMasks<'a> {
    /// Overlaps of the masks with the exact ones.
    pub overlaps: &'a Overlaps,
    /// True objects, with the value of each in the exact masks.
    pub objects: &'a [TrueObject],
    /// True pose of the camera.
    pub t_world_camera: &'a Transform,
}

impl MovingErrors {
    /// Takes in a frame. `large_enough` tells of how many visible pixels on an object counts;
    /// `by_motion` which masks were found by motion.
    pub fn add(
        &mut self,
        &ComparedMasks { overlaps, objects, t_world_camera }: &ComparedMasks<'_>,
        large_enough: impl Fn(u64) -> bool,
        by_motion: impl Fn(u16) -> bool,
    ) {
        self.frames += 1;
        // An object counts once it has been in sight for some frames: motion needs time to show.
        // An object out of sight begins anew.
        let before = std::mem::take(&mut self.in_sight);
        for object in objects.iter().filter(|object| object.moving) {
            let label = u16::from(object.instance);
            if !large_enough(overlaps.truth_px(label)) {
                continue;
            }
            let age = before.get(&object.id).copied().unwrap_or_default() + 1;
            self.in_sight.insert(object.id, age);
            let distance_m = (t_world_camera.inverse() * object.t_world_object).translation_m[2];
            let range = RANGES_M.iter().position(|end_m| distance_m < *end_m);
            let Some(sums) =
                range.and_then(|range| self.ranges.get_mut(range)).filter(|_| age >= COUNTS_FROM)
            else {
                continue;
            };
            // A missed object lowers the recall, not the mean overlap of those that were found.
            let iou = overlaps.best_for_truth(label).map_or(0.0, |(_, iou)| iou);
            sums.objects += 1;
            if iou >= FOUND_IOU {
                sums.found += 1;
                sums.iou += iou;
            }
        }
        let moves = |label: u16| {
            objects.iter().any(|object| object.moving && u16::from(object.instance) == label)
        };
        // A mask is false if less than half of it covers what moves.
        let is_false = |&(found, pixels): &(u16, u64)| {
            by_motion(found) && 2 * overlaps.shared_px(found, moves) < pixels
        };
        self.false_masks += overlaps.found().filter(is_false).count() as u64;
    }

    /// Sums up; `None` where no frame was compared.
    pub fn figures(&self) -> Option<MovingFigures> {
        let share = |sum: f64, count: u64| (count > 0).then(|| sum / count as f64);
        // Each range begins where the one before it ends.
        let begins = std::iter::once(0.0).chain(RANGES_M);
        let range = |((sums, begin_m), end_m): ((&RangeSums, f64), f64)| RangeFigures {
            distance_m: [begin_m, end_m],
            objects: sums.objects,
            found: sums.found,
            recall: share(sums.found as f64, sums.objects),
            mean_iou: share(sums.iou, sums.found),
        };
        // Over all ranges, weighted by the masks found.
        let (iou, found) = self
            .ranges
            .iter()
            .fold((0.0, 0), |(iou, found), sums| (iou + sums.iou, found + sums.found));
        (self.frames > 0).then(|| MovingFigures {
            frames: self.frames,
            ranges: self.ranges.iter().zip(begins).zip(RANGES_M).map(range).collect(),
            mean_iou: share(iou, found),
            false_masks: self.false_masks,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dynvox_core::masks::PixelBox;

    fn object(id: u32, moving: bool, distance_m: f64) -> TrueObject {
        let mut t_world_object = Transform::IDENTITY;
        t_world_object.translation_m[2] = distance_m;
        TrueObject {
            id,
            instance: id as u8,
            pixels: PixelBox::default(),
            t_world_object,
            dimensions_m: [1.0; 3],
            moving,
            speed_m_s: 0.0,
        }
    }

    #[test]
    fn movers_count_from_their_fourth_frame_and_empty_masks_are_false() {
        let objects = [object(1, true, 5.0), object(2, true, 25.0), object(3, false, 8.0)];
        // Mask 10 is on the first, three of four pixels; mask 11 on the parked one; the second is
        // not found.
        let pairs =
            [(10, 1), (10, 1), (10, 1), (0, 1), (0, 2), (11, 3), (11, 3), (11, 0)].into_iter();
        let overlaps = Overlaps::from_pairs(pairs);
        let compared = |objects| ComparedMasks {
            overlaps: &overlaps,
            objects,
            t_world_camera: &Transform::IDENTITY,
        };
        let mut errors = MovingErrors::default();
        for _ in 0..5 {
            errors.add(&compared(&objects), |_| true, |label| label == 11);
        }
        let figures = errors.figures().unwrap();
        let [near, middle, far] = &figures.ranges[..] else { panic!("three ranges") };
        assert_eq!((near.objects, near.found, near.mean_iou), (2, 2, Some(0.75)));
        assert_eq!((middle.objects, middle.recall), (0, None));
        assert_eq!((far.objects, far.recall), (2, Some(0.0)));
        assert_eq!((figures.false_masks, figures.mean_iou), (5, Some(0.75)));
        // What was out of sight begins anew.
        errors.add(&compared(&objects[1..]), |_| true, |_| false);
        errors.add(&compared(&objects), |_| true, |_| false);
        assert_eq!(errors.figures().unwrap().ranges[0].objects, 2);
    }
}
