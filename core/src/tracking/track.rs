//! Tracks: what was seen in one frame and seen again in the next.
//!
//! Every pair of a detection and a track of agreeing class gets a score: overlap (of masks, the track's moved by what its box moved last,
//! or of boxes) times the geometric mean of the two detector scores times a discount for frames missed: 1, 1/2, 1/4 (Section III-B of the
//! paper). The best pair is joined, then the best of what is left, down to `association_min`; of equals the detection of higher
//! score, then the older track comes first. A detection left over begins a track.
//!
//! When the table is full the track unseen for longest goes, of equals the older one; one seen in the last frame or this one stays, and the
//! new detection is refused, and counted.
//!
//! Memory: [`Track`] a track and 4 bytes for each pair.

use super::{Class, InstancesConfig, State, config::Overlap, detection::Taken, filter::Filter, state::Judgement};
use crate::masks::{MaskPlace, MaskStore};
use crate::memory::{Capacity, Carver, region_bytes};
use crate::state::Visitor;
use bytemuck::{Pod, Zeroable};

/// A thing seen over time. Transforms are [x, y, z, w of the rotation, x, y, z of the translation].
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Track {
    /// Over ground.
    pub filter: Filter,
    /// Where the object's frame lies now; that of the chain's beginning is the camera then.
    pub t_world_object: [f64; 7],
    /// The same at the beginning of the chain.
    pub t_world_origin: [f64; 7],
    /// The mask seen last.
    pub place: MaskPlace,
    /// Movement of the box's middle between the last two sightings, px a frame.
    pub drift: [i32; 2],
    pub judgement: Judgement,
    pub id: u32,
    pub class: u32,
    /// By how many sightings the class leads over others.
    pub class_lead: u32,
    /// Score seen last.
    pub score: f32,
    pub first_frame: u32,
    pub last_frame: u32,
    /// Frames seen.
    pub sightings: u32,
    /// Position of this frame's detection plus 1; 0 when it is not seen.
    pub detection: u32,
    /// Poses in the chain; 0 when it is broken.
    pub chain: u32,
    /// How many chains there were.
    pub chains: u32,
    /// Matches on it in this frame, and of these explained by its motion.
    pub matches: u32,
    pub inliers: u32,
    /// Whether this frame's motion was measured.
    pub measured: u32,
    /// Error of the speed, m/s.
    pub sigma_m_s: f32,
    /// Whether what was seen last is too small to be reconstructed, 0 or 1.
    pub small: u32,
    /// Unused.
    pub padding: u32,
}

impl Track {
    pub fn class(&self) -> Class {
        Class::from_code(self.class)
    }

    /// Visits every field.
    fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self {
            filter,
            t_world_object,
            t_world_origin,
            place,
            drift,
            judgement,
            id,
            class,
            class_lead,
            score,
            first_frame,
            last_frame,
            sightings,
            detection,
            chain,
            chains,
            matches,
            inliers,
            measured,
            sigma_m_s,
            small,
            padding: _,
        } = self;
        filter.visit(visitor);
        visitor.f64s(t_world_object);
        visitor.f64s(t_world_origin);
        place.visit(visitor);
        visitor.i32s(drift);
        judgement.visit(visitor);
        visitor.f32(score);
        visitor.f32(sigma_m_s);
        visitor.u32s([id, class, class_lead, first_frame, last_frame, sightings]);
        visitor.u32s([detection, chain, chains, matches, inliers, measured, small]);
    }

    /// Whether it is nothing yet: too small to be reconstructed, and no motion was ever measured.
    pub fn is_tentative(&self) -> bool {
        self.small == 1 && !self.filter.is_known()
    }

    /// How far its mask moved since it was last seen, `gap` frames ago, if it went on as it did, px.
    pub fn drifted(&self, gap: u32) -> [i32; 2] {
        let frames = gap.min(4) as i32;
        self.drift.map(|px| px.clamp(-4096, 4096) * frames)
    }

    /// Whether it is known to move.
    pub fn moves(&self) -> bool {
        self.judgement.state() == State::Dynamic
    }

    /// Majority by counting (Boyer, Moore): the class that leads holds until others were seen more often.
    fn hear(&mut self, class: u32) {
        if class == self.class {
            self.class_lead += 1;
        } else if self.class_lead > 1 {
            self.class_lead -= 1;
        } else {
            (self.class, self.class_lead) = (class, 1);
        }
    }
}

