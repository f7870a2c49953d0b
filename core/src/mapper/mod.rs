//! The loop of the paper (Section III), one line per stage.

mod budget;
mod camera;
mod config;
mod digests;
mod error;
mod frame;
mod raycast;
mod report;
mod settings;
pub mod snapshot;
#[cfg(test)]
mod tests;

pub use budget::{BudgetError, BudgetOptions, CapacityProblem, MAX_SIDE};
pub use config::Config;
pub use digests::{Digested, ObjectDigest, ObjectDigests, StageDigests};
pub use error::{MIN_HEIGHT, MIN_WIDTH, NewError, StepError};
pub use frame::StereoFrame;
pub use report::{BlockCount, PoseOrigin, Report, Severity};
pub use settings::{MapperConfig, MotionSource};
pub use snapshot::RestoreError;

use crate::{
    Capacity, Executor, Footprint, Stage,
    egomotion::{Egomotion, Estimator, MotionEstimate},
    geometry::{StereoRig, Transform, depth_from_disparity},
    image::{View, ViewMut},
    memory::{Carver, region_bytes},
    objects::{NoSink, Object, ObjectFrame, ObjectSink, ObjectSummary, Objects, Picture},
    rectify::{Pair, RawCamera, RectifiedImages, Rectifier},
    scene_flow::{FlowMatcher, FlowStatus},
    state::Hasher,
    stereo::StereoMatcher,
    tracking::{CameraMotion, Seen, ThingAt, TrackReport, Tracker},
    view::{Raycaster, Triangle},
    volume::{AllocationReport, BlockStore, EvictionReport, NoStore, Observation, PruneReport, Viewpoint, Volume},
};

/// A stereo mapper in a slab.
#[derive(Debug)]
pub struct Mapper<'s> {
    config: Config,
    capacity: Capacity,
    rectifier: Rectifier<'s>,
    rectified: RectifiedImages<'s>,
    stereo: StereoMatcher<'s>,
    scene_flow: FlowMatcher<'s>,
    estimator: Estimator<'s>,
    camera: Egomotion,
    tracker: Tracker<'s>,
    objects: Objects<'s>,
    depth_m: &'s mut [f32],
    background: Volume<'s>,
    raycaster: Raycaster<'s>,
    /// Width and height of the frames, known from the first one on.
    size: Option<[usize; 2]>,
    frame: u32,
}

impl Capacity {
    /// Bytes of slab a mapper of this capacity needs.
    pub const fn bytes(&self) -> usize {
        StereoMatcher::bytes(self)
            + FlowMatcher::bytes(self)
            + Estimator::bytes(self)
            + Tracker::bytes(self)
            + Objects::bytes(self)
            + region_bytes::<f32>(self.pixels())
            + Volume::bytes(self)
            + Raycaster::bytes(self)
            + Rectifier::bytes(self)
            + RectifiedImages::bytes(self)
    }

    /// Every region a mapper of this capacity cuts out of its slab.
    pub fn footprint(&self) -> Footprint {
        let mut carver = Carver::without_slab();
        // Regions depend on the capacity alone: any rig will do.
        let rig = StereoRig { focal_px: 1.0, center_u_px: 0.0, center_v_px: 0.0, baseline_m: 1.0 };
        Mapper::new_in(self, &Config::for_rig(rig), &mut carver);
        carver.into_footprint()
    }
}

const MIB: usize = 1 << 20;
const _: () = assert!(Capacity::TINY.bytes() < 8 * MIB);
const _: () = assert!(Capacity::SMALL.bytes() < 64 * MIB);
const _: () = assert!(Capacity::ONBOARD.bytes() < 256 * MIB);
// A 32-bit machine cannot even name 2 GiB.
#[cfg(target_pointer_width = "64")]
const _: () = assert!(Capacity::DESKTOP.bytes() < 2048 * MIB);

impl<'s> Mapper<'s> {
    /// Makes a mapper in `slab`, which must hold at least `capacity.bytes()` from its first byte at a multiple of
    /// [`SLAB_ALIGN`](crate::memory::SLAB_ALIGN) on: `capacity.bytes() + SLAB_ALIGN` bytes are enough anywhere.
    ///
    /// # Errors
    /// The slab is too small, or the configuration is not usable.
    // Never inlined: what it needs of the stack must not stay in its caller's frame.
    #[inline(never)]
    pub fn new(capacity: &Capacity, config: &Config, slab: &'s mut [u8]) -> Result<Self, NewError> {
        if let Some(problem) = config.validate().first() {
            return Err(NewError::Config(*problem));
        }
        let mut carver = Carver::new(slab, capacity.bytes())?;
        let mut mapper = Self::new_in(capacity, config, &mut carver);
        carver.check()?;
        if let Some(rectification) = &config.rectification {
            mapper.rectifier.prepare(rectification, &config.rig).map_err(NewError::Rectification)?;
        }
        Ok(mapper)
    }

