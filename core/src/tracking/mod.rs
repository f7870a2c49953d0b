//! Objects that move or may move, from frame to frame: detected as instances, associated with
//! tracks, their motions estimated (Sections III-B and III-D of Bârsan et al., ICRA 2018).
//!
//! A frame passes through these values, each made from the one before:
//!
//! 1. `Tracker::detect` -> `Detected`: detections are validated, their masks packed, and associated
//!    with tracks, which move in the image as the matches of the scene flow say;
//! 2. `Detected::assign_matches` -> `Assigned`: each match of the scene flow is assigned to the
//!    instance it lies on; `Assigned::egomotion_mask` then tells which matches the camera's
//!    egomotion may use, and with its motion `Assigned::segment_motion` adds instances of what
//!    moves and no detector found;
//! 3. `Assigned::estimate_motions` -> `Tracked`: each track's motion, state and pose;
//!    `Tracked::mask_dynamic_depth` removes the depth under every delete mask, also where an object
//!    missed for a frame is predicted;
//! 4. `Tracked::commit`: masks are kept for the next frame.
//!
//! # Motion over ground
//!
//! Relative to an object the camera moves as well: `t_current_previous` estimated from the object's
//! matches alone maps its points from the previous camera to the current one. What remains after
//! the camera's own motion is the object's over ground, between the frames:
//!
//! `motion_world = t_world_camera(now) * t_current_previous(object) * t_world_camera(before)^-1`
//!
//! and the object's frame moves by it:
//! `t_world_object(now) = motion_world * t_world_object(before)`. For a static object both
//! `t_current_previous` agree and the motion is the identity, which it is set to once the state is
//! static. The speed is that of the object's centre: how far a motion moves the camera's position,
//! as the original takes it, grows with the distance and the slightest rotation.
//!
//! # Which matches
//!
//! Those whose current left keypoint lies under the delete mask (and under no other's copy mask)
//! and whose previous one lay in the track's previous mask: the matches refined below the pixel
//! and, where these are fewer than `matches_enough`, sparse ones of other features, which are found
//! also where few neighbours move alike, and those of guided matching (`GuidedMatching`). At least
//! `matches_min` the first time, at least `matches_again` once a motion is known. The estimator
//! removes the outliers, starting from the last motion, with random samples of its own for each
//! track and frame; the filter ([`MotionConfig`]) averages over frames.
//!
//! # Memory
//!
//! Two buffers of `mask_words` 8-byte words; the tables of instances and tracks; a byte a match;
//! 256 matches for guided matching.
//!
//! # What can go wrong
//!
//! Every error of the detector, and each is counted. A mask that covers two cars is one track and
//! gets the motion of the one with more matches.

mod association;
mod config;
mod dynamic_depth;
mod egomotion_mask;
mod guided_matching;
mod image_velocity;
mod instance_at;
mod instances;
mod match_assignment;
mod motion_estimate;
mod motion_filter;
mod motion_state;
mod motions;
mod occlusion;
mod report;
mod settings;
mod stages;
#[cfg(test)]
pub(crate) mod tests;
mod track;
mod visit;

pub use association::TrackCount;
pub(crate) use association::remove_at;
pub use config::{MotionConfig, Overlap, StateConfig, TrackingConfig};
pub(crate) use egomotion_mask::{CameraMotion, EgomotionMask};
pub(crate) use guided_matching::{GuidedMatching, expected};
pub use instance_at::InstanceAt;
pub(crate) use instances::Instance;
pub use instances::{Class, Detection, DetectionCount, InstancesConfig, MAX_DETECTIONS, Treatment};
pub(crate) use match_assignment::{FrameMatches, MatchOwner, OwnerCode};
#[cfg(test)]
pub(crate) use motion_state::MotionEvidence;
pub use motion_state::MotionState;
pub use report::{TrackReport, TrackingReport};
pub(crate) use stages::{Added, Assigned, Tracked};

pub(crate) use track::Track;

use crate::{
    masks::{MaskStore, TwoFrames},
    memory::{Capacity, Carver, Footprint, region_bytes},
    scene_flow::Match,
};
use association::TrackTable;
use guided_matching::MAX_GUIDED_MATCHES;
use image_velocity::measure_image_velocities;
use instances::Instances;
use motions::MotionInput;

