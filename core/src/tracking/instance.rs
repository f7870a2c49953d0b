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

use super::{
    Class, Detection, DetectionCount, MAX_DETECTIONS, TrackingConfig, Treatment,
    index::{Flag, OptionalIndex},
};
use crate::{
    digest::Digest,
    masks::{MaskHandle, MaskStore, PixelBox, ScaledMask},
    memory::{Capacity, Carver, region_bytes},
    slices::{clipped, clipped_mut},
};
use bytemuck::{Pod, Zeroable};
use heapless::Vec;

/// Largest side of a box, px.
const MAX_SIDE: u32 = 1 << 15;

/// A detection that was accepted.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Instance {
    /// Copy mask: the pixels that show the instance.
    pub mask: MaskHandle,
    pub score: f32,
    pub class: u32,
    /// Scale of the delete mask, in 1/1000.
    pub delete_permille: u32,
    /// Position of its track.
    pub track: OptionalIndex,
    /// Set if the instance is tracked, but too small to be reconstructed.
    pub tracked_only: Flag,
}

impl Instance {
    pub fn class(&self) -> Class {
        Class::from_code(self.class)
    }

    /// The mask under which nothing enters the static map.
    pub fn delete_mask<'m, 's>(&self, store: &'m MaskStore<'s>) -> ScaledMask<'m, 's> {
        ScaledMask::new(store, self.mask, self.delete_permille)
    }
}

/// A detection that can be used: what its order depends on, and its position in the caller's list.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    tracked_only: bool,
    score_bits: u32,
    class: Class,
    whole: PixelBox,
    digest: u64,
    index: u32,
}

impl Candidate {
    /// Returns the order of instances: those that may be reconstructed first, then by score
    /// downwards.
    fn rank(&self) -> (bool, u32) {
        (self.tracked_only, u32::MAX - self.score_bits)
    }

    /// Best first: by rank, then by everything else that tells two apart.
    fn key(&self) -> ((bool, u32), Class, PixelBox, u64, u32) {
        (self.rank(), self.class, self.whole, self.digest, self.index)
    }

    /// Counts it as dropped for `reason`, or as too small if it is.
    fn drop(&self, count: &mut DetectionCount, reason: fn(&mut DetectionCount) -> &mut u32) {
        *(if self.tracked_only { &mut count.too_small } else { reason(count) }) += 1;
    }
}

/// The instances of a frame, best first.
#[derive(Debug)]
pub(super) struct Instances<'s> {
    table: &'s mut [Instance],
    len: usize,
}

impl<'s> Instances<'s> {
    pub const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<Instance>(capacity.detections)
    }

    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self { table: carver.alloc("tracking.instance", capacity.detections), len: 0 }
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
        config: &TrackingConfig,
        given: &[Detection<'_>],
        [width, height]: [usize; 2],
        store: &mut MaskStore<'_>,
    ) -> DetectionCount {
        self.len = 0;
        let image = PixelBox { left: 0, top: 0, width: width as i32, height: height as i32 };
        let mut count = DetectionCount { given: given.len() as u32, ..DetectionCount::default() };
        for candidate in &select_best(config, given, &image, self.table.len(), &mut count) {
            let Some(detection) = given.get(candidate.index as usize) else { continue };
            let pixels = candidate.whole.intersection(&image);
            let Some(mask) = store.alloc(pixels) else {
                candidate.drop(&mut count, |count| &mut count.mask_store_full);
                continue;
            };
            copy_mask(detection, &candidate.whole, &mask, store);
            let was_empty = store.area(&mask) == 0;
            self.all().iter().for_each(|above| store.subtract(&mask, &above.mask));
            if store.area(&mask) == 0 {
                store.free_last(mask);
                candidate.drop(
                    &mut count,
                    if was_empty {
                        |count| &mut count.bad_mask
                    } else {
                        |count| &mut count.covered
                    },
                );
                continue;
            }
            if let Some(slot) = self.table.get_mut(self.len) {
                *slot = Instance {
                    mask,
                    score: f32::from_bits(candidate.score_bits),
                    class: candidate.class.code(),
                    delete_permille: config.delete_permille(pixels.area(), width),
                    track: OptionalIndex::NONE,
                    tracked_only: candidate.tracked_only.into(),
                };
                self.len += 1;
                let [accepted, too_small] =
                    [!candidate.tracked_only, candidate.tracked_only].map(u32::from);
                count.accepted += accepted;
                count.too_small += too_small;
                count.tracked_only += too_small;
            }
        }
        count
    }
}

