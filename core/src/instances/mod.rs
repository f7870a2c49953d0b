//! What moves, or could: seen in masks, tracked, followed and reconstructed apart from the street (Sections III-B, III-D, III-E of Bârsan et
//! al., ICRA 2018).
//!
//! A frame goes through in this order, one method each:
//!
//! 1. [`Instances::admit`]: detections are checked, their masks packed ([`Detection`]) and joined to tracks;
//! 2. [`Instances::claim`]: each match of the scene flow is given to the detection it lies on; [`Instances::guides_camera`] then tells the
//!    camera's egomotion which to listen to: none on a dynamic object, none on a large one of unknown state, for that one may be most of
//!    what there is to see; of others RANSAC decides;
//! 3. [`Instances::follow`]: each track's motion, state and pose;
//! 4. [`Instances::clear`]: the static map's depth is 0 under every delete mask, tracked or not;
//! 5. [`Instances::reconstruct`]: each object's virtual frame, its copy mask's pixels, goes into a volume of its own.
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
//! previous mask: the matches refined below the pixel and, where these are fewer than `matches_enough`, sparse ones of other features:
//! they are found also where few neighbours move alike. At least `matches_min` the first time, at least `matches_again` once there is a
//! motion to go by. The estimator sorts out the outliers, beginning at the motion so far,
//! with draws of its own for each track and frame; the filter ([`MotionConfig`]) takes the rest in.
//!
//! # Memory
//!
//! Two buffers of `mask_words` 8-byte words; the tables of detections and tracks; a byte a match; crops and volumes as their rooms say.
//!
//! # What can go wrong
//!
//! Everything the detector gets wrong, and all of it is counted. A mask that holds two cars is one track and gets the motion of the one with
//! more matches.

mod class;
mod config;
mod crop;
mod detection;
mod filter;
mod mask;
mod object;
mod report;
mod state;
#[cfg(test)]
mod tests;
mod track;

pub use class::{Class, Treatment};
pub use config::{InstancesConfig, MotionConfig, ObjectVolumeConfig, Overlap, StateConfig};
pub use crop::{CROPS_MAX, Picture};
pub use detection::{Detection, DetectionCount, MAX_DETECTIONS};
pub use mask::{MaskPlace, MaskStore, PixelBox, ScaledMask};
pub use object::{MAX_OBJECTS, NoSink, Object, ObjectSink, ObjectSummary, RetiredObject, Retirement};
pub use report::{InstancesReport, ObjectCount, TrackReport};
pub use state::{Evidence, State};
pub use track::TrackCount;

use crate::{
    digest::Digest,
    egomotion::Estimator,
    executor::Executor,
    geometry::{StereoRig, Transform, renormalised},
    image::{View, ViewMut},
    memory::{Capacity, Carver, Footprint, SlabError, region_bytes},
    random::Random,
    scene_flow::Match,
    volume::{NoStore, Observation, Viewpoint},
};
use crop::{Crop, Crops};
use detection::Detections;
use filter::Sighting;
use nalgebra::{Point3, Quaternion, Translation3, UnitQuaternion};
use object::Objects;
use track::{Masks, Track, Tracks};

/// Seed of the objects' draws.
const SEED: u64 = 0x006F_626A_6563_7473;

/// Owner of a match that may lie on either of two things.
const AMBIGUOUS: u8 = u8::MAX;

/// Half the width of what a feature is told by, px.
const FEATURE_PX: i32 = 5;

/// Smallest disparity a point is triangulated from, px.
const DISPARITY_MIN_PX: f64 = 0.1;

/// What the camera did in a frame.
#[derive(Clone, Copy, Debug)]
pub struct CameraMotion {
    /// Camera to world, now.
    pub t_world_camera: Transform,
    /// Previous camera to current camera; `None` in the first frame and where it is only guessed.
    pub t_current_previous: Option<Transform>,
    /// Whether the pose is known, and not a guess: nothing is fused from a guess.
    pub known: bool,
}

/// Detections, tracks and objects.
#[derive(Debug)]
pub struct Instances<'s> {
    config: InstancesConfig,
    masks: [MaskStore<'s>; 2],
    /// Which of the two is this frame's.
    now: usize,
    detections: Detections<'s>,
    tracks: Tracks<'s>,
    /// For each refined match the position of the detection it lies on, plus 1; and for each sparse one.
    owner: &'s mut [u8],
    sparse_owner: &'s mut [u8],
    crops: Crops<'s>,
    objects: Objects<'s>,
    frame: u32,
    report: InstancesReport,
}

