//! Surfaces that the static map knows: what stood there before is no part of what moves.

use crate::{
    geometry::{Transform, scalar::min_f64},
    volume::Volume,
};

/// Observations from which on the map knows a surface. A moving object leaves fewer in one place:
/// what it leaves before it is found is erased.
const OBSERVED_MIN: u8 = 3;
/// Distance between a depth and the map's surface up to which they are one, m; and what depth errs
/// on top, m for each m^2 of squared depth.
const AGREES_M: f64 = 0.1;
const AGREES_PER_SQUARED_DEPTH: f64 = 0.0012;
/// Most of that distance, as a share of the truncation: beyond it distances are clamped.
const AGREES_MAX: f64 = 0.5;

/// The map as it was before this frame, and where the camera stands in it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KnownSurfaces<'a> {
    /// The static map.
    pub volume: &'a Volume<'a>,
    /// The camera's pose.
    pub t_world_camera: &'a Transform,
}

impl KnownSurfaces<'_> {
    /// Returns true if the map has a surface at a point of the camera's frame, m.
    pub fn hold(&self, point: [f64; 3]) -> bool {
        let config = self.volume.config();
        let world = self.t_world_camera.transform_point(point);
        let voxel_m = f64::from(config.voxel_size_m);
        let lattice = world.map(|m| libm::floor(m / voxel_m + 0.5) as i32);
        let truncation_m = f64::from(config.truncation_m);
        let agrees_m = min_f64(
            AGREES_M + AGREES_PER_SQUARED_DEPTH * point[2] * point[2],
            AGREES_MAX * truncation_m,
        );
        self.volume.sampler().voxel(lattice).is_some_and(|voxel| {
            let distance_m = f64::from(voxel.sdf) * truncation_m / 32_767.0;
            voxel.weight >= OBSERVED_MIN && libm::fabs(distance_m) < agrees_m
        })
    }
}
