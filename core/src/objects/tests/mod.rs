//! Stories of instances, on scenes of points with closed answers.

mod detections;
mod full;
mod gaps;
mod guided_matching;
mod masks;
mod matches;
mod motions;
mod objects;
mod settings;
mod tracks;
mod volumes;

use super::*;
use crate::{
    Serial,
    egomotion::Estimator,
    geometry::{StereoRig, Transform},
    image::{View, ViewMut},
    masks::{MaskStore, PixelBox, ScaledMask},
    memory::SLAB_ALIGN,
    random::Random,
    scene_flow::Match,
    segmentation::SegmentationReport,
    tracking::{
        CameraMotion, Class, Detection, DetectionCount, FrameMatches, GuidedMatching, InstanceAt,
        InstancesConfig, MotionConfig, MotionEvidence, MotionState, Overlap, StateConfig,
        TrackCount, TrackReport, Tracker, TrackingConfig,
        tests::{MAX_GUIDED_MATCHES, MatchOwner, step_px},
    },
};
use nalgebra::{Point3, Vector3};
use std::{vec, vec::Vec};

pub(super) const WIDTH: usize = 400;
pub(super) const HEIGHT: usize = 120;
pub(super) const RIG: StereoRig =
    StereoRig { focal_px: 300.0, center_u_px: 200.0, center_v_px: 60.0, baseline_m: 0.5 };
pub(super) const CAPACITY: Capacity = Capacity {
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

/// Objects that were handed to a sink.
#[derive(Default)]
pub(super) struct Retired(pub Vec<(ObjectSummary, Retirement, usize)>);

impl ObjectSink for Retired {
    fn retire(&mut self, object: RetiredObject<'_, '_>) {
        self.0.push((object.summary, object.reason, object.volume.pool().len()));
    }
}

/// Tracker and objects as a mapper has them.
pub(super) struct Instances<'s> {
    pub tracker: Tracker<'s>,
    pub objects: Objects<'s>,
}

impl<'s> Instances<'s> {
    const fn bytes(capacity: &Capacity) -> usize {
        Tracker::bytes(capacity) + Objects::bytes(capacity)
    }

    fn new_in(capacity: &Capacity, config: &TrackingConfig, carver: &mut Carver<'s>) -> Self {
        Self {
            tracker: Tracker::new_in(capacity, config, carver),
            objects: Objects::new_in(capacity, &ObjectsConfig::default(), carver),
        }
    }