impl<'s> Instances<'s> {
    /// Bytes of the slab.
    pub const fn bytes(capacity: &Capacity) -> usize {
        2 * region_bytes::<u64>(capacity.mask_words)
            + Detections::bytes(capacity)
            + Tracks::bytes(capacity)
            + region_bytes::<u8>(capacity.matches)
            + region_bytes::<u8>(capacity.matches)
            + Crops::bytes(capacity)
            + Objects::bytes(capacity)
    }

    /// Cuts its regions.
    pub fn carve(capacity: &Capacity, config: &InstancesConfig, carver: &mut Carver<'s>) -> Result<Self, SlabError> {
        Ok(Self {
            config: *config,
            masks: [
                MaskStore::new(carver.cut("instances.mask0", capacity.mask_words)?),
                MaskStore::new(carver.cut("instances.mask1", capacity.mask_words)?),
            ],
            now: 0,
            detections: Detections::carve(capacity, carver)?,
            tracks: Tracks::carve(capacity, carver)?,
            owner: carver.cut("instances.owner", capacity.matches)?,
            sparse_owner: carver.cut("instances.sparse_owner", capacity.matches)?,
            crops: Crops::carve(capacity, carver)?,
            objects: Objects::carve(capacity, &config.volume, carver)?,
            frame: 0,
            report: InstancesReport::default(),
        })
    }

