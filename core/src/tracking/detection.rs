//! Detections as they come in, and those of them that are taken.
//!
//! A detection is refused, and counted, when its score is not a number in 0..=1, its box is empty or beside the image, or its mask is
//! shorter than its box or empty. Of more than `capacity.detections` the lowest scores are refused. One of a class that does not move is left
//! to the static map. Where masks overlap the higher score is on top: the other loses the pixels.
//!
//! One whose box is not larger than `area_min_px` is too small to be reconstructed, and left to the static map as well; but it may be a car
//! that drives far ahead. If it is larger than `track_area_min_px` it is tracked, in what room and under what pixels the larger ones leave;
//! once it is known to move the static map is kept clear of it.
//!
//! The order in the caller's list does not matter: detections are taken by score, then class, box and mask; two alike in all of these are
//! alike. Time: linear in the pixels of the masks.

use super::{Class, InstancesConfig, Treatment};
use crate::{
    digest::Digest,
    masks::{MaskPlace, MaskStore, PixelBox, ScaledMask},
    memory::{Capacity, Carver, region_bytes},
};
use bytemuck::{Pod, Zeroable};
use heapless::Vec;

/// Most detections a capacity can ask for.
pub const MAX_DETECTIONS: usize = 64;

/// Largest side of a box, px.
const MAX_SIDE: u32 = 1 << 15;

/// Something a detector saw in the left image.
#[derive(Clone, Copy, Debug)]
pub struct Detection<'a> {
    /// What it is said to be.
    pub class: Class,
    /// How sure the detector is; 0 to 1.
    pub score: f32,
    /// First column of the box, px; may lie beside the image.
    pub left: i32,
    /// First row of the box, px; may lie beside the image.
    pub top: i32,
    /// Columns of the box, px.
    pub width: u32,
    /// Rows of the box, px.
    pub height: u32,
    /// The mask, row by row within the box; a pixel belongs to it unless it is 0.
    pub mask: &'a [u8],
}

impl Detection<'_> {
    /// Digest of all that it says.
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::default();
        digest.u64(u64::from(self.score.to_bits()) << 32 | u64::from(self.class.code()));
        digest.u64(u64::from(self.left as u32) << 32 | u64::from(self.top as u32));
        digest.u64(u64::from(self.width) << 32 | u64::from(self.height));
        digest.bytes(self.mask);
        digest.finish()
    }
}

/// What became of a frame's detections. Each detection is counted once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DetectionCount {
    /// Handed in.
    pub given: u32,
    /// Taken.
    pub taken: u32,
    /// Score not a number in 0..=1.
    pub bad_score: u32,
    /// Box empty, absurdly large or wholly beside the image.
    pub bad_box: u32,
    /// Mask shorter than its box, or without a pixel in the image.
    pub bad_mask: u32,
    /// Of a class that is left to the static map.
    pub ignored: u32,
    /// Box not larger than the least area to be reconstructed, whatever else may be wrong with its mask or the room for it.
    pub too_small: u32,
    /// How many of these are tracked.
    pub tracked_only: u32,
    /// Too many: lowest scores.
    pub beyond: u32,
    /// No room for the mask.
    pub no_room: u32,
    /// Nothing left under masks of higher score.
    pub covered: u32,
}

impl DetectionCount {
    /// Detections that could not be used although they should have been.
    pub fn refused(&self) -> u32 {
        self.bad_score + self.bad_box + self.bad_mask + self.beyond + self.no_room
    }
}

/// A detection that was taken.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Taken {
    pub place: MaskPlace,
    pub score: f32,
    pub class: u32,
    /// How much its delete mask is scaled, in 1/1000.
    pub delete_permille: u32,
    /// Position in the track table plus 1; 0 none.
    pub track: u32,
    /// Whether it is only tracked, 0 or 1.
    pub small: u32,
}

impl Taken {
    pub fn class(&self) -> Class {
        Class::from_code(self.class)
    }

    /// The mask under which nothing enters the static map.
    pub fn delete<'m, 's>(&self, store: &'m MaskStore<'s>) -> ScaledMask<'m, 's> {
        ScaledMask::new(store, self.place, self.delete_permille)
    }
}

/// A detection on its way in: what its order depends on, and where it stands in the caller's list.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    small: bool,
    score_bits: u32,
    class: Class,
    whole: PixelBox,
    digest: u64,
    index: u32,
}

impl Candidate {
    /// What may be reconstructed first, then by score downwards.
    fn rank(&self) -> (bool, u32) {
        (self.small, u32::MAX - self.score_bits)
    }

    /// Best first: by rank, then by everything else that tells two apart.
    fn key(&self) -> ((bool, u32), Class, PixelBox, u64, u32) {
        (self.rank(), self.class, self.whole, self.digest, self.index)
    }

    /// Counts it as dropped for `reason`; what is too small is that first.
    fn drop(&self, count: &mut DetectionCount, reason: fn(&mut DetectionCount) -> &mut u32) {
        *(if self.small { &mut count.too_small } else { reason(count) }) += 1;
    }
}

