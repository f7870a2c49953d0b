//! One match that contradicts a static world.

use super::residual::Residual;
use crate::{geometry::scalar::max_f64, scene_flow::Match};
use bytemuck::{Pod, Zeroable};
use nalgebra::Vector3;

/// Largest difference of neighbouring disparities, px and as a share.
const DISPARITY_MIN_PX: f64 = 1.0;
const DISPARITY_SHARE: f64 = 0.06;
/// Largest difference of motions on one object, m, and by metre of depth.
const MOTION_M: f64 = 0.15;
const MOTION_PER_DEPTH: f64 = 0.02;

/// A match that contradicts the static prediction. The position in the image is of the current left
/// frame.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Candidate {
    u: f32,
    v: f32,
    disparity_px: f32,
    /// In the current camera, m.
    pub(super) point_m: [f32; 3],
    pub(super) motion_m: [f32; 3],
    pub(super) depth_sigma_m: f32,
    /// Another member of the same group; the first member names itself.
    pub(super) parent: u32,
}

impl Candidate {
    pub fn new(m: &Match, residual: &Residual, index: usize) -> Self {
        let numbers = |v: &Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
        Self {
            u: m.current_left[0],
            v: m.current_left[1],
            disparity_px: m.current_disparity_px(),
            point_m: numbers(&residual.point_m),
            motion_m: numbers(&residual.motion_m),
            depth_sigma_m: residual.depth_sigma_m as f32,
            parent: index as u32,
        }
    }

    /// Returns pixel and disparity.
    pub fn position(&self) -> [f32; 3] {
        [self.u, self.v, self.disparity_px]
    }

    /// Returns true if the candidate is the first member of its group, at that position.
    pub fn is_first(&self, index: usize) -> bool {
        self.parent as usize == index
    }

    /// Returns true if the candidate belongs to the group whose first member is at `first`.
    pub fn is_of(&self, first: u32) -> bool {
        self.parent == first
    }

    /// Returns the candidate at another position.
    pub fn at(self, index: usize) -> Self {
        Self { parent: index as u32, ..self }
    }

    /// Returns true if the other one lies next to it and moves alike.
    pub fn is_neighbour(&self, other: &Self, reach_px: f64) -> bool {
        let depth_m = f64::from(self.point_m[2]);
        let apart = |a: f32, b: f32| libm::fabs(f64::from(a) - f64::from(b));
        // Within an object disparities differ by a share of them, and at least by their noise.
        let disparity_px =
            max_f64(DISPARITY_SHARE * f64::from(self.disparity_px), DISPARITY_MIN_PX);
        if apart(self.u, other.u) > reach_px
            || apart(self.v, other.v) > reach_px
            || apart(self.disparity_px, other.disparity_px) > disparity_px
        {
            return false;
        }
        let side_m = motion_tolerance_m(depth_m);
        // Along the ray the motion is known less well than across it, by both points' own
        // deviations.
        let along_m = side_m + f64::from(self.depth_sigma_m) + f64::from(other.depth_sigma_m);
        let [[x, y, z], [x2, y2, z2]] = [self.motion_m, other.motion_m];
        apart(x, x2) < side_m && apart(y, y2) < side_m && apart(z, z2) < along_m
    }
}

/// Returns the largest difference of motions on one object, along the image's axes, m.
pub(super) fn motion_tolerance_m(depth_m: f64) -> f64 {
    MOTION_M + MOTION_PER_DEPTH * depth_m
}
