//! The static map: fusion of a frame into it, and its picture from a pose.

use super::{Config, matched::MatchedFrame};
use crate::{
    Capacity, Executor, Stage,
    egomotion::icp::{self, IcpConfig, IcpReport, MapPicture, MeasuredDepth},
    geometry::{GroundPlane, MapSegment, Transform},
    image::ViewMut,
    memory::{Carver, region_bytes},
    places::Places,
    segmentation::{MotionSegmenter, Present},
    state::Visitor,
    tracking::{CameraMotion, Tracked},
    view::{RaycastError, RaycastReport, Raycaster},
    volume::{
        AllocationReport, BLOCK_SIDE, BlockStore, DepthImage, FusedBlocks, NotedDepth, Observation,
        ObservedDepth, PruneReport, Viewpoint, Volume, submaps::SubmapCamera,
    },
};
use bytemuck::TransparentWrapper;

/// Work of a step on the map.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MapWork {
    /// Pixels of pictures taken of the map.
    pub cast_pixels: u64,
    /// Blocks the frame was fused into; `None` where it was not fused.
    pub fused: Option<FusedBlocks>,
    /// Blocks that pruning would have visited without a budget.
    pub prune_deferred: u32,
}

/// Map of all that does not move, and the images in which a frame meets it.
#[derive(Debug)]
pub(super) struct StaticMap<'s> {
    pub volume: Volume<'s>,
    /// Depth of the frame that is fused, m, without what moves or may move. Until then it is
    /// scratch for ICP's pyramid.
    depth_m: &'s mut [f32],
    pub raycaster: Raycaster<'s>,
    /// Work of this step so far.
    work: MapWork,
}