    fn masks_now(&self) -> &MaskStore<'s> {
        let [a, b] = &self.masks;
        if self.now == 0 { a } else { b }
    }

    /// Begins frame `frame` of an image of that size: takes its detections in and joins them to tracks.
    pub fn admit(&mut self, frame: u32, detections: &[Detection<'_>], size: [usize; 2]) {
        self.frame = frame;
        self.report = InstancesReport::default();
        let given = if self.config.dynamic { detections } else { &[] };
        let [a, b] = &mut self.masks;
        self.now = 1 - self.now;
        let (now, before) = if self.now == 0 { (a, b) } else { (b, a) };
        now.clear();
        self.report.detections = self.detections.admit(&self.config, given, size, now);
        let masks = Masks { now, before };
        self.report.tracks = self.tracks.associate(&self.config, frame, self.detections.all_mut(), &masks);
    }

    /// Finds out which detection each match lies on: under its copy mask or else, for the best, under its delete mask.
    pub fn claim(&mut self, refined: &[Match], sparse: &[Match]) {
        let masks = if self.now == 0 { &self.masks[0] } else { &self.masks[1] };
        let detections = self.detections.all();
        let owners = self.owner.iter_mut().zip(refined).chain(self.sparse_owner.iter_mut().zip(sparse));
        for (owner, m) in owners {
            let (u, v) = pixel(m.current_left);
            let lies = |mut under: &mut dyn FnMut(&detection::Taken) -> bool| detections.iter().position(&mut under);
            let copy = lies(&mut |detection| masks.contains(&detection.place, u, v));
            let found = copy.or_else(|| lies(&mut |detection| detection.delete(masks).contains(u, v)));
            *owner = match found {
                Some(at) if between(detections, masks, at, u, v) => AMBIGUOUS,
                Some(at) => at as u8 + 1,
                None => 0,
            };
        }
    }

    /// Decides which matches the camera's egomotion listens to; the answer is a test by the match's position. Call after
    /// [`Instances::claim`].
    pub fn guides_camera(&self, size: [usize; 2]) -> impl Fn(u32) -> bool + Clone + '_ {
        let large = f64::from(self.config.large_share) * size[0] as f64 * size[1] as f64;
        let mut withheld = 0u64;
        for (bit, detection) in self.detections.all().iter().enumerate() {
            let state = self.track_of(detection).map_or(State::Uncertain, |track| track.judgement.state());
            let out = match state {
                State::Dynamic => true,
                State::Static => false,
                State::Uncertain => self.masks_now().area(&detection.place) as f64 > large,
            };
            withheld |= u64::from(out) << bit;
        }
        move |index| match self.owner.get(index as usize) {
            Some(&AMBIGUOUS) => withheld == 0,
            Some(&owner) => owner == 0 || withheld >> (owner - 1) & 1 == 0,
            None => true,
        }
    }

    /// Notes how many matches were kept from the camera.
    pub fn note_withheld(&mut self, matches: u32) {
        self.report.matches_withheld = matches;
    }

    fn track_of(&self, detection: &detection::Taken) -> Option<&Track> {
        self.tracks.all().get(detection.track.checked_sub(1)? as usize)
    }

    /// Each track's motion, state and pose in this frame, from the matches handed to [`Instances::claim`].
    pub fn follow(&mut self, rig: &StereoRig, refined: &[Match], sparse: &[Match], camera: &CameraMotion, estimator: &mut Estimator<'_>) {
        let [a, b] = &self.masks;
        let before = if self.now == 0 { b } else { a };
        let known = |track: &Track| track.judgement.state() != State::Uncertain;
        for track in self.tracks.all_mut() {
            let was_known = known(track);
            let interval_s = f64::from(self.config.frame_interval_s);
            track.filter.predict(&self.config.motion, interval_s);
            (track.matches, track.inliers, track.measured) = (0, 0, 0);
            if let (Some(t_current_previous), true) = (&camera.t_current_previous, track.detection > 0 && track.sightings > 1) {
                let place = track.place;
                let mine = |&(m, &owner): &(&Match, &u8)| {
                    let (u, v) = pixel(m.previous_left);
                    u32::from(owner) == track.detection && before.contains(&place, u, v)
                };
                let own = refined.iter().zip(&*self.owner).filter(mine).map(|(m, _)| m);
                let enough = own.clone().count() >= usize::from(self.config.motion.matches_enough);
                // Sparse matches of the same features say nothing new.
                for (m, owner) in sparse.iter().zip(self.sparse_owner.iter_mut()).filter(|(_, owner)| u32::from(**owner) == track.detection)
                {
                    if enough || own.clone().any(|other| near(m.current_left, other.current_left)) {
                        *owner = 0;
                    }
                }
                let own = own.chain(sparse.iter().zip(&*self.sparse_owner).filter(mine).map(|(m, _)| m));
                let ground = Ground { rig, t_world_camera: &camera.t_world_camera, t_current_previous, interval_s };
                let seed = SEED ^ u64::from(track.id) << 32 ^ u64::from(self.frame);
                let seen = measure(&self.config.motion, &ground, own, &mut track.filter, seed, estimator);
                (track.matches, track.inliers, track.measured) = (seen.matches, seen.inliers, u32::from(seen.measured));
            }
            judge(&self.config, rig, camera, track);
            if track.measured == 0 && track.filter.is_known() {
                track.filter.coast(interval_s);
            }
            place(track, &camera.t_world_camera, was_known, interval_s);
            if track.chain <= 1 {
                // What was cropped in a chain that broke does not connect to what comes.
                self.crops.forget(track.id);
            }
        }
    }

    /// Sets the depth under every delete mask to 0. Colour is only ever fused where there is depth.
    pub fn clear(&mut self, depth_m: &mut ViewMut<'_, f32>) {
        let width = depth_m.width();
        let masks = if self.now == 0 { &self.masks[0] } else { &self.masks[1] };
        let mut cleared = 0;
        for detection in self.detections.all() {
            let mask = detection.delete(masks);
            let rows = depth_m.pixels_mut().chunks_exact_mut(width);
            let (skip, take) = (mask.pixels.top.max(0), (mask.pixels.top + mask.pixels.height).max(0));
            for (v, row) in (0..).zip(rows).take(take as usize).skip(skip as usize) {
                mask.row(v, width as i32, |u| {
                    if let Some(depth) = row.get_mut(u).filter(|depth| **depth != 0.0) {
                        *depth = 0.0;
                        cleared += 1;
                    }
                });
            }
        }
        self.report.pixels_cleared = cleared;
    }

    /// Fuses what this frame shows of each object into its volume, and ends the frame. Objects that must go are handed to `sink`.
    pub fn reconstruct<E: Executor>(
        &mut self,
        rig: &StereoRig,
        picture: &Picture<'_>,
        disparity_q8: View<'_, u16>,
        camera: &CameraMotion,
        executor: &E,
        sink: &mut impl ObjectSink,
    ) {
        self.retire_orphans(sink);
        for index in 0..self.tracks.all().len() {
            let Some(track) = self.tracks.all().get(index).copied() else { break };
            let Some(detection) = track.detection.checked_sub(1).and_then(|at| self.detections.all().get(at as usize)) else { continue };
            if !camera.known || track.chain == 0 || track.class().treatment() != Treatment::Reconstruct {
                continue;
            }
            let masks = if self.now == 0 { &self.masks[0] } else { &self.masks[1] };
            let area = detection.place.pixels.area() as usize;
            let Some(disparity) = self.objects.disparity_q8.get_mut(..area) else { continue };
            if crop::cut(rig, self.config.volume.extent_m, disparity_q8, masks, &detection.place, disparity) == 0 {
                continue;
            }
            let crop = Crop {
                t_world_camera: numbers(&camera.t_world_camera),
                t_world_object: track.t_world_object,
                pixels: detection.place.pixels,
                id: track.id,
                ..Crop::default()
            };
            match track.judgement.state() {
                State::Uncertain => {
                    let dropped = self.crops.push(crop, disparity, picture);
                    self.report.objects.crops_dropped += dropped.unwrap_or(1);
                }
                // A moving object's pose is a guess in a frame without a motion of its own.
                State::Dynamic if track.measured == 0 => {}
                _ => self.fuse_into(rig, &track, &crop, picture, executor, sink),
            }
        }
        let count = &mut self.report.objects;
        count.objects = self.objects.objects.iter().filter(|object| object.summary.is_some()).count() as u32;
        count.blocks = self.objects.blocks() as u32;
        let [a, b] = &mut self.masks;
        let (now, before) = if self.now == 0 { (a, b) } else { (b, a) };
        self.tracks.settle(self.detections.all(), now, before, &mut self.report.tracks);
    }

    /// Fuses this frame's crop, whose disparity is in the scratch image, into the track's volume; first, if that is new, what waited.
    fn fuse_into<E: Executor>(
        &mut self,
        rig: &StereoRig,
        track: &Track,
        crop: &Crop,
        picture: &Picture<'_>,
        executor: &E,
        sink: &mut impl ObjectSink,
    ) {
        let config = self.config.volume;
        let count = &mut self.report.objects;
        let mut at = self.objects.of(track.id);
        if let Some(object) = at.and_then(|at| self.objects.objects.get_mut(at))
            && object.summary.is_some_and(|summary| summary.chain != track.chains)
        {
            count.retired += u32::from(object.retire(&config, Retirement::Restarted, sink));
            at = None;
        }
        let fresh = at.is_none();
        let Some(at) = at.or_else(|| self.objects.find_room(&config, self.frame, &mut count.retired, sink)) else {
            count.refused += 1;
            return;
        };
        let Objects { objects, depth_m, disparity_q8 } = &mut self.objects;
        let Some(object) = objects.get_mut(at) else { return };
        let mut fuse = |object: &mut Object<'s>, crop: &Crop, picture: &Picture<'_>, disparity: &[u16]| {
            count.blocks_refused += fuse_crop(object, rig, crop, disparity, picture, depth_m, executor);
        };
        if fresh {
            count.begun += 1;
            object.summary = Some(ObjectSummary {
                id: track.id,
                chain: track.chains,
                class: track.class(),
                state: State::Uncertain,
                first_frame: self.frame,
                last_frame: self.frame,
                frames: 0,
                t_world_object: Transform::identity(),
            });
            let standing = track.judgement.state() == State::Static;
            for (waiting, disparity, picture) in self.crops.of(track.id) {
                // Of an object that stands every frame's pose is that of the first.
                let t_world_object = if standing { track.t_world_origin } else { waiting.t_world_object };
                fuse(object, &Crop { t_world_object, ..*waiting }, &picture, disparity);
                count.caught_up += 1;
            }
            self.crops.forget(track.id);
        }
        let Some(picture) = picture.part(&crop.pixels) else { return };
        fuse(object, crop, &picture, disparity_q8);
        count.fused += 1;
        if let Some(summary) = &mut object.summary {
            summary.class = track.class();
            summary.state = track.judgement.state();
            summary.last_frame = self.frame;
            summary.frames += 1;
            summary.t_world_object = transform(&track.t_world_object);
            if config.prune_weight > 0 && summary.frames.is_multiple_of(u32::from(config.prune_frames)) {
                object.volume.prune_whole(config.prune_weight);
            }
        }
    }

    /// Hands over the objects whose track is no more.
    fn retire_orphans(&mut self, sink: &mut impl ObjectSink) {
        let tracks = self.tracks.all();
        for object in &mut self.objects.objects {
            let orphan = object.summary.is_some_and(|summary| tracks.iter().all(|track| track.id != summary.id));
            if orphan && object.retire(&self.config.volume, Retirement::Forgotten, sink) {
                self.report.objects.retired += 1;
            }
        }
    }

    /// Ends a drive: hands over every object. Returns how many.
    pub fn finish(&mut self, sink: &mut impl ObjectSink) -> u32 {
        let config = &self.config.volume;
        self.objects.objects.iter_mut().map(|object| u32::from(object.retire(config, Retirement::Finished, sink))).sum()
    }

    /// What the last frame came to.
    pub fn report(&self) -> &InstancesReport {
        &self.report
    }

    /// The tracks as they stand, by age.
    pub fn tracks(&self) -> impl Iterator<Item = TrackReport> + '_ {
        let interval_s = f64::from(self.config.frame_interval_s);
        self.tracks.all().iter().map(move |track| {
            let object = self.objects.of(track.id).and_then(|at| self.objects.objects.get(at));
            TrackReport {
                id: track.id,
                class: track.class(),
                state: track.judgement.state(),
                score: track.score,
                seen: track.detection > 0,
                first_frame: track.first_frame,
                last_frame: track.last_frame,
                sightings: track.sightings,
                pixels: track.place.pixels,
                speed_m_s: track.filter.is_known().then(|| [track.filter.speed()[0] as f32, track.sigma_m_s]),
                measured: track.measured == 1,
                center_world_m: track.filter.center_world().coords.into(),
                motion_world: motion_world(track, interval_s),
                t_world_object: (track.chain > 0).then(|| transform(&track.t_world_object)),
                matches: track.matches,
                inliers: track.inliers,
                blocks: object.map_or(0, |object| object.volume.pool().len() as u32),
            }
        })
    }

    /// The objects that have a volume now.
    pub fn objects(&self) -> impl Iterator<Item = (&ObjectSummary, &Object<'s>)> {
        self.objects.objects.iter().filter_map(|object| Some((object.summary()?, object)))
    }

    /// Digest of all that later frames depend on: tracks by age, objects by position.
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::default();
        for track in self.tracks.all() {
            let numbers = [track.id, track.class, track.first_frame, track.last_frame, track.chain, track.chains, track.inliers];
            numbers.iter().for_each(|&number| digest.u64(u64::from(number)));
            digest.u64(track.judgement.state() as u64);
            track.t_world_object.iter().for_each(|&number| digest.f64(number));
            track.filter.rate().iter().for_each(|&number| digest.f64(number));
            digest.u64(self.masks_now().area(&track.place) as u64);
        }
        for object in &self.objects.objects {
            digest.u64(object.summary.map_or(0, |summary| u64::from(summary.id) << 32 | u64::from(summary.frames)));
            digest.u64(object.volume.digest());
        }
        digest.finish()
    }

    /// Enters what is in use into a footprint.
    pub fn note_use(&self, footprint: &mut Footprint) {
        footprint.set_use::<Track>("instances.track", self.tracks.all().len(), self.tracks.all().len());
        footprint.set_use::<Crop>("instances.crop", self.crops.len(), CROPS_MAX);
    }
}

