//! Association: which instance of a frame continues which track.
//!
//! Every pair of an instance and a track of agreeing class gets a score: overlap (of masks, the
//! track's moved by its velocity in the image, or of boxes) times the geometric mean of the two
//! detector scores times a discount for frames missed: 1, 1/2, 1/4 (Section III-B of the paper).
//! The best pair is joined, then the best of the rest, down to `association_min`; between equals
//! the instance of higher score, then the older track comes first. Of the rest those are joined
//! that something passed in front of (`occlusion`). An instance without a track begins one.
//!
//! When the table is full the track undetected for longest is evicted, between equals the older
//! one; a track detected in the last frame or this one stays, and the new instance is refused, and
//! counted.
//!
//! Memory: [`Track`] a track and 4 bytes for each pair.

use super::{
    Overlap, Track, TracksConfig,
    occlusion::{extent_affinity, next_extent},
};
use crate::tracking::instances::{Instance, OptionalIndex};
use crate::{
    invariants::Invariants,
    masks::{MaskStore, TwoFrames},
    memory::{Capacity, Carver, region_bytes},
    slices::{clipped, clipped_mut, remove_at},
    state::Visitor,
};

/// Counts of a frame's associations of detections with tracks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TrackCount {
    /// Tracks in the table.
    pub tracks: u32,
    /// Tracks detected in this frame.
    pub detected: u32,
    /// Tracks begun.
    pub begun: u32,
    /// Tracks not detected for too long.
    pub forgotten: u32,
    /// Tracks that left a full table.
    pub evicted: u32,
    /// Detections that got no track because the table was full.
    pub refused: u32,
    /// Masks of undetected tracks that did not fit the mask store: their boxes stand for them.
    pub masks_lost: u32,
}

/// Instances of a frame that are associated with tracks.
pub(in super::super) struct AssociationInput<'i, 's> {
    /// Number of the frame.
    pub frame: u32,
    pub instances: &'i mut [Instance],
    pub masks: &'i TwoFrames<MaskStore<'s>>,
}

/// The track table, by age.
#[derive(Debug)]
pub(in super::super) struct TrackTable<'s> {
    config: TracksConfig,
    tracks: &'s mut [Track],
    len: usize,
    next_id: u32,
    scores: &'s mut [f32],
}

