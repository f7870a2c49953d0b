//! Analytic scenes with closed answers, and slow twins of what is fast.

mod distances;
mod free_paths;
mod ground;
mod objects;
mod windows;

use super::{cells::Cells, *};
use crate::{
    geometry::{GroundPlane, StereoRig, Transform},
    image::View,
    memory::SLAB_ALIGN,
    parallel::Serial,
    volume::{DepthImage, NoStore, Observation, Viewpoint, VolumeConfig},
};
use nalgebra::Vector3;
use std::{boxed::Box, vec, vec::Vec};

pub(super) const WIDTH: usize = 160;
pub(super) const HEIGHT: usize = 96;
pub(super) const RIG: StereoRig =
    StereoRig { focal_px: 100.0, center_u_px: 79.5, center_v_px: 47.5, baseline_m: 0.5 };
pub(super) const CAPACITY: Capacity = Capacity {
    blocks: 12_000,
    visible_blocks: 12_000,
    planning_width: 100,
    planning_length: 90,
    planning_height: 20,
    planning_distance_3d: true,
    ..Capacity::TINY
};
pub(super) const VOLUME: fn() -> VolumeConfig = || VolumeConfig {
    voxel_size_m: 0.1,
    truncation_m: 0.4,
    far_m: 30.0,
    ..VolumeConfig::default()
};
/// Cells of 0.2 m.
pub(super) const CONFIG: fn() -> PlanningConfig = || PlanningConfig {
    cell_voxels: 2,
    min_weight: 1,
    camera_height_m: 1.5,
    ..PlanningConfig::default()
};

/// Memory for `bytes`, for the test's lifetime.
pub(super) fn carver(bytes: usize) -> Carver<'static> {
    let memory = Box::leak(vec![0u8; bytes + SLAB_ALIGN].into_boxed_slice());
    Carver::new(memory, bytes).unwrap()
}

pub(super) fn planning(capacity: &Capacity, config: &PlanningConfig) -> Planning<'static> {
    let mut carver = carver(Planning::bytes(capacity));
    let made = Planning::new_in(capacity, config, VOLUME().voxel_size_m, &mut carver);
    carver.check().unwrap();
    made
}

/// A map and a window that look at a scene.
pub(super) struct Scene {
    pub volume: Volume<'static>,
    pub planning: Planning<'static>,
    /// Depth up to which the map holds what is observed, m.
    pub within_m: f32,
}

impl Scene {
    pub fn new(config: &PlanningConfig) -> Self {
        let mut carver = carver(Volume::bytes(&CAPACITY));
        Self {
            volume: Volume::new_in(&CAPACITY, &VOLUME(), &mut carver),
            planning: planning(&CAPACITY, config),
            within_m: f32::MAX,
        }
    }

    /// Looks from a pose at what `depth_at` says of a ray's direction at depth 1: the depth of its
    /// first surface, or none.
    pub fn observe(
        &mut self,
        t_world_camera: Transform,
        depth_at: impl Fn([f64; 3], [f64; 3]) -> Option<f64>,
    ) {
        let camera = t_world_camera.translation_m;
        let depth = |u: usize, v: usize| {
            let ray = [
                (u as f64 - RIG.center_u_px) / RIG.focal_px,
                (v as f64 - RIG.center_v_px) / RIG.focal_px,
                1.0,
            ];
            // Depths outside are pixels without an answer, as a matcher leaves them.
            depth_at(camera, t_world_camera.rotate(ray)).filter(|depth| (0.5..40.0).contains(depth))
        };
        let pixels: Vec<Option<f64>> =
            (0..WIDTH * HEIGHT).map(|at| depth(at % WIDTH, at / WIDTH)).collect();
        let depth_m: Vec<f32> = pixels.iter().map(|depth| depth.unwrap_or(0.0) as f32).collect();
        let disparity_q8: Vec<u16> = pixels
            .iter()
            .map(|depth| {
                depth.map_or(0, |depth| (256.0 * RIG.focal_baseline_px_m() / depth + 0.5) as u16)
            })
            .collect();
        let grey = vec![100u8; WIDTH * HEIGHT];
        let view = Viewpoint { rig: RIG, width: WIDTH, height: HEIGHT, t_world_camera };
        let depth_m = View::new(&depth_m, WIDTH, HEIGHT).unwrap();
        let seen = Observation {
            depth: DepthImage::Plain(depth_m),
            grey: View::new(&grey, WIDTH, HEIGHT).unwrap(),
            colour: None,
            class: None,
        };
        // The map and the window see one image, as in a frame of the mapper.
        self.volume.allocate(&view, depth_m, &mut NoStore, &Serial);
        self.volume.fuse(&view, seen, &Serial);
        let disparity_q8 = View::new(&disparity_q8, WIDTH, HEIGHT).unwrap();
        let ground = GroundPlane::find(&RIG, disparity_q8);
        self.planning.observe(&DepthView {
            within_m: self.within_m,
            rig: &RIG,
            t_world_camera: &t_world_camera,
            disparity_q8,
            ground,
        });
    }

    /// The cell that holds a point of the world.
    pub fn cell_of(&self, point: [f64; 3]) -> Cell {
        self.planning.grid().cell_at(self.planning.grid().of_world(point)).unwrap()
    }
}

/// The nearest of several surfaces' depths.
pub(super) fn nearest<const N: usize>(depths: [Option<f64>; N]) -> Option<f64> {
    depths.into_iter().flatten().filter(|depth| *depth > 0.0).reduce(f64::min_of)
}

/// The smaller float, by comparison.
trait MinOf {
    fn min_of(self, other: Self) -> Self;
}

impl MinOf for f64 {
    fn min_of(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
}

/// Depth of the ground `y = below + rise * z` along a ray.
pub(super) fn ground(below: f64, rise: f64) -> impl Fn([f64; 3], [f64; 3]) -> Option<f64> {
    move |camera, ray| {
        let slope = ray[1] - rise * ray[2];
        (libm::fabs(slope) > 1e-9)
            .then(|| (below + rise * camera[2] - camera[1]) / slope)
            .filter(|depth| *depth > 0.0)
    }
}

/// Depth of an upright box along a ray: x, y and z from low to high.
pub(super) fn solid(low: [f64; 3], high: [f64; 3]) -> impl Fn([f64; 3], [f64; 3]) -> Option<f64> {
    move |camera, ray| {
        let (mut begins, mut leaves) = (0.0, 1e9);
        for axis in 0..3 {
            let [a, b] = [low[axis], high[axis]].map(|side| (side - camera[axis]) / ray[axis]);
            let (first, last) = if a < b { (a, b) } else { (b, a) };
            (begins, leaves) = (
                if first > begins { first } else { begins },
                if last < leaves { last } else { leaves },
            );
        }
        (begins < leaves && begins > 0.0).then_some(begins)
    }
}

pub(super) fn at(x: f64, z: f64) -> Transform {
    Transform::new(Vector3::zeros(), Vector3::new(x, 0.0, z))
}

/// The mutable parts a test looks into.
pub(super) fn cells_of<'a>(planning: &'a mut Planning<'static>) -> &'a mut Cells<'static> {
    &mut planning.cells
}
