//! Instances: the detections of a frame that were accepted, with their masks.
//!
//! A detection is refused, and counted, when its score is not a number in 0..=1, its box is empty
//! or outside the image, or its mask is shorter than its box or empty. Above `capacity.detections`
//! the lowest scores are refused. A detection of a class that does not move is left to the static
//! map. Where masks overlap the higher score is on top: the other loses the pixels.
//!
//! A detection whose box is not larger than `area_min_px` is too small to be reconstructed, and
//! left to the static map as well; but it may be a car that drives far ahead. If it is larger than
//! `track_area_min_px` it is *tracked only*, with what space and pixels the larger ones leave; once
//! it is known to move the static map is kept clear of it.
//!
//! The order in the caller's list does not matter: detections are sorted by score, then class, box
//! and mask; two that agree in all of these are interchangeable. Time: linear in the pixels of the
//! masks.

mod candidate;
mod class;
mod config;
mod detection;
mod index;
mod instance;
#[cfg(test)]
mod tests;

pub use class::{Class, Treatment};
pub use config::InstancesConfig;
pub use detection::{Detection, DetectionCount, MAX_DETECTIONS};
pub(super) use index::{Flag, OptionalIndex};
pub(crate) use instance::Instance;

use crate::{
    masks::{MaskHandle, MaskStore, PixelBox},
    memory::{Capacity, Carver, region_bytes},
    slices::{clipped, clipped_mut},
};
use candidate::{DropReason, select_best};

/// The instances of a frame, best first.
#[derive(Debug)]
pub(super) struct Instances<'s> {
    config: InstancesConfig,
    table: &'s mut [Instance],
    len: usize,
}

impl<'s> Instances<'s> {
    pub const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<Instance>(capacity.detections)
    }

    pub fn new_in(capacity: &Capacity, config: &InstancesConfig, carver: &mut Carver<'s>) -> Self {
        let table = carver.alloc("tracking.instance", capacity.detections);
        Self { config: *config, table, len: 0 }
    }

    pub fn config(&self) -> &InstancesConfig {
        &self.config
    }

    pub fn all(&self) -> &[Instance] {
        debug_assert!(self.len <= self.table.len());
        clipped(self.table, ..self.len)
    }

    pub fn all_mut(&mut self) -> &mut [Instance] {
        clipped_mut(self.table, ..self.len)
    }

    /// Validates a frame's detections and keeps the best, with their masks in `store`.
    pub fn ingest(
        &mut self,
        given: &[Detection<'_>],
        [width, height]: [usize; 2],
        store: &mut MaskStore<'_>,
    ) -> DetectionCount {
        self.len = 0;
        let image = PixelBox { left: 0, top: 0, width: width as i32, height: height as i32 };
        let mut count = DetectionCount { given: given.len() as u32, ..DetectionCount::default() };
        let best = select_best(&self.config, given, &image, self.table.len(), &mut count);
        for candidate in &best {
            let Some(detection) = given.get(candidate.index as usize) else { continue };
            let pixels = candidate.whole.intersection(&image);
            match self.take_mask(detection, &candidate.whole, pixels, store) {
                Ok(mask) => {
                    let score = f32::from_bits(candidate.score_bits);
                    let added = self.add(mask, candidate.class, score, width);
                    let small = candidate.tracked_only;
                    count.accepted += u32::from(added && !small);
                    count.too_small += u32::from(added && small);
                    count.tracked_only += u32::from(added && small);
                }
                Err(reason) => candidate.drop(&mut count, reason),
            }
        }
        count
    }

    /// Packs a detection's mask, without the pixels of the instances so far; or returns the count
    /// of what does not fit or has no pixel left.
    fn take_mask(
        &self,
        detection: &Detection<'_>,
        whole: &PixelBox,
        pixels: PixelBox,
        store: &mut MaskStore<'_>,
    ) -> Result<MaskHandle, DropReason> {
        let mask = store.alloc(pixels).ok_or(DropReason::MaskStoreFull)?;
        copy_mask(detection, whole, &mask, store);
        let was_empty = store.area(&mask) == 0;
        self.all().iter().for_each(|above| store.subtract(&mask, &above.mask));
        if store.area(&mask) > 0 {
            return Ok(mask);
        }
        store.free_last(mask);
        Err(if was_empty { DropReason::BadMask } else { DropReason::Covered })
    }

    /// Adds an instance, with its mask in an image of that width. Returns true if the table had an
    /// entry for it.
    pub fn add(&mut self, mask: MaskHandle, class: Class, score: f32, width: usize) -> bool {
        let Some(slot) = self.table.get_mut(self.len) else { return false };
        let area_px = mask.pixels.area();
        *slot = Instance {
            mask,
            score,
            class: class.code(),
            delete_permille: self.config.delete_permille(area_px, width),
            track: OptionalIndex::NONE,
            tracked_only: (!self.config.is_reconstructable(area_px, width)).into(),
        };
        self.len += 1;
        true
    }
}

/// Copies a caller's mask into the store.
fn copy_mask(
    detection: &Detection<'_>,
    whole: &PixelBox,
    mask: &MaskHandle,
    store: &mut MaskStore<'_>,
) {
    let rows = detection
        .mask
        .chunks_exact(detection.width.max(1) as usize)
        .take(detection.height as usize);
    for (v, row) in (whole.top..).zip(rows) {
        store.set_row(mask, v, whole.left, row);
    }
}
