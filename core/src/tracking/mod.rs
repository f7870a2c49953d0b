//! Objects that move or may move, from frame to frame: detected as instances, associated with
//! tracks, their motions estimated (Sections III-B and III-D of Bârsan et al., ICRA 2018).
//!
//! A tracker is made of parts, and each one uses only those above it:
//!
//! | part | what it holds | settings |
//! |---|---|---|
//! | `instances` | the detections of a frame that were accepted | `tracking.instances.*` |
//! | `matches` | the instance of each match of the scene flow | `tracking.matches.*` |
//! | `motion` | motion and motion state of one object | `tracking.{motion, state}.*` |
//! | `tracks` | the objects over time, by instances, matches and motion | `tracking.tracks.*` |
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
//! # Memory
//!
//! Two buffers of `mask_words` 8-byte words; the tables of instances and tracks; a byte a match;
//! 256 matches for guided matching.
//!
//! # What can go wrong
//!
//! Every error of the detector, and each is counted. A mask that covers two cars is one track and
//! gets the motion of the one with more matches.

mod config;
mod instances;
mod matches;
mod motion;
mod report;
mod settings;
mod stages;
#[cfg(test)]
pub(crate) mod tests;
mod tracks;

pub use config::TrackingConfig;
pub(crate) use instances::Instance;
pub use instances::{Class, Detection, DetectionCount, InstancesConfig, MAX_DETECTIONS, Treatment};
pub use matches::MatchesConfig;
pub(crate) use matches::{
    EgomotionMask, FrameMatches, GuidedMatching, MatchOwner, OwnerCode, expected,
};
pub use motion::{CameraMotion, MotionConfig, MotionState, StateConfig};
pub use report::{TrackReport, TrackingReport};
pub(crate) use stages::{Added, Assigned, Detected, Tracked};
pub(crate) use tracks::Track;
pub use tracks::{InstanceAt, Overlap, TrackCount, TracksConfig};

use crate::{
    egomotion::Estimator,
    image::ViewMut,
    invariants::Invariants,
    masks::{MaskStore, TwoFrames},
    memory::{Capacity, Carver, Footprint, region_bytes},
    scene_flow::Match,
    state::Visitor,
};
use instances::Instances;
use matches::AssignedMatches;
use tracks::{
    AssociationInput, MotionInput, TrackMotions, TrackTable, TrackedInstances,
    measure_image_velocities,
};