/// Instances and tracks.
#[derive(Debug)]
pub(crate) struct Tracker<'s> {
    config: TrackingConfig,
    masks: TwoFrames<MaskStore<'s>>,
    instances: Instances<'s>,
    tracks: TrackTable<'s>,
    /// Owner of each refined match, and of each sparse one.
    refined_owner: &'s mut [OwnerCode],
    sparse_owner: &'s mut [OwnerCode],
    /// Matches found by guided matching on one object.
    guided_matches: &'s mut [Match],
    frame: u32,
    /// Width and height of the frame's images, px.
    size: [usize; 2],
    report: TrackingReport,
}

impl<'s> Tracker<'s> {
    /// Bytes of the slab.
    pub(crate) const fn bytes(capacity: &Capacity) -> usize {
        2 * region_bytes::<u64>(capacity.mask_words)
            + Instances::bytes(capacity)
            + TrackTable::bytes(capacity)
            + 2 * region_bytes::<OwnerCode>(capacity.matches)
            + region_bytes::<Match>(MAX_GUIDED_MATCHES)
    }

    /// Allocates its regions.
    pub(crate) fn new_in(
        capacity: &Capacity,
        config: &TrackingConfig,
        carver: &mut Carver<'s>,
    ) -> Self {
        Self {
            config: *config,
            masks: TwoFrames::new([
                MaskStore::new(carver.alloc("tracking.mask0", capacity.mask_words)),
                MaskStore::new(carver.alloc("tracking.mask1", capacity.mask_words)),
            ]),
            instances: Instances::new_in(capacity, &config.instances, carver),
            tracks: TrackTable::new_in(capacity, carver),
            refined_owner: carver.alloc("tracking.owner", capacity.matches),
            sparse_owner: carver.alloc("tracking.sparse_owner", capacity.matches),
            guided_matches: carver.alloc("tracking.guided_matches", MAX_GUIDED_MATCHES),
            frame: 0,
            size: [0; 2],
            report: TrackingReport::default(),
        }
    }

    /// Begins frame `frame` of images of that size: validates its detections and associates them
    /// with tracks.
    fn ingest(
        &mut self,
        frame: u32,
        detections: &[Detection<'_>],
        size: [usize; 2],
        matches: &FrameMatches<'_>,
    ) {
        (self.frame, self.size) = (frame, size);
        self.report = TrackingReport::default();
        let given = if self.config.dynamic { detections } else { &[] };
        self.masks.advance();
        let current = self.masks.current_mut();
        current.clear();
        self.report.detections = self.instances.ingest(given, size, current);
        measure_image_velocities(self.tracks.all_mut(), frame, matches, self.masks.previous());
        self.report.tracks =
            self.tracks.associate(&self.config, frame, self.instances.all_mut(), &self.masks);
    }

    /// Ends a frame: masks are kept for the next one.
    fn commit(&mut self) {
        self.tracks.commit(
            self.instances.all(),
            self.size,
            &mut self.masks,
            &mut self.report.tracks,
        );
    }

    /// Sets the time from the frame before to the one that comes next, s.
    pub(crate) fn set_frame_interval_s(&mut self, interval_s: f32) {
        self.config.frame_interval_s = interval_s;
    }

    /// Number of the frame.
    pub(crate) fn frame(&self) -> u32 {
        self.frame
    }

    /// The masks of this frame.
    pub(crate) fn masks(&self) -> &MaskStore<'s> {
        self.masks.current()
    }

    /// The tracks, by age, each with its instance if it was detected in this frame.
    pub(crate) fn tracks_with_instances(
        &self,
    ) -> impl Iterator<Item = (&Track, Option<&Instance>)> {
        let instance_of =
            |track: &Track| track.instance.get().and_then(|index| self.instances.all().get(index));
        self.tracks.all().iter().map(move |track| (track, instance_of(track)))
    }

    /// The track of an instance; `None` where the table of tracks was full.
    fn track_of(&self, instance: &Instance) -> Option<&Track> {
        self.tracks.all().get(instance.track.get()?)
    }

    /// Adds what is in use to a footprint.
    pub(crate) fn note_use(&self, footprint: &mut Footprint) {
        footprint.set_use::<Track>(
            "tracking.track",
            self.tracks.all().len(),
            self.tracks.all().len(),
        );
    }
}
