//! Selection: which of a frame's detections can be used, and the best of them.

use super::{Class, Detection, DetectionCount, InstancesConfig, MAX_DETECTIONS, Treatment};
use crate::{
    digest::Digest,
    masks::{MAX_SIDE, PixelBox},
};
use heapless::Vec;

/// Reason why a detection that can be used is not.
// No function that borrows the count: a call through a pointer would defy the proofs of firmware.
#[derive(Clone, Copy, Debug)]
pub(super) enum DropReason {
    OverCapacity,
    MaskStoreFull,
    BadMask,
    Covered,
}

impl DropReason {
    /// The count of detections dropped for it.
    fn counted(self, count: &mut DetectionCount) -> &mut u32 {
        match self {
            Self::OverCapacity => &mut count.over_capacity,
            Self::MaskStoreFull => &mut count.mask_store_full,
            Self::BadMask => &mut count.bad_mask,
            Self::Covered => &mut count.covered,
        }
    }
}

/// A detection that can be used: what its order depends on, and its position in the caller's list.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub tracked_only: bool,
    pub score_bits: u32,
    pub class: Class,
    pub whole: PixelBox,
    digest: u64,
    pub index: u32,
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
    pub fn drop(&self, count: &mut DetectionCount, reason: DropReason) {
        *(if self.tracked_only { &mut count.too_small } else { reason.counted(count) }) += 1;
    }
}

/// The best `most` of the detections that can be used, best first.
pub(super) fn select_best(
    config: &InstancesConfig,
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
            candidate.drop(count, DropReason::OverCapacity);
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
            worst.unwrap_or(candidate).drop(count, DropReason::OverCapacity);
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
    config: &InstancesConfig,
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