/// What became of detections and tracks in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TrackCount {
    /// Tracks there are.
    pub tracks: u32,
    /// Tracks seen in this frame.
    pub seen: u32,
    /// Tracks begun.
    pub begun: u32,
    /// Tracks not seen for too long.
    pub forgotten: u32,
    /// Tracks that left a full table.
    pub evicted: u32,
    /// Detections for which there was no room in the table.
    pub refused: u32,
    /// Masks of unseen tracks for which there was no room: their boxes stand for them.
    pub masks_lost: u32,
}

/// The track table, by age.
#[derive(Debug)]
pub(super) struct Tracks<'s> {
    tracks: &'s mut [Track],
    len: usize,
    next_id: u32,
    scores: &'s mut [f32],
}

/// The two mask buffers: this frame's and the last one's.
pub(crate) struct Masks<'m, 's> {
    pub now: &'m MaskStore<'s>,
    pub before: &'m MaskStore<'s>,
}

impl<'s> Tracks<'s> {
    pub const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<Track>(capacity.tracks) + region_bytes::<f32>(capacity.tracks * capacity.detections)
    }

    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self {
            tracks: carver.alloc("instances.track", capacity.tracks),
            len: 0,
            next_id: 1,
            scores: carver.alloc("instances.affinity", capacity.tracks * capacity.detections),
        }
    }

    /// Visits all tracks. The scores are those of one frame.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { tracks, len, next_id, scores: _ } = self;
        visitor.count(len, tracks.len());
        visitor.u32(next_id);
        self.all_mut().iter_mut().for_each(|track| track.visit(visitor));
    }

    pub fn all(&self) -> &[Track] {
        self.tracks.get(..self.len).unwrap_or(&[])
    }

    pub fn all_mut(&mut self) -> &mut [Track] {
        self.tracks.get_mut(..self.len).unwrap_or(&mut [])
    }

    /// Joins the detections of frame `frame` to tracks, or begins new ones. A track joined keeps the mask it had before in `place` until
    /// [`Tracks::settle`].
    pub fn associate(&mut self, config: &InstancesConfig, frame: u32, detections: &mut [Taken], masks: &Masks<'_, '_>) -> TrackCount {
        let mut count = TrackCount::default();
        self.forget(config, frame, &mut count);
        self.all_mut().iter_mut().for_each(|track| track.detection = 0);
        self.score(config, frame, detections, masks);
        while let Some((detection, track)) = self.best_pair(config, detections.len()) {
            self.join(detection, track, detections, frame);
            count.seen += 1;
        }
        for index in 0..detections.len() {
            let Some(detection) = detections.get(index).filter(|detection| detection.track == 0) else { continue };
            let begun = Track {
                place: detection.place,
                id: self.next_id,
                class: detection.class,
                class_lead: 1,
                score: detection.score,
                first_frame: frame,
                last_frame: frame,
                sightings: 1,
                detection: index as u32 + 1,
                small: detection.small,
                ..Track::default()
            };
            if !self.make_room(frame, detections, &mut count) {
                count.refused += 1;
                continue;
            }
            if let (Some(slot), Some(detection)) = (self.tracks.get_mut(self.len), detections.get_mut(index)) {
                *slot = begun;
                self.len += 1;
                self.next_id = self.next_id.wrapping_add(1);
                detection.track = self.len as u32;
                (count.begun, count.seen) = (count.begun + 1, count.seen + 1);
            }
        }
        count.tracks = self.len as u32;
        count
    }

    /// Fills the table of scores, a row for each detection.
    fn score(&mut self, config: &InstancesConfig, frame: u32, detections: &[Taken], masks: &Masks<'_, '_>) {
        let tracks = self.tracks.get(..self.len).unwrap_or(&[]);
        for (row, detection) in self.scores.chunks_exact_mut(self.tracks.len().max(1)).zip(detections) {
            for (score, track) in row.iter_mut().zip(tracks) {
                *score = affinity(config, frame, detection, track, masks);
            }
        }
    }

    /// The best pair left, by position of the detection and of the track.
    fn best_pair(&self, config: &InstancesConfig, detections: usize) -> Option<(usize, usize)> {
        let mut best = (config.association_min, None);
        for (d, row) in self.scores.chunks_exact(self.tracks.len().max(1)).take(detections).enumerate() {
            for (t, &score) in row.iter().take(self.len).enumerate() {
                if score > best.0 {
                    best = (score, Some((d, t)));
                }
            }
        }
        best.1
    }

    fn join(&mut self, d: usize, t: usize, detections: &mut [Taken], frame: u32) {
        let width = self.tracks.len().max(1);
        for (row_index, row) in self.scores.chunks_exact_mut(width.max(1)).take(detections.len()).enumerate() {
            if row_index == d {
                row.fill(0.0);
            } else if let Some(score) = row.get_mut(t) {
                *score = 0.0;
            }
        }
        let (Some(detection), Some(track)) = (detections.get_mut(d), self.tracks.get_mut(t)) else { return };
        detection.track = t as u32 + 1;
        let gap = frame.wrapping_sub(track.last_frame).clamp(1, 1 << 16) as i32;
        let middle = |place: &MaskPlace| [2 * place.pixels.left + place.pixels.width, 2 * place.pixels.top + place.pixels.height];
        let ([u, v], [u_before, v_before]) = (middle(&detection.place), middle(&track.place));
        track.drift = [(u - u_before) / (2 * gap), (v - v_before) / (2 * gap)];
        track.hear(detection.class);
        track.score = detection.score;
        track.last_frame = frame;
        track.sightings += 1;
        track.detection = d as u32 + 1;
        track.small = detection.small;
    }

    /// Drops tracks not seen for too long.
    fn forget(&mut self, config: &InstancesConfig, frame: u32, count: &mut TrackCount) {
        let mut kept = 0;
        for index in 0..self.len {
            let Some(track) = self.tracks.get(index).copied() else { break };
            if frame.wrapping_sub(track.last_frame) > u32::from(config.forget_frames) {
                count.forgotten += 1;
            } else if let Some(slot) = self.tracks.get_mut(kept) {
                *slot = track;
                kept += 1;
            }
        }
        self.len = kept;
    }

    /// Whether there is room for another track, if need be in place of the one unseen for longest.
    fn make_room(&mut self, frame: u32, detections: &mut [Taken], count: &mut TrackCount) -> bool {
        if self.len < self.tracks.len() {
            return true;
        }
        let unseen = self.all().iter().enumerate().filter(|(_, track)| frame.wrapping_sub(track.last_frame) > 1);
        let Some((oldest, _)) = unseen.max_by_key(|&(at, track)| (frame.wrapping_sub(track.last_frame), usize::MAX - at)) else {
            return false;
        };
        let Some(from_oldest) = self.tracks.get_mut(oldest..self.len) else { return false };
        let Some(mut moved) = from_oldest.last().copied() else { return false };
        from_oldest.iter_mut().rev().for_each(|place| core::mem::swap(place, &mut moved));
        self.len -= 1;
        // Those behind it moved up.
        for detection in detections.iter_mut().filter(|detection| detection.track as usize > oldest + 1) {
            detection.track -= 1;
        }
        count.evicted += 1;
        true
    }

    /// Ends a frame: tracks seen take over their detection's mask, the others' masks move to this frame's buffer.
    pub fn settle(&mut self, detections: &[Taken], now: &mut MaskStore<'_>, before: &MaskStore<'_>, count: &mut TrackCount) {
        for track in self.all_mut() {
            if let Some(seen) = track.detection.checked_sub(1).and_then(|index| detections.get(index as usize)) {
                track.place = seen.place;
            } else {
                let (place, whole) = now.copy(track.place, before);
                track.place = place;
                count.masks_lost += u32::from(!whole);
            }
        }
    }
}

/// How well a detection continues a track; 0 where it does not.
fn affinity(config: &InstancesConfig, frame: u32, detection: &Taken, track: &Track, masks: &Masks<'_, '_>) -> f32 {
    if !detection.class().agrees_with(track.class()) {
        return 0.0;
    }
    let gap = frame.wrapping_sub(track.last_frame);
    let discount = match gap {
        0 | 1 => 1.0,
        2 => 0.5,
        _ => 0.25,
    };
    let overlap = match config.overlap {
        Overlap::Mask => masks.now.overlap(&detection.place, masks.before, &track.place, track.drifted(gap)),
        Overlap::Box => detection.place.pixels.overlap(&track.place.pixels),
    };
    overlap * libm::sqrtf(detection.score * track.score) * discount
}