/// The camera and the time between two frames, to measure motions over ground by.
struct Ground<'a> {
    rig: &'a StereoRig,
    t_world_camera: &'a Transform,
    t_current_previous: &'a Transform,
    interval_s: f64,
}

/// How a measurement went.
struct Measured {
    matches: u32,
    inliers: u32,
    measured: bool,
}

/// Estimates a motion from an object's matches and lets the filter, already predicted, take in those it explains.
fn measure<'m>(
    config: &MotionConfig,
    ground: &Ground<'_>,
    matches: impl Iterator<Item = &'m Match> + Clone,
    filter: &mut filter::Filter,
    seed: u64,
    estimator: &mut Estimator<'_>,
) -> Measured {
    let points = matches.clone().count() as u32;
    let mut measured = Measured { matches: points, inliers: 0, measured: false };
    let needed = if filter.is_known() { config.matches_again } else { config.matches_min };
    if points < u32::from(needed) {
        return measured;
    }
    // Where the motion so far would take the object, seen from the camera.
    let camera_world = ground.t_world_camera.inverse();
    let motion_camera = camera_world * filter.motion(ground.interval_s) * ground.t_world_camera;
    let expected = renormalised(&(motion_camera * ground.t_current_previous));
    let settings = config.estimator();
    let estimate = estimator.estimate(&settings, ground.rig, matches.clone(), &mut Random::new(seed), Some(&expected));
    if estimate.t_current_previous.is_none() {
        return measured;
    }
    measured.inliers = estimate.inliers;
    let inlying = Inlying { indexed: (0u32..).zip(matches), inliers: estimator.inliers() };
    let sightings = inlying.filter_map(|m| sighting(m, ground));
    let noise_px =
        if estimate.residual_rms_px > f64::from(config.noise_px) { estimate.residual_rms_px } else { f64::from(config.noise_px) };
    measured.measured = filter.update(config, ground.rig, ground.t_world_camera, ground.interval_s, noise_px, sightings);
    measured
}

