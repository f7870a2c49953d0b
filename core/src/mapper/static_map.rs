//! Fusion of a frame into the static map.

use super::{Config, StereoFrame};
use crate::{
    Executor, Stage,
    image::{View, ViewMut},
    tracking::{CameraMotion, Tracked},
    volume::{
        AllocationReport, BlockStore, DepthImage, NotedDepth, Observation, ObservedDepth,
        Viewpoint, Volume,
    },
};
use bytemuck::TransparentWrapper;

/// The parts of a mapper that fuse a frame into the static map.
pub(super) struct StaticMap<'m, 's> {
    pub config: &'m Config,
    pub disparity_q8: View<'m, u16>,
    pub background: &'m mut Volume<'s>,
    pub depth_m: &'m mut [f32],
}

impl StaticMap<'_, '_> {
    /// Erases what moving objects left before they were known to move. Returns how many voxels.
    pub fn erase_trails(&mut self, camera: &CameraMotion, tracked: &mut Tracked<'_, '_>) -> u32 {
        let mut erased = 0;
        tracked.take_trails(&camera.t_world_camera, |trail| {
            erased += trail
                .boxes()
                .map(|before| self.background.erase(&before, trail.frames()))
                .sum::<u32>();
        });
        erased
    }

    /// Turns the disparity into depth, removes what moves or may move, allocates blocks around the
    /// rest and averages it in.
    pub fn fuse<E: Executor, S: BlockStore>(
        &mut self,
        frame: &StereoFrame<'_>,
        camera: &CameraMotion,
        tracked: &mut Tracked<'_, '_>,
        executor: &E,
        store: &mut S,
    ) -> AllocationReport {
        let (width, height) = (frame.left.width(), frame.left.height());
        let view = Viewpoint {
            rig: self.config.scaled_rig(),
            width,
            height,
            t_world_camera: camera.t_world_camera,
        };
        let noted = NotedDepth::wrap_slice_mut(self.depth_m);
        let Some(mut depths) = ViewMut::new(noted, width, height) else {
            debug_assert!(false, "the depth image has the capacity's size");
            return AllocationReport::default();
        };
        let observed = ObservedDepth {
            config: &self.config.volume,
            rig: &view.rig,
            disparity_q8: self.disparity_q8,
        };
        executor.stage(Stage::Fuse, || observed.write(&mut depths, executor));
        let mut depth_m = depths.peeled_mut();
        executor.stage(Stage::Instances, || tracked.mask_dynamic_depth(&mut depth_m));
        let observation = Observation {
            depth: DepthImage::Noted(depths.as_view()),
            grey: frame.left,
            colour: frame.colour,
            class: frame.class,
        };
        let allocation = executor.stage(Stage::Allocate, || {
            self.background.allocate(&view, observation.depth.depth_m(), store, executor)
        });
        executor.stage(Stage::Fuse, || self.background.fuse(&view, observation, executor));
        allocation
    }
}