impl<'s> TrackTable<'s> {
    pub const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<Track>(capacity.tracks)
            + region_bytes::<f32>(capacity.tracks * capacity.detections)
    }

    pub fn new_in(capacity: &Capacity, config: &TracksConfig, carver: &mut Carver<'s>) -> Self {
        Self {
            config: *config,
            tracks: carver.alloc("tracking.track", capacity.tracks),
            len: 0,
            next_id: 1,
            scores: carver.alloc("tracking.affinity", capacity.tracks * capacity.detections),
        }
    }

    /// Says what must hold of the tracks after frame `frame`, in which there were so many
    /// instances.
    pub fn check_invariants(&self, frame: u32, instances: usize, invariants: &mut Invariants) {
        invariants.require(
            self.len <= self.tracks.len(),
            "the table has no more tracks than its capacity",
        );
        for track in self.all() {
            invariants.require(track.id != 0, "a track has a number");
            invariants
                .require(track.was_seen_until(frame), "a track was seen before it was seen last");
            invariants.require(
                track.instance.get().is_none_or(|index| index < instances),
                "a track's instance is one of this frame",
            );
        }
    }

    /// Visits all tracks. The caller tells the settings, and the scores are those of one frame.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { tracks, len, next_id, config: _, scores: _ } = self;
        visitor.count(len, tracks.len());
        visitor.u32(next_id);
        self.all_mut().iter_mut().for_each(|track| track.visit(visitor));
    }

    /// Returns true if what was read can be, `frames` frames after the first: tracks with numbers
    /// that were seen in these frames, and whose masks are in `masks`.
    pub fn can_be(&self, frames: u32, masks: &MaskStore<'_>) -> bool {
        let seen =
            |track: &Track| frames.checked_sub(1).is_some_and(|last| track.was_seen_until(last));
        let holds = |track: &Track| track.id != 0 && seen(track) && masks.holds(&track.mask);
        self.next_id != 0 && self.all().iter().all(holds)
    }

    pub fn all(&self) -> &[Track] {
        debug_assert!(self.len <= self.tracks.len());
        clipped(self.tracks, ..self.len)
    }

    pub fn all_mut(&mut self) -> &mut [Track] {
        clipped_mut(self.tracks, ..self.len)
    }

    /// Associates the instances of a frame with tracks, or begins new ones. A track keeps the mask
    /// of the frame before until [`TrackTable::commit`].
    pub fn associate(&mut self, input: &mut AssociationInput<'_, '_>) -> TrackCount {
        let mut count = TrackCount::default();
        self.forget(input.frame, &mut count);
        self.all_mut().iter_mut().for_each(|track| track.instance = OptionalIndex::NONE);
        self.associate_from(0, input, &mut count);
        count
    }

    /// Associates the instances from position `first` on with the tracks that have none yet, or
    /// begins new ones.
    pub fn associate_from(
        &mut self,
        first: usize,
        input: &mut AssociationInput<'_, '_>,
        count: &mut TrackCount,
    ) {
        // First by overlap, then what something passed in front of.
        let (config, frame, masks) = (self.config, input.frame, input.masks);
        let by_overlap =
            |instance: &Instance, track: &Track| affinity(&config, frame, instance, track, masks);
        count.detected += self.join_best(first, config.association_min, input, by_overlap);
        count.detected += self.join_best(first, 0.0, input, |instance, track| {
            extent_affinity(&config, frame, instance, track)
        });
        // The others begin tracks, as far as there is space.
        for index in first..input.instances.len() {
            let Some(instance) =
                input.instances.get(index).copied().filter(|instance| !instance.track.is_some())
            else {
                continue;
            };
            if !self.free_entry(frame, input.instances, count) {
                count.refused += 1;
                continue;
            }
            let (Some(slot), Some(begun)) =
                (self.tracks.get_mut(self.len), input.instances.get_mut(index))
            else {
                debug_assert!(false, "an entry is free");
                continue;
            };
            *slot = Track::begun(self.next_id, frame, index, &instance);
            begun.track = OptionalIndex::some(self.len);
            self.len += 1;
            self.next_id = self.next_id.wrapping_add(1).max(1);
            (count.begun, count.detected) = (count.begun + 1, count.detected + 1);
        }
        count.tracks = self.len as u32;
    }

    /// Joins the best pair, then the best of the rest, while its score is above `score_min`.
    /// Returns how many it joined.
    fn join_best(
        &mut self,
        first: usize,
        score_min: f32,
        input: &mut AssociationInput<'_, '_>,
        affinity: impl Fn(&Instance, &Track) -> f32,
    ) -> u32 {
        let mut joined = 0;
        self.score(first, input.instances, affinity);
        while let Some((instance, track)) = self.best_pair(score_min, input.instances.len()) {
            self.join(instance, track, input.instances, input.frame);
            joined += 1;
        }
        joined
    }

    /// Fills the table of scores, a row for each instance; 0 where either is associated already.
    fn score(
        &mut self,
        first: usize,
        instances: &[Instance],
        affinity: impl Fn(&Instance, &Track) -> f32,
    ) {
        let tracks = clipped(self.tracks, ..self.len);
        let rows =
            self.scores.chunks_exact_mut(self.tracks.len().max(1)).zip(instances).enumerate();
        for (at, (row, instance)) in rows {
            for (score, track) in row.iter_mut().zip(tracks) {
                let is_free = at >= first && !instance.track.is_some() && !track.instance.is_some();
                *score = if is_free { affinity(instance, track) } else { 0.0 };
            }
        }
    }

    /// The best pair left, by position of the instance and of the track.
    fn best_pair(&self, score_min: f32, instances: usize) -> Option<(usize, usize)> {
        let mut best = (score_min, None);
        for (d, row) in
            self.scores.chunks_exact(self.tracks.len().max(1)).take(instances).enumerate()
        {
            for (t, &score) in row.iter().take(self.len).enumerate() {
                if score > best.0 {
                    best = (score, Some((d, t)));
                }
            }
        }
        best.1
    }

    fn join(&mut self, d: usize, t: usize, instances: &mut [Instance], frame: u32) {
        let width = self.tracks.len().max(1);
        for (row_index, row) in
            self.scores.chunks_exact_mut(width.max(1)).take(instances.len()).enumerate()
        {
            if row_index == d {
                row.fill(0.0);
            } else if let Some(score) = row.get_mut(t) {
                *score = 0.0;
            }
        }
        let (Some(instance), Some(track)) = (instances.get_mut(d), self.tracks.get_mut(t)) else {
            debug_assert!(false, "the pair is in both tables");
            return;
        };
        instance.track = OptionalIndex::some(t);
        track.continue_with(frame, d, instance);
    }

    /// Drops tracks not detected for too long.
    fn forget(&mut self, frame: u32, count: &mut TrackCount) {
        let mut kept = 0;
        for index in 0..self.len {
            let Some(track) = self.tracks.get(index).copied() else { break };
            if frame.wrapping_sub(track.last_frame) > u32::from(self.config.forget_frames) {
                count.forgotten += 1;
            } else if let Some(slot) = self.tracks.get_mut(kept) {
                *slot = track;
                kept += 1;
            }
        }
        self.len = kept;
    }

    /// Returns the index of a free entry for another track, if need be that of the track undetected
    /// for longest.
    fn free_entry(
        &mut self,
        frame: u32,
        instances: &mut [Instance],
        count: &mut TrackCount,
    ) -> bool {
        if self.len < self.tracks.len() {
            return true;
        }
        let undetected = self
            .all()
            .iter()
            .enumerate()
            .filter(|(_, track)| frame.wrapping_sub(track.last_frame) > 1);
        let Some((oldest, _)) = undetected
            .max_by_key(|&(at, track)| (frame.wrapping_sub(track.last_frame), usize::MAX - at))
        else {
            return false;
        };
        remove_at(self.tracks.get_mut(..self.len).unwrap_or_default(), oldest);
        self.len -= 1;
        // The tracks behind it moved up.
        for instance in instances.iter_mut() {
            if let Some(at) = instance.track.get().filter(|&at| at > oldest) {
                instance.track = OptionalIndex::some(at - 1);
            }
        }
        count.evicted += 1;
        true
    }

    /// Ends a frame: detected tracks take over their instance's mask, the masks of the others move
    /// to this frame's store.
    pub fn commit(
        &mut self,
        instances: &[Instance],
        size: [usize; 2],
        masks: &mut TwoFrames<MaskStore<'_>>,
        count: &mut TrackCount,
    ) {
        let (current, previous) = masks.split_mut();
        for track in self.all_mut() {
            let instance = track.instance.get().and_then(|index| instances.get(index));
            track.extent = next_extent(track, instance.map(|instance| instance.mask.pixels), size);
            if let Some(instance) = instance {
                track.mask = instance.mask;
            } else {
                let (mask, is_whole) = current.copy(track.mask, previous);
                track.mask = mask;
                count.masks_lost += u32::from(!is_whole);
            }
        }
    }
}

/// Returns the affinity of an instance to a track; 0 if it does not continue it.
fn affinity(
    config: &TracksConfig,
    frame: u32,
    instance: &Instance,
    track: &Track,
    masks: &TwoFrames<MaskStore<'_>>,
) -> f32 {
    if !instance.class().agrees_with(track.class()) {
        return 0.0;
    }
    let gap = frame.wrapping_sub(track.last_frame);
    let discount = match gap {
        0 | 1 => 1.0,
        2 => 0.5,
        _ => 0.25,
    };
    let overlap = match config.overlap {
        Overlap::Mask => masks.current().overlap(
            &instance.mask,
            masks.previous(),
            &track.mask,
            track.predicted_shift_px(gap),
        ),
        Overlap::Box => instance.mask.pixels.overlap(&track.mask.pixels),
    };
    overlap * libm::sqrtf(instance.score * track.score) * discount
}
