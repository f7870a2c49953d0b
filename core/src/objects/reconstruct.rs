//! What a frame shows of each object goes into a volume of its own.

use super::{
    ObjectCount, ObjectSink, ObjectSummary, Objects, Picture, Retirement,
    crop::{self, Crop},
    object::{Object, ObjectVolumes},
};
use crate::{
    geometry::{StereoRig, Transform, depth_from_disparity},
    image::{View, ViewMut},
    parallel::Executor,
    tracking::{
        State, Track, Tracker, Treatment,
        pose::{numbers, transform},
    },
    volume::{NoStore, Observation, Viewpoint},
};

/// What objects are fused from in a frame.
#[derive(Clone, Copy, Debug)]
pub struct ObjectFrame<'a> {
    /// The cameras.
    pub rig: &'a StereoRig,
    /// Camera to world.
    pub t_world_camera: &'a Transform,
    /// The left picture.
    pub picture: Picture<'a>,
    /// Its disparity, 1/256 px, 0 none.
    pub disparity_q8: View<'a, u16>,
}

impl<'s> Objects<'s> {
    /// Fuses what this frame shows of each object into its volume; nothing where `frame` is `None`, as when the camera's pose is a guess.
    /// Objects that must go are handed to `sink`.
    pub fn reconstruct<E: Executor>(
        &mut self,
        tracker: &Tracker<'_>,
        frame: Option<&ObjectFrame<'_>>,
        executor: &E,
        sink: &mut impl ObjectSink,
    ) {
        self.report = ObjectCount::default();
        // What was cropped in a chain that broke does not connect to what comes.
        tracker.all().iter().filter(|track| track.chain <= 1).for_each(|track| self.crops.forget(track.id));
        self.retire_orphans(tracker, sink);
        if let Some(frame) = frame {
            tracker.all().iter().for_each(|track| self.take(tracker, track, frame, executor, sink));
        }
        self.report.objects = self.volumes.objects.iter().filter(|object| object.summary.is_some()).count() as u32;
        self.report.blocks = self.volumes.blocks() as u32;
    }

    /// Takes what a frame shows of one object: into its volume or, while its motion is not known, to those that wait.
    fn take<E: Executor>(
        &mut self,
        tracker: &Tracker<'_>,
        track: &Track,
        frame: &ObjectFrame<'_>,
        executor: &E,
        sink: &mut impl ObjectSink,
    ) {
        let Some(detection) = track.detection.checked_sub(1).and_then(|at| tracker.detections().get(at as usize)) else { return };
        if track.chain == 0 || track.class().treatment() != Treatment::Reconstruct || detection.small == 1 {
            return;
        }
        let area = detection.place.pixels.area() as usize;
        let Some(disparity) = self.volumes.disparity_q8.get_mut(..area) else { return };
        let extent_m = self.config.extent_m;
        if crop::cut(frame.rig, extent_m, frame.disparity_q8, tracker.masks_now(), &detection.place, disparity) == 0 {
            return;
        }
        let crop = Crop {
            t_world_camera: numbers(frame.t_world_camera),
            t_world_object: track.t_world_object,
            pixels: detection.place.pixels,
            id: track.id,
            ..Crop::default()
        };
        match track.judgement.state() {
            State::Uncertain => {
                let dropped = self.crops.push(crop, disparity, &frame.picture);
                self.report.crops_dropped += dropped.unwrap_or(1);
            }
            // A moving object's pose is a guess in a frame without a motion of its own.
            State::Dynamic if track.measured == 0 => {}
            _ => self.fuse_into(tracker.frame(), track, &crop, frame, executor, sink),
        }
    }

    /// Fuses this frame's crop, whose disparity is in the scratch image, into the track's volume; first, if that is new, what waited.
    fn fuse_into<E: Executor>(
        &mut self,
        number: u32,
        track: &Track,
        crop: &Crop,
        frame: &ObjectFrame<'_>,
        executor: &E,
        sink: &mut impl ObjectSink,
    ) {
        let config = self.config;
        let count = &mut self.report;
        let mut at = self.volumes.of(track.id);
        if let Some(object) = at.and_then(|at| self.volumes.objects.get_mut(at))
            && object.summary.is_some_and(|summary| summary.chain != track.chains)
        {
            count.retired += u32::from(object.retire(&config, Retirement::Restarted, sink));
            at = None;
        }
        let fresh = at.is_none();
        let Some(at) = at.or_else(|| self.volumes.find_room(&config, number, &mut count.retired, sink)) else {
            count.refused += 1;
            return;
        };
        let ObjectVolumes { objects, depth_m, disparity_q8 } = &mut self.volumes;
        let Some(object) = objects.get_mut(at) else { return };
        let mut fuse = |object: &mut Object<'s>, crop: &Crop, picture: &Picture<'_>, disparity: &[u16]| {
            count.blocks_refused += fuse_crop(object, frame.rig, crop, disparity, picture, depth_m, executor);
        };
        if fresh {
            count.begun += 1;
            object.summary = Some(ObjectSummary {
                id: track.id,
                chain: track.chains,
                class: track.class(),
                state: State::Uncertain,
                first_frame: number,
                last_frame: number,
                frames: 0,
                t_world_object: Transform::IDENTITY,
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
        let Some(picture) = frame.picture.part(&crop.pixels) else { return };
        fuse(object, crop, &picture, disparity_q8);
        count.fused += 1;
        if let Some(summary) = &mut object.summary {
            summary.class = track.class();
            summary.state = track.judgement.state();
            summary.last_frame = number;
            summary.frames += 1;
            summary.t_world_object = transform(&track.t_world_object);
            if config.prune_weight > 0 && summary.frames.is_multiple_of(u32::from(config.prune_frames)) {
                object.volume.prune_whole(config.prune_weight);
            }
        }
    }

    /// Hands over the objects whose track is no more.
    fn retire_orphans(&mut self, tracker: &Tracker<'_>, sink: &mut impl ObjectSink) {
        let tracks = tracker.all();
        for object in &mut self.volumes.objects {
            let orphan = object.summary.is_some_and(|summary| tracks.iter().all(|track| track.id != summary.id));
            if orphan && object.retire(&self.config, Retirement::Forgotten, sink) {
                self.report.retired += 1;
            }
        }
    }

    /// Ends a drive: hands over every object. Returns how many.
    pub fn finish(&mut self, sink: &mut impl ObjectSink) -> u32 {
        let config = &self.config;
        self.volumes.objects.iter_mut().map(|object| u32::from(object.retire(config, Retirement::Finished, sink))).sum()
    }
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
    depth_from_disparity(rig, volume.near_m, volume.far_m, disparity, &mut depth);
    let rig = StereoRig {
        center_u_px: rig.center_u_px - f64::from(crop.pixels.left),
        center_v_px: rig.center_v_px - f64::from(crop.pixels.top),
        ..*rig
    };
    let t_object_camera = (transform(&crop.t_world_object).inverse() * transform(&crop.t_world_camera)).normalized();
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