    pub fn ingest(&mut self, frame: u32, detections: &[Detection<'_>], size: [usize; 2]) {
        self.ingest_with(frame, detections, size, [&[], &[]]);
    }

    pub fn ingest_with(
        &mut self,
        frame: u32,
        detections: &[Detection<'_>],
        size: [usize; 2],
        [refined, sparse]: [&[Match]; 2],
    ) {
        self.tracker.test_ingest(frame, detections, size, FrameMatches { refined, sparse });
    }

    pub fn assign_matches(&mut self, refined: &[Match], sparse: &[Match]) {
        self.tracker.test_assign_matches(FrameMatches { refined, sparse });
    }

    pub fn mask_dynamic_depth(&mut self, depth_m: &mut ViewMut<'_, f32>) {
        self.tracker.test_mask_dynamic_depth(depth_m);
    }

    /// Reconstructs and ends the frame.
    pub fn reconstruct(
        &mut self,
        frame: Option<&ObjectFrame<'_>>,
        sink: &mut impl ObjectSink,
    ) -> InstancesReport {
        let tracked = self.tracker.test_tracked();
        self.objects.reconstruct(&tracked, frame, &Serial, sink);
        InstancesReport::of(
            &tracked.commit(),
            SegmentationReport::default(),
            self.objects.report(),
            0,
        )
    }

    pub fn finish(&mut self, sink: &mut impl ObjectSink) -> u32 {
        self.objects.finish(sink)
    }

    pub fn report(&self) -> InstancesReport {
        InstancesReport::of(
            &self.tracker.test_report(),
            SegmentationReport::default(),
            self.objects.report(),
            0,
        )
    }

    pub fn tracks(&self) -> impl Iterator<Item = TrackReport> {
        self.objects.tracks(&self.tracker)
    }

    pub fn objects(&self) -> impl Iterator<Item = (&ObjectSummary, &Object<'s>)> {
        self.objects.objects()
    }

    pub fn posed(&self) -> impl Iterator<Item = PosedObject<'_, 's>> {
        self.objects.posed(&self.tracker)
    }

    pub fn instance_at(&self, u: i32, v: i32) -> Option<InstanceAt> {
        self.tracker.instance_at(u, v)
    }

    fn digest(&mut self) -> u64 {
        let mut hasher = crate::state::Hasher::default();
        self.tracker.visit(&mut hasher);
        self.objects.visit_crops(&mut hasher);
        hasher.0.finish()
    }
}

/// Calls `run` with instances and an estimator in a slab.
pub(super) fn with<R>(
    capacity: &Capacity,
    config: &TrackingConfig,
    run: impl FnOnce(&mut Instances<'_>, &mut Estimator<'_>) -> R,
) -> R {
    let bytes = Instances::bytes(capacity) + Estimator::bytes(capacity);
    let mut slab = vec![0u8; bytes + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut carver = Carver::new(&mut slab[start..start + bytes], bytes).unwrap();
    let mut instances = Instances::new_in(capacity, config, &mut carver);
    assert_eq!(
        carver.footprint().bytes(),
        Instances::bytes(capacity),
        "the formula is what is allocated"
    );
    let mut estimator = Estimator::new_in(capacity, &mut carver);
    run(&mut instances, &mut estimator)
}

/// A rectangle of points that faces the camera.
pub(super) struct Board {
    pub class: Class,
    pub score: f32,
    /// Half its width and height, m.
    pub half_m: [f64; 2],
    pub points: usize,
    /// Number of points, from the first, that stand still instead, like background under the mask.
    pub background: usize,
}

impl Board {
    pub const CAR: Self =
        Self { class: Class::Car, score: 0.9, half_m: [1.5, 0.75], points: 60, background: 0 };
}

pub(super) fn shift(x: f64, y: f64, z: f64) -> Transform {
    Transform::new(Vector3::zeros(), Vector3::new(x, y, z))
}

fn project(p: &Point3<f64>) -> [[f32; 2]; 2] {
    let per_m = RIG.focal_px / p.z;
    let (u, v) = (p.x * per_m + RIG.center_u_px, p.y * per_m + RIG.center_v_px);
    [[u as f32, v as f32], [(u - RIG.focal_px * RIG.baseline_m / p.z) as f32, v as f32]]
}

/// A run past boards, frame by frame.
pub(super) struct Run<'i, 's, 't> {
    pub instances: &'i mut Instances<'s>,
    pub estimator: &'i mut Estimator<'t>,
    pub frame: u32,
    pub t_world_camera: Transform,
    /// True if the camera's pose is known rather than extrapolated.
    pub known: bool,
    pub sink: Retired,
    before: Vec<Option<Transform>>,
}

impl<'i, 's, 't> Run<'i, 's, 't> {
    pub fn new(instances: &'i mut Instances<'s>, estimator: &'i mut Estimator<'t>) -> Self {
        Self {
            instances,
            estimator,
            frame: 0,
            t_world_camera: Transform::IDENTITY,
            known: true,
            sink: Retired::default(),
            before: Vec::new(),
        }
    }

    /// Takes a frame: the camera's pose, and that of each board (`None`: not seen).
    pub fn step(
        &mut self,
        t_world_camera: Transform,
        boards: &[(&Board, Option<Transform>)],
    ) -> InstancesReport {
        self.step_behind(t_world_camera, boards, &[])
    }

    /// Steps with boards in front that the detector does not report.
    pub fn step_behind(
        &mut self,
        t_world_camera: Transform,
        seen: &[(&Board, Option<Transform>)],
        unseen: &[(&Board, Option<Transform>)],
    ) -> InstancesReport {
        let boards: Vec<_> = seen.iter().chain(unseen).copied().collect();
        let t_current_previous = t_world_camera.inverse() * self.t_world_camera;
        self.before.resize(boards.len(), None);
        let (mut matches, mut disparity) = (Vec::new(), vec![0u16; WIDTH * HEIGHT]);
        let mut owned: Vec<(Class, f32, PixelBox, Vec<u8>)> = Vec::new();
        for (index, ((board, now), before)) in boards.iter().zip(&self.before).enumerate() {
            let Some(now) = now else { continue };
            let camera_board = t_world_camera.inverse() * now;
            let [half_x, half_y] = board.half_m;
            let corner =
                |x: f64, y: f64| project(&camera_board.transform_point(Point3::new(x, y, 0.0)))[0];
            let ([l, t], [r, b]) = (corner(-half_x, -half_y), corner(half_x, half_y));
            let pixels = PixelBox {
                left: l as i32,
                top: t as i32,
                width: (r - l) as i32,
                height: (b - t) as i32,
            };
            let depth = camera_board.translation().z;
            for v in pixels.top.max(0)..(pixels.top + pixels.height).min(HEIGHT as i32) {
                for u in pixels.left.max(0)..(pixels.left + pixels.width).min(WIDTH as i32) {
                    disparity[v as usize * WIDTH + u as usize] =
                        (RIG.focal_px * RIG.baseline_m / depth * 256.0) as u16;
                }
            }
            if index < seen.len() {
                owned.push((board.class, board.score, pixels, vec![1; pixels.area() as usize]));
            }
            let Some(before) = before else { continue };
            let mut random = Random::new(9);
            for n in 0..board.points {
                let mut along =
                    |half: f64| (f64::from(random.below(1001)) / 500.0 - 1.0) * half * 0.9;
                // Not all in one plane.
                let point = Point3::new(along(half_x), along(half_y), along(0.8));
                let after = if n < board.background {
                    before.transform_point(point)
                } else {
                    now.transform_point(point)
                };
                let [previous_left, previous_right] =
                    project(&(self.t_world_camera.inverse() * before).transform_point(point));
                let [current_left, current_right] =
                    project(&t_world_camera.inverse().transform_point(after));
                matches.push(Match { previous_left, previous_right, current_left, current_right });
            }
        }
        let detections: Vec<_> = owned
            .iter()
            .map(|(class, score, pixels, mask)| detection(*class, *score, pixels, mask))
            .collect();
        let camera = CameraMotion {
            t_world_camera,
            t_current_previous: (self.frame > 0).then_some(t_current_previous),
        };
        self.instances.ingest(self.frame, &detections, [WIDTH, HEIGHT]);
        self.instances.assign_matches(&matches, &[]);
        let matches = FrameMatches { refined: &matches, sparse: &[] };
        self.instances.tracker.test_estimate_motions(&RIG, &camera, matches, None, self.estimator);
        let grey = vec![128u8; WIDTH * HEIGHT];
        let picture = Picture { grey: View::new(&grey, WIDTH, HEIGHT).unwrap(), colour: None };
        let disparity = View::new(&disparity, WIDTH, HEIGHT).unwrap();
        let shown = ObjectFrame {
            rig: &RIG,
            t_world_camera: &t_world_camera,
            picture,
            disparity_q8: disparity,
        };
        self.instances.reconstruct(self.known.then_some(&shown), &mut self.sink);
        self.frame += 1;
        self.t_world_camera = t_world_camera;
        self.before = boards.iter().map(|(_, now)| *now).collect();
        self.instances.report()
    }

    pub fn track(&self, id: u32) -> Option<TrackReport> {
        self.instances.tracks().find(|track| track.id == id)
    }
}

pub(super) fn detection<'a>(
    class: Class,
    score: f32,
    pixels: &PixelBox,
    mask: &'a [u8],
) -> Detection<'a> {
    let &PixelBox { left, top, width, height } = pixels;
    Detection { class, score, left, top, width: width as u32, height: height as u32, mask }
}

