//! Reconstruction: what a frame shows of each object is fused into its volume.

use super::{
    ObjectSink, ObjectSummary, Objects, ObjectsReport, Picture, Retirement,
    crop::{Crop, CropSource},
    object::{Object, ObjectVolumes},
};
use crate::{
    geometry::{StereoRig, Transform, depth_from_disparity},
    image::{View, ViewMut},
    parallel::Executor,
    tracking::{Instance, MotionState, Track, Tracked, Tracker, Treatment},
    volume::{DepthImage, NoStore, Observation, Viewpoint},
};

/// Images and poses from which objects are fused in a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObjectFrame<'a> {
    /// The cameras.
    pub rig: &'a StereoRig,
    /// Camera to world.
    pub t_world_camera: &'a Transform,
    /// The left picture.
    pub picture: Picture<'a>,
    /// Disparity image, 1/256 px, 0 for none.
    pub disparity_q8: View<'a, u16>,
}

/// A track that is detected in a frame.
struct DetectedTrack<'a> {
    tracker: &'a Tracker<'a>,
    track: &'a Track,
    instance: &'a Instance,
    frame: &'a ObjectFrame<'a>,
}

/// A crop with its pixels: disparity row by row of its box, and picture.
struct CropPixels<'a> {
    crop: &'a Crop,
    disparity_q8: &'a [u16],
    picture: &'a Picture<'a>,
}

impl<'s> Objects<'s> {
    /// Fuses what this frame shows of each object into its volume; nothing where `frame` is `None`,
    /// as when the camera's pose is extrapolated. Objects that retire are handed to `sink`.
    pub(crate) fn reconstruct<E: Executor>(
        &mut self,
        tracked: &Tracked<'_, '_>,
        frame: Option<&ObjectFrame<'_>>,
        executor: &E,
        sink: &mut impl ObjectSink,
    ) {
        let tracker = tracked.tracker();
        let retired = core::mem::take(&mut self.restarted);
        self.report = ObjectsReport { retired, ..ObjectsReport::default() };
        // The crops of a trajectory segment that ended do not connect to what follows.
        let is_new_segment = |track: &&Track| track.segment_len <= 1;
        tracker
            .tracks_with_instances()
            .map(|(track, _)| track)
            .filter(is_new_segment)
            .for_each(|track| self.crops.forget(track.id));
        // Objects whose track is gone retire before new ones need a volume.
        self.retire_orphans(tracker, sink);
        if let Some(frame) = frame {
            let detected = tracker
                .tracks_with_instances()
                .filter_map(|(track, instance)| Some((track, instance?)));
            detected.for_each(|(track, instance)| {
                let detected = DetectedTrack { tracker, track, instance, frame };
                self.integrate(&detected, executor, sink)
            });
        }
        self.report.objects =
            self.volumes.objects.iter().filter(|object| object.summary.is_some()).count() as u32;
        self.report.blocks = self.volumes.blocks() as u32;
    }

    /// Crops what a frame shows of one object, and fuses it into its volume or, while its motion is
    /// uncertain, keeps it for later.
    fn integrate<E: Executor>(
        &mut self,
        detected: &DetectedTrack<'_>,
        executor: &E,
        sink: &mut impl ObjectSink,
    ) {
        let &DetectedTrack { tracker, track, instance, frame } = detected;
        // Only reconstructed classes, with a pose, near enough for a mask with detail.
        if track.segment_len == 0
            || track.class().treatment() != Treatment::Reconstruct
            || instance.tracked_only.get()
        {
            return;
        }
        // The box lies in the image, so its pixels fit the scratch.
        let pixels = instance.mask.pixels;
        let Some(disparity) = self.volumes.disparity_q8.get_mut(..pixels.area() as usize) else {
            debug_assert!(false, "a box lies in the image");
            return;
        };
        let source = CropSource {
            rig: frame.rig,
            extent_m: self.config.extent_m,
            disparity_q8: frame.disparity_q8,
            masks: tracker.masks(),
            mask: &instance.mask,
        };
        // Nothing of the object has depth in this frame.
        if source.copy_into(disparity, executor.vectors()) == 0 {
            return;
        }
        let crop = Crop {
            t_world_camera: *frame.t_world_camera,
            t_world_object: track.t_world_object,
            pixels,
            id: track.id,
            ..Crop::default()
        };
        // An uncertain object is kept as crops until its poses are known, then fused at once.
        match track.motion_state.state() {
            MotionState::Uncertain => {
                let dropped = self.crops.push(crop, disparity, &frame.picture);
                let enough = self.crops.required_pixels() as u32;
                self.report.crop_pixels =
                    if enough > self.report.crop_pixels { enough } else { self.report.crop_pixels };
                self.report.crops_dropped += dropped.unwrap_or(1);
            }
            // A moving object's pose is extrapolated in a frame without a motion of its own.
            MotionState::Dynamic if !track.measured.get() => {}
            _ => self.fuse(detected, &crop, executor, sink),
        }
    }

