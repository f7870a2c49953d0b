//! What moves, or could: seen in masks, tracked, followed and reconstructed apart from the street (Sections III-B, III-D, III-E of Bârsan et
//! al., ICRA 2018).
//!
//! A frame goes through in this order, one method each:
//!
//! 1. [`Tracker::admit`]: detections are checked, their masks packed ([`Detection`]) and joined to tracks;
//! 2. [`Tracker::claim`]: each match of the scene flow is given to the detection it lies on; [`Tracker::guides_camera`] then tells the
//!    camera's egomotion which to listen to: none on a dynamic object, none on a large one of unknown state, for that one may be most of
//!    what there is to see; of others RANSAC decides;
//! 3. [`Tracker::follow`]: each track's motion, state and pose;
//! 4. [`Tracker::clear`]: the static map's depth is 0 under every delete mask, tracked or not, and where a thing missed for a frame would be;
//! 5. [`Tracker::settle`]: masks are kept for the next frame.
//!
//! # Motion over ground
//!
//! Seen from an object the camera moves as well: `t_current_previous` estimated from the object's matches alone carries its points from the
//! previous camera to the current one. What remains after the camera's own motion is the object's over ground, between the frames:
//!
//! `motion_world = t_world_camera(now) * t_current_previous(object) * t_world_camera(before)^-1`
//!
//! and the object's frame moves by it: `t_world_object(now) = motion_world * t_world_object(before)`. Of a standing object both
//! `t_current_previous` agree and the motion is the identity; it then follows the camera, and is held there once its state is static.
//! The speed is that of the object's middle: how far a motion moves the camera's place, as the original takes it, grows with the distance and
//! the slightest turn.
//!
//! # Which matches
//!
//! Those whose current left keypoint lies under the delete mask (and under no other's copy mask) and whose previous one lay in the track's
//! previous mask: the matches refined below the pixel and, where these are fewer than `matches_enough`, sparse ones of other features, which
//! are found also where few neighbours move alike, and those that a closer look finds where the thing must be ([`Seen::images`]). At least
//! `matches_min` the first time, at least `matches_again` once there is a motion to go by. The estimator sorts out the outliers, beginning at the
//! motion so far, with draws of its own for each track and frame; the filter ([`MotionConfig`]) takes the rest in.
//!
//! # Memory
//!
//! Two buffers of `mask_words` 8-byte words; the tables of detections and tracks; a byte a match; 256 matches for a closer look.
//!
//! # What can go wrong
//!
//! Everything the detector gets wrong, and all of it is counted. A mask that holds two cars is one track and gets the motion of the one with
//! more matches.

mod at;
mod background;
mod camera;
mod claim;
mod class;
mod config;
mod detection;
mod filter;
mod follow;
mod look;
mod measure;
pub(crate) mod pose;
mod report;
mod state;
#[cfg(test)]
pub(crate) mod tests;
mod track;
mod visit;

pub use at::ThingAt;
pub use camera::CameraMotion;
pub use class::{Class, Treatment};
pub use config::{InstancesConfig, MotionConfig, ObjectVolumeConfig, Overlap, StateConfig};
pub use detection::{Detection, DetectionCount, MAX_DETECTIONS};
pub use look::Seen;
pub use report::{TrackReport, TrackingReport};
pub use state::{Evidence, State};
pub use track::TrackCount;

pub(crate) use detection::Taken;
pub(crate) use track::Track;

use crate::{
    masks::MaskStore,
    memory::{Capacity, Carver, Footprint, region_bytes},
    scene_flow::Match,
};
use detection::Detections;
use track::{Masks, Tracks};

/// Detections and tracks.
#[derive(Debug)]
pub struct Tracker<'s> {
    config: InstancesConfig,
    masks: [MaskStore<'s>; 2],
    /// Which of the two is this frame's.
    now: usize,
    detections: Detections<'s>,
    tracks: Tracks<'s>,
    /// For each refined match the position of the detection it lies on, plus 1; and for each sparse one.
    owner: &'s mut [u8],
    sparse_owner: &'s mut [u8],
    /// Matches found by a closer look at one thing.
    looked: &'s mut [Match],
    frame: u32,
    report: TrackingReport,
}

impl<'s> Tracker<'s> {
    /// Bytes of the slab.
    pub const fn bytes(capacity: &Capacity) -> usize {
        2 * region_bytes::<u64>(capacity.mask_words)
            + Detections::bytes(capacity)
            + Tracks::bytes(capacity)
            + region_bytes::<u8>(capacity.matches)
            + region_bytes::<u8>(capacity.matches)
            + region_bytes::<Match>(look::LOOKS)
    }

    /// Cuts its regions.
    pub fn new_in(capacity: &Capacity, config: &InstancesConfig, carver: &mut Carver<'s>) -> Self {
        Self {
            config: *config,
            masks: [
                MaskStore::new(carver.alloc("instances.mask0", capacity.mask_words)),
                MaskStore::new(carver.alloc("instances.mask1", capacity.mask_words)),
            ],
            now: 0,
            detections: Detections::new_in(capacity, carver),
            tracks: Tracks::new_in(capacity, carver),
            owner: carver.alloc("instances.owner", capacity.matches),
            sparse_owner: carver.alloc("instances.sparse_owner", capacity.matches),
            looked: carver.alloc("instances.looked", look::LOOKS),
            frame: 0,
            report: TrackingReport::default(),
        }
    }

    pub(crate) fn masks_now(&self) -> &MaskStore<'s> {
        let [a, b] = &self.masks;
        if self.now == 0 { a } else { b }
    }

    /// Begins frame `frame` of an image of that size: takes its detections in and joins them to tracks.
    pub fn admit(&mut self, frame: u32, detections: &[Detection<'_>], size: [usize; 2]) {
        self.frame = frame;
        self.report = TrackingReport::default();
        let given = if self.config.dynamic { detections } else { &[] };
        let [a, b] = &mut self.masks;
        self.now = 1 - self.now;
        let (now, before) = if self.now == 0 { (a, b) } else { (b, a) };
        now.clear();
        self.report.detections = self.detections.admit(&self.config, given, size, now);
        let masks = Masks { now, before };
        self.report.tracks = self.tracks.associate(&self.config, frame, self.detections.all_mut(), &masks);
    }

    /// Number of the frame last admitted.
    pub(crate) fn frame(&self) -> u32 {
        self.frame
    }

    /// The detections taken in this frame.
    pub(crate) fn detections(&self) -> &[Taken] {
        self.detections.all()
    }

    /// The tracks, by age.
    pub(crate) fn all(&self) -> &[Track] {
        self.tracks.all()
    }

    /// Ends a frame: tracks seen take over their detection's mask, the others' masks move to this frame's buffer.
    pub fn settle(&mut self) {
        let [a, b] = &mut self.masks;
        let (now, before) = if self.now == 0 { (a, b) } else { (b, a) };
        self.tracks.settle(self.detections.all(), now, before, &mut self.report.tracks);
    }

    /// Enters what is in use into a footprint.
    pub fn note_use(&self, footprint: &mut Footprint) {
        footprint.set_use::<Track>("instances.track", self.tracks.all().len(), self.tracks.all().len());
    }
}