impl Instances<'_> {
    /// Adds an instance that was not detected, with its mask. Whether the table had an entry for
    /// it.
    pub fn add(
        &mut self,
        config: &TrackingConfig,
        mask: MaskHandle,
        class: Class,
        score: f32,
        width: usize,
    ) -> bool {
        let Some(slot) = self.table.get_mut(self.len) else { return false };
        let area_px = mask.pixels.area();
        *slot = Instance {
            mask,
            score,
            class: class.code(),
            delete_permille: config.delete_permille(area_px, width),
            track: OptionalIndex::NONE,
            tracked_only: (!config.is_reconstructable(area_px, width)).into(),
        };
        self.len += 1;
        true
    }
}

/// The best `most` of the detections that can be used, best first.
fn select_best(
    config: &TrackingConfig,
    given: &[Detection<'_>],
    image: &PixelBox,
    most: usize,
    count: &mut DetectionCount,
) -> Vec<Candidate, MAX_DETECTIONS> {
    let mut best = Vec::<Candidate, MAX_DETECTIONS>::new();
    let most = most.min(MAX_DETECTIONS);
    for (index, detection) in (0..).zip(given) {
        let Some(mut candidate) = validate(config, detection, index, image, count) else {
            continue;
        };
        let full = best.len() >= most;
        // The digest is expensive: it is computed only for what may stay.
        if full && best.last().is_none_or(|worst| worst.rank() < candidate.rank()) {
            candidate.drop(count, |count| &mut count.over_capacity);
            continue;
        }
        let mut digest = Digest::default();
        detection
            .mask
            .get(..candidate.whole.area() as usize)
            .into_iter()
            .for_each(|mask| digest.bytes(mask));
        candidate.digest = digest.finish();
        let at = best.iter().position(|other| candidate.key() < other.key()).unwrap_or(best.len());
        if full {
            let is_better = at < best.len();
            let worst = if is_better { best.pop() } else { None };
            worst.unwrap_or(candidate).drop(count, |count| &mut count.over_capacity);
            if !is_better {
                continue;
            }
        }
        // The condition is for the compiler, which does not see it.
        let inserted = at <= best.len() && best.insert(at, candidate).is_ok();
        debug_assert!(inserted, "at most {most} candidates stay");
    }
    best
}

/// Checks whether a detection can be used, and returns the values that its order depends on.
fn validate(
    config: &TrackingConfig,
    detection: &Detection<'_>,
    index: u32,
    image: &PixelBox,
    count: &mut DetectionCount,
) -> Option<Candidate> {
    let &Detection { class, score, left, top, width, height, mask } = detection;
    // False for NaN.
    if !(0.0..=1.0).contains(&score) {
        count.bad_score += 1;
        return None;
    }
    let is_in_range = |at: i32| at.unsigned_abs() <= MAX_SIDE;
    let whole = PixelBox { left, top, width: width as i32, height: height as i32 };
    if width > MAX_SIDE || height > MAX_SIDE || !is_in_range(left) || !is_in_range(top) {
        count.bad_box += 1;
        return None;
    }
    let pixels = whole.intersection(image);
    // Empty, or outside the image.
    if pixels.area() == 0 {
        count.bad_box += 1;
        return None;
    }
    if (mask.len() as u64) < u64::from(width) * u64::from(height) {
        count.bad_mask += 1;
        return None;
    }
    if class.treatment() == Treatment::Ignore || score < config.score_min {
        count.ignored += 1;
        return None;
    }
    let tracked_only = !config.is_reconstructable(pixels.area(), image.width as usize);
    if tracked_only && !config.is_trackable(pixels.area(), image.width as usize) {
        count.too_small += 1;
        return None;
    }
    // Adding 0 turns -0 into 0: the order of the bits is then that of the scores.
    Some(Candidate {
        tracked_only,
        score_bits: (score + 0.0).to_bits(),
        class,
        whole,
        digest: 0,
        index,
    })
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