    fn new_in(capacity: &Capacity, config: &Config, carver: &mut Carver<'s>) -> Self {
        Self {
            config: *config,
            capacity: *capacity,
            stereo: StereoMatcher::new_in(capacity, carver),
            scene_flow: FlowMatcher::new_in(capacity, carver),
            estimator: Estimator::new_in(capacity, carver),
            camera: Egomotion::default(),
            tracker: Tracker::new_in(capacity, &config.instances, carver),
            objects: Objects::new_in(capacity, &config.instances.volume, carver),
            depth_m: carver.alloc("depth_m", capacity.pixels()),
            background: Volume::new_in(capacity, &config.volume, carver),
            raycaster: Raycaster::new_in(capacity, &config.raycast, carver),
            rectifier: Rectifier::new_in(capacity, carver),
            rectified: RectifiedImages::new_in(capacity, carver),
            size: None,
            frame: 0,
        }
    }

    /// Takes one frame: depth, motion, map. Never allocates, never panics; what could not be done is counted in the report. Blocks that
    /// must leave a full pool are lost, and counted.
    pub fn step<E: Executor>(&mut self, frame: &StereoFrame<'_>, executor: &E) -> Result<Report, StepError> {
        self.step_with(frame, executor, &mut NoStore, &mut NoSink)
    }

    /// As [`Mapper::step`], with a store that keeps the blocks that must leave and brings them back when they are seen again, and a sink
    /// for objects that leave.
    // Never inlined, so that a step's stack can be told from its caller's.
    #[inline(never)]
    pub fn step_with<E: Executor, S: BlockStore, O: ObjectSink>(
        &mut self,
        frame: &StereoFrame<'_>,
        executor: &E,
        store: &mut S,
        objects: &mut O,
    ) -> Result<Report, StepError> {
        let size = self.admit(frame)?;
        let input = frame.digest();
        // The rectified images are lent out for the step, so that the stages may read them while they change the mapper.
        let mut images = core::mem::take(&mut self.rectified);
        let raw = Pair { left: frame.left, right: frame.right, colour: frame.colour };
        let rectified = executor.stage(Stage::Rectify, || self.rectifier.rectify(&raw, &mut images, executor));
        let Pair { left, right, colour } = rectified.unwrap_or(raw);
        let rectification = self.rectifier.report(&Pair { left, right, colour });
        let frame = StereoFrame { left, right, colour, ..*frame };
        let report = self.step_rectified(&frame, size, executor, store, objects);
        self.rectified = images;
        Ok(report.with_input(input, rectification))
    }