    /// Fuses this frame's crop, whose disparity is in the scratch image, into the track's volume;
    /// if that is new, the crops that were kept for it first.
    fn fuse<E: Executor>(
        &mut self,
        detected: &DetectedTrack<'_>,
        crop: &Crop,
        executor: &E,
        sink: &mut impl ObjectSink,
    ) {
        let &DetectedTrack { tracker, track, frame, .. } = detected;
        let number = tracker.frame();
        // A track keeps its volume; a new one takes a free or a displaced volume.
        let known = self.volume_of(track, sink);
        let Some(at) = known.or_else(|| {
            self.volumes.allocate(&self.config, number, &mut self.report.retired, sink)
        }) else {
            self.report.refused += 1;
            return;
        };
        // Crops kept so far come first: the object begins with its past.
        if known.is_none() {
            self.begin(at, detected, executor);
        }
        let Some(picture) = frame.picture.part(&crop.pixels) else {
            debug_assert!(false, "a crop lies in the image");
            return;
        };
        let ObjectVolumes { objects, depth_m, disparity_q8 } = &mut self.volumes;
        let Some(object) = objects.get_mut(at) else { return };
        let pixels = CropPixels { crop, disparity_q8, picture: &picture };
        self.report.blocks_refused += fuse_crop(object, frame.rig, &pixels, depth_m, executor);
        self.report.fused += 1;
        // The summary is what the object's sink and the planner read.
        if let Some(summary) = &mut object.summary {
            summary.class = track.class();
            summary.state = track.motion_state.state();
            summary.last_frame = number;
            summary.frames = summary.frames.saturating_add(1);
            summary.t_world_object = track.t_world_object;
            // Pruned whole every few frames: an object has no history of visible blocks.
            if self.config.prune_weight > 0
                && summary.frames.is_multiple_of(u32::from(self.config.prune_frames))
            {
                object.volume.prune_whole(self.config.prune_weight);
            }
        }
    }

    /// Position of the track's volume. That of an earlier trajectory segment retires.
    fn volume_of(&mut self, track: &Track, sink: &mut impl ObjectSink) -> Option<usize> {
        let at = self.volumes.position_of(track.id)?;
        let object = self.volumes.objects.get_mut(at)?;
        if object.summary.is_some_and(|summary| summary.segment_id == track.segment_id) {
            return Some(at);
        }
        self.report.retired += u32::from(object.retire(&self.config, Retirement::Restarted, sink));
        None
    }