impl<'s> StaticMap<'s> {
    /// Bytes of the slab.
    pub const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<f32>(capacity.pixels())
            + Volume::bytes(capacity)
            + Raycaster::bytes(capacity)
    }

    /// Bytes of it that belong in large memory.
    pub const fn cold_bytes(capacity: &Capacity) -> usize {
        Volume::cold_bytes(capacity) + Raycaster::bytes(capacity)
    }

    /// Allocates an empty map.
    pub fn new_in(capacity: &Capacity, config: &Config, carver: &mut Carver<'s>) -> Self {
        Self {
            depth_m: carver.alloc("depth_m", capacity.pixels()),
            volume: Volume::new_in(capacity, &config.volume, carver),
            raycaster: Raycaster::new_in(capacity, &config.raycast, carver),
            work: MapWork::default(),
        }
    }

    /// Visits what lives from frame to frame.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        // Both images and the counts belong to one frame.
        let Self { volume, depth_m: _, raycaster: _, work: _ } = self;
        volume.visit(visitor);
    }

    /// Erases what moving objects left before they were known to move. Returns how many voxels.
    pub fn erase_trails(
        &mut self,
        camera: &CameraMotion,
        segmenter: &mut MotionSegmenter<'_>,
    ) -> u32 {
        let mut erased = 0;
        segmenter.take_trails(&camera.t_world_camera, |trail| {
            erased +=
                trail.boxes().map(|before| self.volume.erase(&before, trail.frames())).sum::<u32>();
        });
        erased
    }

    /// Turns the disparity into depth, and removes what moves or may move.
    pub fn take_depth<E: Executor>(
        &mut self,
        seen: &MatchedFrame<'_, '_>,
        tracked: &mut Tracked<'_, '_>,
        executor: &E,
    ) {
        let (width, height) = (seen.frame.left.width(), seen.frame.left.height());
        let noted = NotedDepth::wrap_slice_mut(self.depth_m);
        let Some(mut depths) = ViewMut::new(noted, width, height) else {
            debug_assert!(false, "the depth image has the capacity's size");
            return;
        };
        let observed = ObservedDepth {
            config: &seen.config.volume,
            rig: &seen.config.scaled_rig(),
            disparity_q8: seen.disparity_q8,
        };
        executor.stage(Stage::Fuse, || observed.write(&mut depths, executor));
        // After all pixels have depth: objects are removed from it, and not allocated.
        let mut depth_m = depths.peeled_mut();
        executor.stage(Stage::Tracking, || tracked.mask_dynamic_depth(&mut depth_m));
    }

    /// Removes from the depth that was taken what stands where earlier frames saw through, if
    /// moving objects are searched for. Returns how many pixels that are.
    // Never inlined: its locals must not stay in a step's frame.
    #[inline(never)]
    pub fn remove_come(
        &mut self,
        seen: &MatchedFrame<'_, '_>,
        t_world_camera: &Transform,
        ground: Option<&GroundPlane>,
        segmenter: &mut MotionSegmenter<'_>,
    ) -> u32 {
        let config = seen.config;
        let [width, height] = seen.size();
        let depth_m = ViewMut::new(self.depth_m, width, height);
        let searches = config.tracking.dynamic && config.segmentation.enabled;
        let Some(mut depth_m) = depth_m.filter(|_| searches) else { return 0 };
        let present = Present {
            rig: &config.scaled_rig(),
            t_world_camera,
            disparity_q8: seen.disparity_q8,
            ground,
            far_m: config.volume.far_m.into(),
        };
        segmenter.remove_come(&present, &mut depth_m)
    }

    /// Moves the map's submaps where loops moved keyframes in this frame.
    pub fn close_loops(&mut self, places: &Places<'_>) {
        if places.has_moved() {
            self.volume.close(places.closing_by_frame());
        }
    }

    /// Takes the camera of the frame that is fused next: a submap of the map may begin with it.
    pub fn advance_submaps(
        &mut self,
        seen: &MatchedFrame<'_, '_>,
        camera: &CameraMotion,
        places: &Places<'_>,
    ) {
        self.volume.advance_submaps(&SubmapCamera {
            frame: seen.number,
            t_world_camera: &camera.t_world_camera,
            t_closed_driven: places.newest_closing(self.volume.segment()),
        });
    }

    /// Allocates blocks around the depth that was taken, and averages it in.
    pub fn fuse<E: Executor, S: BlockStore>(
        &mut self,
        seen: &MatchedFrame<'_, '_>,
        camera: &CameraMotion,
        executor: &E,
        store: &mut S,
    ) -> AllocationReport {
        let view = seen.view(&camera.t_world_camera);
        let noted = NotedDepth::wrap_slice_mut(self.depth_m);
        let Some(depths) = ViewMut::new(noted, view.width, view.height) else {
            return AllocationReport::default();
        };
        let observation = Observation {
            depth: DepthImage::Noted(depths.as_view()),
            grey: seen.frame.left,
            colour: seen.frame.colour,
            class: seen.frame.class,
        };
        // Blocks first, so that fusion finds every block that the frame observes.
        let allocation = executor.stage(Stage::Allocate, || {
            self.volume.allocate(&view, observation.depth.depth_m(), store, executor)
        });
        // Nearest blocks first, where the budget does not suffice for all.
        let most = seen.config.mapper.budget_of(self.volume.visible().capacity());
        self.work.fused = executor.stage(Stage::Fuse, || {
            Some(self.volume.fuse_nearest(&view, observation, most, executor))
        });
        allocation
    }

    /// Returns true if the depth taken last shows a surface that is fused: of its first `pixels`
    /// values one is above 0 and not too far.
    pub fn has_depth(&self, pixels: usize) -> bool {
        let far_m = self.volume.config().far_m;
        self.depth_m.iter().take(pixels).any(|&depth_m| depth_m > 0.0 && depth_m <= far_m)
    }

    /// Looks at the map from a pose; whether that could be done.
    pub fn cast<E: Executor>(&mut self, view: &Viewpoint, executor: &E) -> bool {
        self.work.cast_pixels += (view.width * view.height) as u64;
        self.raycaster.cast(&self.volume, view, executor).is_ok()
    }

    /// Prunes what is due, as far as the budget goes.
    pub fn prune(&mut self, config: &Config) -> PruneReport {
        let bound = config.volume.prune_blocks_per_frame.min(self.volume.pool().capacity() as u32);
        let most = config.mapper.budget_of(bound as usize) as u32;
        let report = self.volume.prune_within(most);
        self.work.prune_deferred =
            (report.carried_over + report.visited).min(bound) - report.visited;
        report
    }

    /// Depth within which every visible block was fused in this step, m; the largest float where
    /// nothing was left out.
    pub fn fused_within_m(&self) -> f32 {
        let block_m = self.volume.config().voxel_size_m * BLOCK_SIDE as f32;
        match self.work.fused {
            // A block reaches less than its side before its middle.
            Some(fused) if fused.deferred > 0 => fused.within_m as f32 - block_m,
            _ => f32::MAX,
        }
    }

    /// Work since this was asked last.
    pub fn take_work(&mut self) -> MapWork {
        core::mem::take(&mut self.work)
    }

    /// Looks at a segment of the map from a pose in it.
    pub fn cast_segment<E: Executor>(
        &mut self,
        segment: MapSegment,
        view: &Viewpoint,
        executor: &E,
    ) -> Result<RaycastReport, RaycastError> {
        let current = self.volume.segment();
        // For this look only: the next frame belongs to the camera's own segment.
        self.volume.enter_segment(segment);
        let report = self.raycaster.cast(&self.volume, view, executor);
        self.volume.enter_segment(current);
        report
    }

    /// Registers a frame's depth with the map as it was cast last, of every so many pixels.
    pub fn register(
        &mut self,
        seen: &MatchedFrame<'_, '_>,
        config: &IcpConfig,
        every: usize,
    ) -> IcpReport {
        let (Some(depth_m), Some(normal)) = (self.raycaster.depth_m(), self.raycaster.normal())
        else {
            return IcpReport::unpaired();
        };
        let volume = &seen.config.volume;
        let measured = MeasuredDepth {
            rig: &seen.config.scaled_rig(),
            limits_m: [volume.near_m, volume.far_m],
            disparity_q8: seen.disparity_q8,
        };
        icp::track(config, &measured, &MapPicture { depth_m, normal, every }, self.depth_m)
    }
}