/// Instances and tracks.
#[derive(Debug)]
pub(crate) struct Tracker<'s> {
    config: TrackingConfig,
    masks: TwoFrames<MaskStore<'s>>,
    instances: Instances<'s>,
    tracks: TrackTable<'s>,
    matches: AssignedMatches<'s>,
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
            + AssignedMatches::bytes(capacity)
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
            tracks: TrackTable::new_in(capacity, &config.tracks, carver),
            matches: AssignedMatches::new_in(capacity, &config.matches, carver),
            frame: 0,
            size: [0; 2],
            report: TrackingReport::default(),
        }
    }

    /// Begins frame `frame` of images of that size: validates its detections and associates them
    /// with tracks, which move in the image as the matches of the scene flow say.
    pub(crate) fn detect<'m>(
        &mut self,
        frame: u32,
        detections: &[Detection<'_>],
        size: [usize; 2],
        matches: FrameMatches<'m>,
    ) -> Detected<'_, 'm, 's> {
        (self.frame, self.size) = (frame, size);
        self.report = TrackingReport::default();
        // The detections that can be used, and their masks.
        let given = if self.config.dynamic { detections } else { &[] };
        self.masks.advance();
        let current = self.masks.current_mut();
        current.clear();
        self.report.detections = self.instances.ingest(given, size, current);
        // The tracks that they continue or begin.
        measure_image_velocities(self.tracks.all_mut(), frame, &matches, self.masks.previous());
        let instances = self.instances.all_mut();
        let mut input = AssociationInput { frame, instances, masks: &self.masks };
        self.report.tracks = self.tracks.associate(&mut input);
        Detected::new(self, matches)
    }

    /// Assigns each match of the frame to an instance.
    fn assign_matches(&mut self, matches: &FrameMatches<'_>) {
        let Self { masks, instances, tracks, matches: assigned, frame, .. } = self;
        let (instances, tracks) = (instances.all(), tracks.all());
        let tracked = TrackedInstances { frame: *frame, instances, tracks, masks };
        assigned.assign(matches, &tracked.instance_masks());
    }

    /// Associates the instances from position `first` on with tracks, and assigns to them the
    /// matches that no instance has.
    fn associate_from(&mut self, first: usize, matches: &FrameMatches<'_>) {
        let Self { masks, instances, tracks, matches: assigned, frame, report, .. } = self;
        if instances.all().len() <= first {
            return;
        }
        let mut input = AssociationInput { frame: *frame, instances: instances.all_mut(), masks };
        tracks.associate_from(first, &mut input, &mut report.tracks);
        let (instances, tracks) = (instances.all(), tracks.all());
        let tracked = TrackedInstances { frame: *frame, instances, tracks, masks };
        assigned.assign_from(first, matches, &tracked.instance_masks());
    }

    /// The matches that the camera's own motion may be estimated from.
    fn egomotion_mask<'t>(&'t self, refined: &'t [Match]) -> EgomotionMask<'t, 's> {
        let [width, height] = self.size;
        let large_share = f64::from(self.matches.config().large_share);
        let excluded = self.tracked().excluded(large_share * width as f64 * height as f64);
        self.matches.egomotion_mask(refined, self.masks.previous(), excluded)
    }

    /// Each track's motion, state and pose in this frame, from the matches assigned to it.
    fn estimate_motions(&mut self, input: &MotionInput<'_, '_>, estimator: &mut Estimator<'_>) {
        let mut motions = TrackMotions {
            motion: &self.config.motion,
            state: &self.config.state,
            interval_s: f64::from(self.config.frame_interval_s),
            frame: self.frame,
            instances: self.instances.all(),
            masks: &self.masks,
            matches: &mut self.matches,
        };
        motions.estimate(self.tracks.all_mut(), input, estimator);
    }

    /// Sets the depth of what moves or may move to 0, and counts the pixels.
    fn mask_dynamic_depth(&mut self, depth_m: &mut ViewMut<'_, f32>) {
        let config = self.instances.config();
        self.report.pixels_masked = self.tracked().remove_depth(config, depth_m);
    }

    /// Ends a frame: masks are kept for the next one.
    fn commit(&mut self) -> TrackingReport {
        let instances = self.instances.all();
        self.tracks.commit(instances, self.size, &mut self.masks, &mut self.report.tracks);
        self.report.mask_words = self.masks.current().peak() as u32;
        self.report
    }

    /// The instances of the frame with their tracks and masks.
    fn tracked(&self) -> TrackedInstances<'_, 's> {
        let (instances, tracks) = (self.instances.all(), self.tracks.all());
        TrackedInstances { frame: self.frame, instances, tracks, masks: &self.masks }
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

    /// The tracks of this frame, by age; without tentative ones, which are too small to be
    /// reconstructed and never had a measured motion. Volumes are not known here:
    /// [`TrackReport::blocks`] is 0.
    pub fn tracks(&self) -> impl Iterator<Item = TrackReport> + '_ {
        let interval_s = f64::from(self.config.frame_interval_s);
        let reported = self.tracks.all().iter().filter(|track| !track.is_tentative());
        reported.map(move |track| TrackReport::new(track, interval_s))
    }

    /// The tracks, by age, each with its instance if it was detected in this frame.
    pub(crate) fn tracks_with_instances(
        &self,
    ) -> impl Iterator<Item = (&Track, Option<&Instance>)> {
        let instance_of =
            |track: &Track| track.instance.get().and_then(|index| self.instances.all().get(index));
        self.tracks.all().iter().map(move |track| (track, instance_of(track)))
    }

    /// The best instance of the last frame whose copy mask has the pixel, in constant time per
    /// instance; `None` for the static map.
    pub(crate) fn instance_at(&self, u: i32, v: i32) -> Option<InstanceAt> {
        self.tracked().instance_at(u, v)
    }

    /// Says what must hold of the tracks after a frame.
    pub(crate) fn check_invariants(&self, invariants: &mut Invariants) {
        self.tracks.check_invariants(self.frame, self.instances.all().len(), invariants);
    }

    /// Visits all that outlives a frame. Only this frame's mask store does: the next frame empties
    /// the other one.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self {
            masks,
            tracks,
            // Told by the caller.
            config: _,
            // Belong to one frame.
            instances: _,
            matches: _,
            frame: _,
            size: _,
            report: _,
        } = self;
        masks.current_mut().visit(visitor);
        tracks.visit(visitor);
    }

    /// Returns true if what was read can be, `frames` frames after the first.
    pub(crate) fn can_be(&self, frames: u32) -> bool {
        self.tracks.can_be(frames, self.masks.current())
    }

    /// Adds what is in use to a footprint.
    pub(crate) fn note_use(&self, footprint: &mut Footprint) {
        let tracks = self.tracks.all().len();
        footprint.set_use::<Track>("tracking.track", tracks, tracks);
    }
}