    /// Takes a rectified frame that was admitted.
    fn step_rectified<E: Executor, S: BlockStore, O: ObjectSink>(
        &mut self,
        frame: &StereoFrame<'_>,
        [width, height]: [usize; 2],
        executor: &E,
        store: &mut S,
        objects: &mut O,
    ) -> Report {
        let (config, left, right) = (self.config, frame.left, frame.right);
        let invalid = self.rectifier.invalid();
        let invalid = invalid.as_ref();

        // (A) Depth from the pair, unless it is given, and (C.1) sparse scene flow over this pair and the last: neither needs the other.
        let (stereo, scene_flow) = executor.join(
            || {
                executor.stage(Stage::Stereo, || match frame.disparity_q8 {
                    Some(given) => self.stereo.take(given),
                    None => self.stereo.compute_within(&config.stereo, left, right, invalid, executor),
                })
            },
            || executor.stage(Stage::SceneFlow, || self.scene_flow.push_within(&config.scene_flow, left, right, invalid, executor)),
        );
        // (B) What a detector saw, joined to what is tracked, with the matches on it.
        executor.stage(Stage::Instances, || {
            self.tracker.admit(self.frame, frame.detections, [width, height]);
            self.tracker.claim(self.scene_flow.refined(), self.scene_flow.sparse());
        });
        // (C.2) The camera's own motion, from what does not move. The first frame's camera is the world.
        let matched = scene_flow.status == FlowStatus::Matched;
        let (pose, egomotion, icp) = executor.stage(Stage::Egomotion, || self.move_camera(frame, matched, [width, height], executor));
        let known = pose != PoseOrigin::Held;
        let fused = known && self.frame.is_multiple_of(config.mapper.fuse_every.max(1));
        let moved = matches!(pose, PoseOrigin::Estimated | PoseOrigin::Given).then(|| *self.camera.t_current_previous());
        let camera = CameraMotion { t_world_camera: *self.camera.t_world_camera(), t_current_previous: moved };
        // (D) The objects' motions.
        executor.stage(Stage::Instances, || {
            let seen = Seen {
                refined: self.scene_flow.refined(),
                sparse: self.scene_flow.sparse(),
                images: Some((&self.scene_flow, self.stereo.disparity_q8())),
            };
            self.tracker.follow(&config.rig, &seen, &camera, &mut self.estimator);
        });
        // (E) What the camera sees goes into the map, but for what might move, which has maps of its own; unless the pose is a guess
        // or the frame's turn has not come.
        let view = Viewpoint { rig: config.rig, width, height, t_world_camera: camera.t_world_camera };
        let allocation = if fused { self.fuse(frame, &view, executor, store) } else { AllocationReport::default() };
        executor.stage(Stage::Instances, || {
            let shown = ObjectFrame {
                rig: &config.rig,
                t_world_camera: &camera.t_world_camera,
                picture: Picture { grey: left, colour: frame.colour },
                disparity_q8: self.stereo.disparity_q8(),
            };
            self.objects.reconstruct(&self.tracker, fused.then_some(&shown), executor, objects);
            self.tracker.settle();
        });
        // (F) Noise last seen a fixed lag ago goes.
        let prune = if fused { executor.stage(Stage::Prune, || self.background.prune()) } else { PruneReport::default() };

        let digests = self.digests(egomotion.as_ref());
        let report = Report {
            frame: self.frame,
            t_world_camera: camera.t_world_camera,
            rectification: None,
            stereo,
            scene_flow,
            pose,
            egomotion,
            icp,
            instances: self.objects.report(self.tracker.report()),
            fused,
            allocation,
            prune,
            blocks: self.block_count(),
            digests,
            digest: digests.whole(self.frame),
        };
        self.frame += 1;
        report
    }

    /// Checks a frame against the capacity and the frames before.
    fn admit(&mut self, frame: &StereoFrame<'_>) -> Result<[usize; 2], StepError> {
        let given = [frame.left.width(), frame.left.height()];
        // Of the left image, of the right one, and of what comes out of them.
        let [left, right, size] = match self.rectifier.rectification() {
            None => [given; 3],
            Some(raw) => {
                let of = |camera: &RawCamera| [camera.width as usize, camera.height as usize];
                [of(&raw.left.raw), of(&raw.right.raw), [raw.width as usize, raw.height as usize]]
            }
        };
        if given != left {
            return Err(StepError::RawSizeDiffers { width: left[0], height: left[1] });
        }
        let same = |width: usize, height: usize| size == [width, height];
        let right = right == [frame.right.width(), frame.right.height()];
        let colour = frame.colour.is_none_or(|image| left == [image.width(), image.height()]);
        let class = frame.class.is_none_or(|image| same(image.width(), image.height()));
        let disparity = frame.disparity_q8.is_none_or(|image| same(image.width(), image.height()));
        if !(right && colour && class && disparity) {
            return Err(StepError::SizesDiffer);
        }
        if size[0] > self.capacity.image_width || size[1] > self.capacity.image_height {
            return Err(StepError::TooLarge { width: self.capacity.image_width, height: self.capacity.image_height });
        }
        if size[0] < MIN_WIDTH || size[1] < MIN_HEIGHT {
            return Err(StepError::TooSmall { width: MIN_WIDTH, height: MIN_HEIGHT });
        }
        if !frame.t_world_camera.is_none_or(|pose| pose.is_finite()) {
            return Err(StepError::PoseNotFinite);
        }
        if !frame.t_world_camera.is_none_or(|pose| pose.is_rotation()) {
            return Err(StepError::PoseNotRotation);
        }
        if self.size.is_some_and(|known| known != size) {
            return Err(StepError::SizeChanged);
        }
        self.size = Some(size);
        Ok(size)
    }