/// The matches at the positions `inliers` names, in ascending order both.
#[derive(Clone)]
struct Inlying<M, I> {
    indexed: M,
    inliers: I,
}

impl<'m, M: Iterator<Item = (u32, &'m Match)>, I: Iterator<Item = u32>> Iterator for Inlying<M, I> {
    type Item = &'m Match;

    fn next(&mut self) -> Option<&'m Match> {
        let wanted = self.inliers.next()?;
        self.indexed.find(|(index, _)| *index == wanted).map(|(_, m)| m)
    }
}

/// A match as the filter takes it: its point triangulated in the previous camera and carried along by the camera's motion.
fn sighting(m: &Match, ground: &Ground<'_>) -> Option<Sighting> {
    let rig = ground.rig;
    let centered = |[u, v]: [f32; 2]| [f64::from(u) - rig.center_u_px, f64::from(v) - rig.center_v_px];
    let ([u, v], [u_right, v_right]) = (centered(m.previous_left), centered(m.previous_right));
    let disparity = u - u_right;
    // Not so for NaN.
    let triangulates = disparity >= DISPARITY_MIN_PX;
    if !triangulates {
        return None;
    }
    let per_px = rig.baseline_m / disparity;
    let before = Point3::new(u * per_px, 0.5 * (v + v_right) * per_px, rig.focal_px * per_px);
    Some(Sighting {
        standing: ground.t_current_previous * before,
        left: centered(m.current_left),
        right: centered(m.current_right),
    })
}

