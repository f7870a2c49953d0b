//! Harness: a tracker in a slab, and scenes of boards with closed answers.

mod report;
mod scene;
mod settings;

pub(crate) use super::{
    CameraMotion, Class, Detection, DetectionCount, FrameMatches, InstancesConfig, MatchOwner,
    MotionState, StateConfig, TrackReport, Tracker, TrackingConfig, TracksConfig,
};
pub(crate) use crate::{
    egomotion::Estimator,
    geometry::{StereoRig, Transform},
    masks::{MaskStore, PixelBox},
    memory::{Capacity, Carver},
    random::Random,
    scene_flow::Match,
};
pub(crate) use nalgebra::{Point3, Vector3};
pub(crate) use scene::{Board, Scene, Shot, ahead, parked, project, shift};

use crate::{memory::SLAB_ALIGN, state::Hasher};
use std::vec;

pub(crate) const WIDTH: usize = 400;
pub(crate) const HEIGHT: usize = 120;
pub(crate) const RIG: StereoRig =
    StereoRig { focal_px: 300.0, center_u_px: 200.0, center_v_px: 60.0, baseline_m: 0.5 };
pub(crate) const CAPACITY: Capacity = Capacity {
    image_width: WIDTH,
    image_height: HEIGHT,
    detections: 4,
    mask_words: 2_000,
    tracks: 4,
    objects: 2,
    object_blocks: 400,
    crop_pixels: 40_000,
    ..Capacity::TINY
};

/// Calls `run` with a tracker and an estimator in a slab.
pub(crate) fn with<R>(
    capacity: &Capacity,
    config: &TrackingConfig,
    run: impl FnOnce(&mut Tracker<'_>, &mut Estimator<'_>) -> R,
) -> R {
    let bytes = Tracker::bytes(capacity) + Estimator::bytes(capacity);
    let mut slab = vec![0u8; bytes + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut carver = Carver::new(&mut slab[start..start + bytes], bytes).unwrap();
    let mut tracker = Tracker::new_in(capacity, config, &mut carver);
    let allocated = carver.footprint().bytes();
    assert_eq!(allocated, Tracker::bytes(capacity), "the formula is what is allocated");
    let mut estimator = Estimator::new_in(capacity, &mut carver);
    run(&mut tracker, &mut estimator)
}

/// Every pixel of a box of at most 60 by 60 px.
pub(crate) const MASK: [u8; 3600] = [1; 3600];

/// A car of 60 by 60 px.
pub(crate) fn car(left: i32) -> Detection<'static> {
    detection(Class::Car, 0.9, &pixels(left, 30, 60, 60), &MASK)
}

pub(crate) fn pixels(left: i32, top: i32, width: i32, height: i32) -> PixelBox {
    PixelBox { left, top, width, height }
}

/// A run past boards, frame by frame.
pub(crate) struct Run<'t, 's, 'e> {
    pub tracker: &'t mut Tracker<'s>,
    estimator: &'t mut Estimator<'e>,
    scene: Scene,
}

impl<'t, 's, 'e> Run<'t, 's, 'e> {
    pub fn new(tracker: &'t mut Tracker<'s>, estimator: &'t mut Estimator<'e>) -> Self {
        Self { tracker, estimator, scene: Scene::default() }
    }

    /// Takes a frame: the camera's pose, and that of each board (`None`: not seen).
    pub fn step(&mut self, t_world_camera: Transform, boards: &[(&Board, Option<Transform>)]) {
        self.step_behind(t_world_camera, boards, &[]);
    }

    /// Steps with boards in front that the detector does not report.
    pub fn step_behind(
        &mut self,
        t_world_camera: Transform,
        seen: &[(&Board, Option<Transform>)],
        unseen: &[(&Board, Option<Transform>)],
    ) {
        let shot = self.scene.shoot(t_world_camera, seen, unseen);
        let assigned = self
            .tracker
            .detect(shot.frame, &shot.detections(), [WIDTH, HEIGHT], shot.matches())
            .assign_matches();
        assigned.estimate_motions(&RIG, &shot.camera, None, self.estimator).commit();
    }

    pub fn track(&self, id: u32) -> Option<TrackReport> {
        self.tracker.tracks().find(|track| track.id == id)
    }
}

pub(crate) fn detection<'a>(
    class: Class,
    score: f32,
    pixels: &PixelBox,
    mask: &'a [u8],
) -> Detection<'a> {
    let &PixelBox { left, top, width, height } = pixels;
    Detection { class, score, left, top, width: width as u32, height: height as u32, mask }
}

/// Takes a frame of a camera that stands: detections and matches as they are given.
pub(crate) fn take_frame(
    tracker: &mut Tracker<'_>,
    estimator: &mut Estimator<'_>,
    frame: u32,
    detections: &[Detection<'_>],
    [refined, sparse]: [&[Match]; 2],
) {
    let camera = CameraMotion {
        t_world_camera: Transform::IDENTITY,
        t_current_previous: (frame > 0).then_some(Transform::IDENTITY),
    };
    let matches = FrameMatches { refined, sparse };
    let assigned = tracker.detect(frame, detections, [WIDTH, HEIGHT], matches).assign_matches();
    assigned.estimate_motions(&RIG, &camera, None, estimator).commit();
}

/// Validates a frame's detections and associates them with tracks.
pub(crate) fn ingest(
    tracker: &mut Tracker<'_>,
    frame: u32,
    detections: &[Detection<'_>],
    size: [usize; 2],
) {
    let _ = tracker.detect(frame, detections, size, FrameMatches::default());
}

/// Assigns matches to the instances of the frame.
pub(crate) fn assign(tracker: &mut Tracker<'_>, refined: &[Match], sparse: &[Match]) {
    tracker.assign_matches(&FrameMatches { refined, sparse });
}

/// Owner of the refined match at that position.
pub(crate) fn match_owner(tracker: &Tracker<'_>, at: usize) -> MatchOwner {
    tracker.matches.match_owners()[0][at].get()
}

/// Digest of what outlives a frame.
pub(crate) fn digest(tracker: &mut Tracker<'_>) -> u64 {
    Hasher::digest(|hasher| tracker.visit(hasher))
}

/// No detection is too small.
pub(crate) fn any_size() -> TrackingConfig {
    let instances = InstancesConfig { area_min_px: 0, ..InstancesConfig::default() };
    TrackingConfig { instances, ..TrackingConfig::default() }
}

/// Every detection is too small to be reconstructed, and none to be tracked.
pub(crate) fn tracked_only() -> TrackingConfig {
    let instances = InstancesConfig {
        area_min_px: 1_000_000,
        track_area_min_px: 0,
        ..InstancesConfig::default()
    };
    TrackingConfig { instances, ..TrackingConfig::default() }
}

impl Tracker<'_> {
    /// Flips the lowest bit of a track's pose.
    pub(crate) fn flip_track(&mut self, at: usize) {
        let number = &mut self.tracks.all_mut()[at].t_world_object.translation_m[0];
        *number = f64::from_bits(number.to_bits() ^ 1);
    }
}
