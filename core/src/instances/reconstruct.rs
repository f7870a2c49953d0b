//! What a frame shows of each object goes into a volume of its own.

use super::{
    CameraMotion, Instances, ObjectSink, ObjectSummary, Picture, Retirement, State, Treatment,
    crop::{self, Crop},
    object::{Object, Objects},
    pose::{numbers, transform},
    track::Track,
};
use crate::{
    executor::Executor,
    geometry::{StereoRig, Transform, depth_from_disparity, renormalised},
    image::{View, ViewMut},
    volume::{NoStore, Observation, Viewpoint},
};

impl<'s> Instances<'s> {
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
            if !camera.known || track.chain == 0 || track.class().treatment() != Treatment::Reconstruct || detection.small == 1 {
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