    /// Turns the disparity into depth, makes blocks around it and averages it in.
    fn fuse<E: Executor, S: BlockStore>(
        &mut self,
        frame: &StereoFrame<'_>,
        view: &Viewpoint,
        executor: &E,
        store: &mut S,
    ) -> AllocationReport {
        let Some(mut depth_m) = ViewMut::new(self.depth_m, view.width, view.height) else { return AllocationReport::default() };
        let volume = &self.config.volume;
        depth_from_disparity(&view.rig, volume.near_m, volume.far_m, self.stereo.disparity_q8(), &mut depth_m);
        self.tracker.clear(&mut depth_m);
        let seen = Observation {
            depth_m: depth_m.as_view(),
            grey: frame.left,
            colour: frame.colour,
            class: frame.class,
        };
        let allocation = executor.stage(Stage::Allocate, || self.background.allocate(view, seen.depth_m, store));
        executor.stage(Stage::Fuse, || self.background.fuse(view, seen, executor));
        allocation
    }

    /// Ends a drive: prunes what is still in the window. Objects are lost; see [`Mapper::finish_with`].
    pub fn finish(&mut self) -> PruneReport {
        self.finish_with(&mut NoSink)
    }

    /// As [`Mapper::finish`], with a sink for the objects there still are.
    pub fn finish_with<O: ObjectSink>(&mut self, objects: &mut O) -> PruneReport {
        self.objects.finish(objects);
        self.background.finish()
    }

    /// Where the left camera was in the last frame: camera to world; the identity before the first.
    pub fn t_world_camera(&self) -> &Transform {
        self.camera.t_world_camera()
    }

    /// What is tracked, as it stands after the last frame, by age.
    pub fn tracks(&self) -> impl Iterator<Item = TrackReport> + '_ {
        self.objects.tracks(&self.tracker)
    }

    /// What a pixel of the last frame shows; `None` for the street.
    pub fn thing_at(&self, u: i32, v: i32) -> Option<ThingAt> {
        self.tracker.at(u, v)
    }

    /// The objects reconstructed now, each with its own map.
    pub fn objects(&self) -> impl Iterator<Item = (&ObjectSummary, &Object<'s>)> {
        self.objects.objects()
    }

    /// Lets every block of the static map leave into `store`, so that the store holds the whole map.
    pub fn stream_out<S: BlockStore>(&mut self, store: &mut S) -> EvictionReport {
        self.background.stream_out(store)
    }

    fn block_count(&self) -> BlockCount {
        let pool = self.background.pool();
        BlockCount {
            used: pool.len() as u32,
            peak: pool.peak() as u32,
            capacity: pool.capacity() as u32,
            visible: self.background.visible().slots().len() as u32,
        }
    }

    /// Digests of what each stage made of a frame.
    fn digests(&mut self, egomotion: Option<&MotionEstimate>) -> StageDigests {
        StageDigests {
            input: 0,
            disparity: self.stereo.digest(),
            matches: self.scene_flow.digest(),
            egomotion: self.camera.digest(egomotion),
            tracks: self.tracks_digest(),
            background: self.background.digest(),
            objects: ObjectDigests::of(self.objects.digests().map(|(id, digest)| ObjectDigest { id, digest })),
        }
    }

    /// Digest of the tracks by age, their masks, and the crops that wait to be fused.
    fn tracks_digest(&mut self) -> u64 {
        Hasher::digest(|hasher| {
            self.tracker.visit(hasher);
            self.objects.visit_crops(hasher);
        })
    }

    /// The static map's triangles, one after the other, in world coordinates. How many there were.
    pub fn triangles(&self, sink: &mut impl FnMut(Triangle)) -> u64 {
        self.background.triangles(&self.config.mesh, sink)
    }

    /// The static map.
    pub fn background(&self) -> &Volume<'s> {
        &self.background
    }

    /// Left and right grey image of the last frame as they were rectified; `None` where pairs come rectified.
    pub fn rectified_pair(&self) -> Option<[View<'_, u8>; 2]> {
        self.rectifier.grey(&self.rectified)
    }

    /// Disparity of the last frame, 1/256 px, 0 none.
    pub fn disparity_q8(&self) -> View<'_, u16> {
        self.stereo.disparity_q8()
    }

    /// Every region of the slab, with its use now and at most.
    pub fn footprint(&self) -> Footprint {
        let mut footprint = self.capacity.footprint();
        self.background.note_use(&mut footprint);
        self.tracker.note_use(&mut footprint);
        self.objects.note_use(&mut footprint);
        self.raycaster.note_use(&mut footprint);
        footprint
    }
}
