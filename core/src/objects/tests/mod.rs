//! Stories of instances, on scenes of points with closed answers.

mod full;
mod gaps;
mod objects;
mod settings;
mod volumes;

use super::*;
use crate::{Serial, image::View, memory::SLAB_ALIGN, tracking::tests::*};
use std::{vec, vec::Vec};

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

    /// Takes a frame: tracks what the scene shows, and reconstructs it unless the camera's pose is
    /// extrapolated.
    pub fn take(
        &mut self,
        shot: &Shot,
        known: bool,
        estimator: &mut Estimator<'_>,
        sink: &mut impl ObjectSink,
    ) -> ObjectsReport {
        let grey = vec![128u8; WIDTH * HEIGHT];
        let frame_of_objects = ObjectFrame {
            rig: &RIG,
            t_world_camera: &shot.camera.t_world_camera,
            picture: Picture { grey: View::new(&grey, WIDTH, HEIGHT).unwrap(), colour: None },
            disparity_q8: View::new(&shot.disparity_q8, WIDTH, HEIGHT).unwrap(),
        };
        let detections = shot.detections();
        let detected =
            self.tracker.detect(shot.frame, &detections, [WIDTH, HEIGHT], shot.matches());
        let tracked =
            detected.assign_matches().estimate_motions(&RIG, &shot.camera, None, estimator);
        let shown = known.then_some(&frame_of_objects);
        self.objects.reconstruct(&tracked, shown, &Serial, sink);
        tracked.commit();
        self.objects.report()
    }

    pub fn finish(&mut self, sink: &mut impl ObjectSink) -> u32 {
        self.objects.finish(sink)
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

/// A run past boards, frame by frame.
pub(super) struct Run<'i, 's, 't> {
    pub instances: &'i mut Instances<'s>,
    pub estimator: &'i mut Estimator<'t>,
    scene: Scene,
    /// True if the camera's pose is known rather than extrapolated.
    pub known: bool,
    pub sink: Retired,
}

impl<'i, 's, 't> Run<'i, 's, 't> {
    pub fn new(instances: &'i mut Instances<'s>, estimator: &'i mut Estimator<'t>) -> Self {
        let (scene, sink) = (Scene::default(), Retired::default());
        Self { instances, estimator, scene, known: true, sink }
    }

    /// Takes a frame: the camera's pose, and that of each board (`None`: not seen).
    pub fn step(
        &mut self,
        t_world_camera: Transform,
        boards: &[(&Board, Option<Transform>)],
    ) -> ObjectsReport {
        self.step_behind(t_world_camera, boards, &[])
    }

    /// Steps with boards in front that the detector does not report.
    pub fn step_behind(
        &mut self,
        t_world_camera: Transform,
        seen: &[(&Board, Option<Transform>)],
        unseen: &[(&Board, Option<Transform>)],
    ) -> ObjectsReport {
        let shot = self.scene.shoot(t_world_camera, seen, unseen);
        self.instances.take(&shot, self.known, self.estimator, &mut self.sink)
    }

    pub fn track(&self, id: u32) -> Option<TrackReport> {
        self.instances.tracks().find(|track| track.id == id)
    }
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