/// The detections of a frame.
#[derive(Debug)]
pub(super) struct Detections<'s> {
    taken: &'s mut [Taken],
    len: usize,
}

impl<'s> Detections<'s> {
    pub const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<Taken>(capacity.detections)
    }

    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self { taken: carver.alloc("instances.detection", capacity.detections), len: 0 }
    }

    pub fn all(&self) -> &[Taken] {
        self.taken.get(..self.len).unwrap_or(&[])
    }

    pub fn all_mut(&mut self) -> &mut [Taken] {
        self.taken.get_mut(..self.len).unwrap_or(&mut [])
    }

    /// Takes a frame's detections in, best first, their masks into `store`.
    pub fn admit(
        &mut self,
        config: &InstancesConfig,
        given: &[Detection<'_>],
        [width, height]: [usize; 2],
        store: &mut MaskStore<'_>,
    ) -> DetectionCount {
        self.len = 0;
        let image = PixelBox { left: 0, top: 0, width: width as i32, height: height as i32 };
        let mut count = DetectionCount { given: given.len() as u32, ..DetectionCount::default() };
        for candidate in &choose(config, given, &image, self.taken.len(), &mut count) {
            let Some(detection) = given.get(candidate.index as usize) else { continue };
            let pixels = candidate.whole.intersection(&image);
            let Some(place) = store.take(pixels) else {
                candidate.drop(&mut count, |count| &mut count.no_room);
                continue;
            };
            pack(detection, &candidate.whole, &place, store);
            let bare = store.area(&place) == 0;
            self.all().iter().for_each(|above| store.subtract(&place, &above.place));
            if store.area(&place) == 0 {
                store.undo(place);
                candidate.drop(&mut count, if bare { |count| &mut count.bad_mask } else { |count| &mut count.covered });
                continue;
            }
            if let Some(slot) = self.taken.get_mut(self.len) {
                *slot = Taken {
                    place,
                    score: f32::from_bits(candidate.score_bits),
                    class: candidate.class.code(),
                    delete_permille: config.delete_permille(pixels.area(), width),
                    track: 0,
                    small: u32::from(candidate.small),
                };
                self.len += 1;
                let [taken, too_small] = [!candidate.small, candidate.small].map(u32::from);
                count.taken += taken;
                count.too_small += too_small;
                count.tracked_only += too_small;
            }
        }
        count
    }
}

/// The best `most` of the detections that can be used, best first.
fn choose(
    config: &InstancesConfig,
    given: &[Detection<'_>],
    image: &PixelBox,
    most: usize,
    count: &mut DetectionCount,
) -> Vec<Candidate, MAX_DETECTIONS> {
    let mut best = Vec::<Candidate, MAX_DETECTIONS>::new();
    let most = most.min(MAX_DETECTIONS);
    for (index, detection) in (0..).zip(given) {
        let Some(mut candidate) = check(config, detection, index, image, count) else { continue };
        let full = best.len() >= most;
        // The digest is dear: it is made only for what may stay.
        if full && best.last().is_none_or(|worst| worst.rank() < candidate.rank()) {
            candidate.drop(count, |count| &mut count.beyond);
            continue;
        }
        let mut digest = Digest::default();
        detection.mask.get(..candidate.whole.area() as usize).into_iter().for_each(|mask| digest.bytes(mask));
        candidate.digest = digest.finish();
        let at = best.iter().position(|other| candidate.key() < other.key()).unwrap_or(best.len());
        if full {
            let stays = at < best.len();
            let worst = if stays { best.pop() } else { None };
            worst.unwrap_or(candidate).drop(count, |count| &mut count.beyond);
            if !stays {
                continue;
            }
        }
        if at <= best.len() {
            let _ = best.insert(at, candidate);
        }
    }
    best
}

/// Whether a detection can be used, and what its order depends on.
fn check(
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
    let near = |at: i32| at.unsigned_abs() <= MAX_SIDE;
    let whole = PixelBox { left, top, width: width as i32, height: height as i32 };
    if width > MAX_SIDE || height > MAX_SIDE || !near(left) || !near(top) {
        count.bad_box += 1;
        return None;
    }
    let pixels = whole.intersection(image);
    // Empty, or beside the image.
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
    let small = !config.large_enough(pixels.area(), image.width as usize);
    if small && !config.trackable(pixels.area(), image.width as usize) {
        count.too_small += 1;
        return None;
    }
    // Adding 0 turns -0 into 0: the bits of scores are then in the scores' order.
    Some(Candidate { small, score_bits: (score + 0.0).to_bits(), class, whole, digest: 0, index })
}

/// Enters a caller's mask into the store.
fn pack(detection: &Detection<'_>, whole: &PixelBox, place: &MaskPlace, store: &mut MaskStore<'_>) {
    let rows = detection.mask.chunks_exact(detection.width.max(1) as usize).take(detection.height as usize);
    for (v, row) in (whole.top..).zip(rows) {
        store.enter_row(place, v, whole.left, row);
    }
}