/// Takes a frame's motion, or its lack, into a track's state.
fn judge(config: &InstancesConfig, rig: &StereoRig, camera: &CameraMotion, track: &mut Track) {
    let evidence = camera.t_current_previous.filter(|_| track.measured == 1).map(|t_current_previous| {
        let interval_s = f64::from(config.frame_interval_s);
        let [speed, sigma] = track.filter.speed();
        let camera_world = camera.t_world_camera.inverse();
        let standing = camera_world * track.filter.center_world();
        let now = standing + camera_world.rotation * track.filter.velocity() * interval_s;
        let passing = (now - t_current_previous.inverse() * standing).norm() / interval_s;
        let turned = f64::from(config.motion.camera_rad) * standing.z / interval_s;
        track.sigma_m_s = libm::sqrt(sigma * sigma + turned * turned) as f32;
        // Depth goes with the inverse of disparity, its change with the inverse square.
        let side = rig.focal_px * standing.x / (standing.z * rig.center_u_px);
        let error_px = f64::from(config.motion.bias_px) + f64::from(config.motion.lens_px) * side * side * side * side;
        let bias = passing * 2.0 * error_px * standing.z / rig.focal_baseline_px_m();
        Evidence { speed_m_s: speed as f32, sigma_m_s: track.sigma_m_s, bias_m_s: bias as f32 }
    });
    track.judgement.advance(&config.state, evidence);
}

/// Motion over ground in this frame: none for an object that stands.
fn motion_world(track: &Track, interval_s: f64) -> Transform {
    if track.judgement.state() == State::Static || !track.filter.is_known() {
        return Transform::identity();
    }
    track.filter.motion(interval_s)
}