    /// Begins an object in the free volume at `at`, with the crops that were kept for it.
    fn begin<E: Executor>(&mut self, at: usize, detected: &DetectedTrack<'_>, executor: &E) {
        let &DetectedTrack { tracker, track, frame, .. } = detected;
        let number = tracker.frame();
        let ObjectVolumes { objects, depth_m, .. } = &mut self.volumes;
        let Some(object) = objects.get_mut(at) else { return };
        self.report.begun += 1;
        // An object counts from this frame on, although its crops are older.
        object.summary = Some(ObjectSummary {
            id: track.id,
            segment_id: track.segment_id,
            class: track.class(),
            state: MotionState::Uncertain,
            first_frame: number,
            last_frame: number,
            frames: 0,
            t_world_object: Transform::IDENTITY,
        });
        let is_static = track.motion_state.state() == MotionState::Static;
        for (kept, disparity_q8, picture) in self.crops.of(track.id) {
            // A static object has the pose of the first frame in every frame.
            let t_world_object = if is_static { track.t_world_origin } else { kept.t_world_object };
            let crop = Crop { t_world_object, ..*kept };
            let pixels = CropPixels { crop: &crop, disparity_q8, picture: &picture };
            self.report.blocks_refused += fuse_crop(object, frame.rig, &pixels, depth_m, executor);
            self.report.caught_up += 1;
        }
        self.crops.forget(track.id);
    }

    /// Retires the objects whose track was forgotten.
    fn retire_orphans(&mut self, tracker: &Tracker<'_>, sink: &mut impl ObjectSink) {
        for object in &mut self.volumes.objects {
            // Lists are short: a search each is no cost.
            let is_tracked = |summary: &ObjectSummary| {
                tracker.tracks_with_instances().any(|(track, _)| track.id == summary.id)
            };
            let is_orphan = object.summary.is_some_and(|summary| !is_tracked(&summary));
            if is_orphan && object.retire(&self.config, Retirement::Forgotten, sink) {
                self.report.retired += 1;
            }
        }
    }

    /// Ends a sequence: retires every object. Returns how many.
    pub(crate) fn finish(&mut self, sink: &mut impl ObjectSink) -> u32 {
        self.retire_all(Retirement::Finished, sink)
    }

    /// Retires every object, whose poses lie in a frame of reference that the camera has left.
    pub(crate) fn restart(&mut self, sink: &mut impl ObjectSink) {
        self.restarted = self.retire_all(Retirement::Restarted, sink);
    }

    fn retire_all(&mut self, reason: Retirement, sink: &mut impl ObjectSink) -> u32 {
        let config = &self.config;
        self.volumes
            .objects
            .iter_mut()
            .map(|object| u32::from(object.retire(config, reason, sink)))
            .sum()
    }
}

/// Fuses a crop as an image of its own, with the principal point relative to its box. Returns the
/// blocks refused.
fn fuse_crop<E: Executor>(
    object: &mut Object<'_>,
    rig: &StereoRig,
    pixels: &CropPixels<'_>,
    depth_m: &mut [f32],
    executor: &E,
) -> u32 {
    let &CropPixels { crop, disparity_q8, picture } = pixels;
    let (width, height) = (picture.grey.width(), picture.grey.height());
    let (Some(disparity), Some(mut depth)) =
        (View::new(disparity_q8, width, height), ViewMut::new(depth_m, width, height))
    else {
        debug_assert!(false, "a crop is as large as its box");
        return 0;
    };
    let volume = object.volume.config();
    // Limits of depth are the volume's own.
    depth_from_disparity(rig, volume.near_m, volume.far_m, disparity, &mut depth);
    // The crop's corner shifts the principal point.
    let rig = StereoRig {
        center_u_px: rig.center_u_px - f64::from(crop.pixels.left),
        center_v_px: rig.center_v_px - f64::from(crop.pixels.top),
        ..*rig
    };
    // Fusion happens in the object's frame, in which the object stands still.
    let t_object_camera = (crop.t_world_object.inverse() * crop.t_world_camera).normalized();
    let view = Viewpoint { rig, width, height, t_world_camera: t_object_camera };
    let observation = Observation {
        depth: DepthImage::Plain(depth.as_view()),
        grey: picture.grey,
        colour: picture.colour,
        class: None,
    };
    let allocation =
        object.volume.allocate(&view, observation.depth.depth_m(), &mut NoStore, executor);
    object.volume.fuse(&view, observation, executor);
    allocation.refused + allocation.beyond + allocation.unlisted
}