/// Takes a frame of a camera that stands: detections and matches as they are given, and no depth.
pub(super) fn take_frame(
    instances: &mut Instances<'_>,
    estimator: &mut Estimator<'_>,
    frame: u32,
    detections: &[Detection<'_>],
    [refined, sparse]: [&[Match]; 2],
) {
    let camera = CameraMotion {
        t_world_camera: Transform::IDENTITY,
        t_current_previous: (frame > 0).then_some(Transform::IDENTITY),
    };
    instances.ingest_with(frame, detections, [WIDTH, HEIGHT], [refined, sparse]);
    instances.assign_matches(refined, sparse);
    instances.tracker.test_estimate_motions(
        &RIG,
        &camera,
        FrameMatches { refined, sparse },
        None,
        estimator,
    );
    let (grey, nothing) = (vec![128u8; WIDTH * HEIGHT], vec![0u16; WIDTH * HEIGHT]);
    let picture = Picture { grey: View::new(&grey, WIDTH, HEIGHT).unwrap(), colour: None };
    let disparity_q8 = View::new(&nothing, WIDTH, HEIGHT).unwrap();
    let shown =
        ObjectFrame { rig: &RIG, t_world_camera: &camera.t_world_camera, picture, disparity_q8 };
    instances.reconstruct(Some(&shown), &mut NoSink);
}

/// No detection is too small.
pub(super) fn any_size() -> TrackingConfig {
    let instances = InstancesConfig { area_min_px: 0, ..InstancesConfig::default() };
    TrackingConfig { instances, ..TrackingConfig::default() }
}

/// Returns a configuration in which standing takes as long to confirm as moving: either is known in
/// the fourth frame.
pub(super) fn known_in_the_fourth_frame() -> TrackingConfig {
    let state = StateConfig { confirm_static_frames: 3, ..StateConfig::default() };
    TrackingConfig { state, ..any_size() }
}

impl Objects<'_> {
    /// Flips a bit of a voxel of the first object with a volume; its id.
    pub(crate) fn flip_voxel(&mut self, voxel: usize, bit: u32) -> Option<u32> {
        let object = self.volumes.objects.iter_mut().find(|object| object.summary.is_some())?;
        let slot = object.volume.pool().live().next()?;
        object.volume.flip(slot, voxel, bit);
        object.summary.map(|summary| summary.id)
    }
}