/// Moves a track's chain of poses on, begins a new one or breaks it.
fn place(track: &mut Track, t_world_camera: &Transform, was_known: bool, interval_s: f64) {
    let is_known = track.judgement.state() != State::Uncertain;
    let connects = track.chain > 0 && (track.measured == 1 || is_known);
    if connects {
        let moved = renormalised(&(motion_world(track, interval_s) * transform(&track.t_world_object)));
        let stands = track.judgement.state() == State::Static;
        track.t_world_object = if stands && !was_known { track.t_world_origin } else { numbers(&moved) };
        track.chain += 1;
    } else if track.detection > 0 {
        let here = numbers(t_world_camera);
        (track.t_world_origin, track.t_world_object) = (here, here);
        (track.chain, track.chains) = (1, track.chains + 1);
    } else {
        track.chain = 0;
    }
}

/// Whether a pixel of detection `at` lies beside the copy mask of another: what is seen there may belong to either, for a feature is
/// several pixels wide, and the silhouette of a thing in front moves with that thing.
fn between(detections: &[detection::Taken], masks: &MaskStore<'_>, at: usize, u: i32, v: i32) -> bool {
    let around = PixelBox {
        left: u - FEATURE_PX,
        top: v - FEATURE_PX,
        width: 2 * FEATURE_PX + 1,
        height: 2 * FEATURE_PX + 1,
    };
    let rim = [-FEATURE_PX, 0, FEATURE_PX];
    detections.iter().enumerate().filter(|&(other, _)| other != at).any(|(_, other)| {
        around.intersection(&other.place.pixels).area() > 0
            && rim.iter().any(|dv| rim.iter().any(|du| masks.contains(&other.place, u + du, v + dv)))
    })
}

/// Whether two keypoints are one.
fn near(a: [f32; 2], b: [f32; 2]) -> bool {
    let [u, v] = [a[0] - b[0], a[1] - b[1]];
    u * u + v * v < 2.0
}

/// The pixel a keypoint lies in; one far beside every image for what is not a number.
fn pixel([u, v]: [f32; 2]) -> (i32, i32) {
    if !(u.is_finite() && v.is_finite()) {
        return (-1, -1);
    }
    (crate::geometry::scalar::floor_i32(u + 0.5), crate::geometry::scalar::floor_i32(v + 0.5))
}

fn numbers(transform: &Transform) -> [f64; 7] {
    let (q, t) = (transform.rotation.coords, transform.translation.vector);
    [q.x, q.y, q.z, q.w, t.x, t.y, t.z]
}

fn transform(&[i, j, k, w, x, y, z]: &[f64; 7]) -> Transform {
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
    Transform::from_parts(Translation3::new(x, y, z), rotation)
}

/// Fuses a crop as an image of its own, whose principal point lies where its box puts it. Returns the blocks refused.
fn fuse_crop<E: Executor>(
    object: &mut Object<'_>,
    rig: &StereoRig,
    crop: &Crop,
    disparity_q8: &[u16],
    picture: &Picture<'_>,
    depth_m: &mut [f32],
    executor: &E,
) -> u32 {
    let (width, height) = (picture.grey.width(), picture.grey.height());
    let (Some(disparity), Some(mut depth)) = (View::new(disparity_q8, width, height), ViewMut::new(depth_m, width, height)) else {
        return 0;
    };
    let volume = object.volume.config();
    crate::geometry::depth_from_disparity(rig, volume.near_m, volume.far_m, disparity, &mut depth);
    let rig = StereoRig {
        center_u_px: rig.center_u_px - f64::from(crop.pixels.left),
        center_v_px: rig.center_v_px - f64::from(crop.pixels.top),
        ..*rig
    };
    let t_object_camera = renormalised(&(transform(&crop.t_world_object).inverse() * transform(&crop.t_world_camera)));
    let view = Viewpoint { rig, width, height, t_world_camera: t_object_camera };
    let seen = Observation {
        depth_m: depth.as_view(),
        grey: picture.grey,
        colour: picture.colour,
        class: None,
    };
    let allocation = object.volume.allocate(&view, seen.depth_m, &mut NoStore);
    object.volume.fuse(&view, seen, executor);
    allocation.refused + allocation.beyond + allocation.unlisted
}
