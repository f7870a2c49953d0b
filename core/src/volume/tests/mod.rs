//! Analytic scenes with closed answers, and slow twins of the fast kernels.

pub(crate) mod analytic;
mod erasing;
mod eviction;
mod fusion;
mod history;
mod pruning;
mod segments;
mod submaps;

use super::*;
use crate::{
    geometry::{StereoRig, Transform},
    image::View,
    parallel::{Serial, TwoThreads},
};
use nalgebra::Vector3;
use std::{vec, vec::Vec};

const WIDTH: usize = 96;
const HEIGHT: usize = 64;
const RIG: StereoRig =
    StereoRig { focal_px: 80.0, center_u_px: 47.5, center_v_px: 31.5, baseline_m: 0.5 };
const CAPACITY: Capacity =
    Capacity { blocks: 6_000, visible_blocks: 6_000, colour: true, ..Capacity::TINY };

/// Runs `test` with a volume of that capacity.
fn with_volume(capacity: &Capacity, config: &VolumeConfig, test: impl FnOnce(&mut Volume<'_>)) {
    let bytes = Volume::bytes(capacity);
    let mut slab = vec![0u8; bytes + 64];
    let start = slab.as_ptr().align_offset(64);
    let mut carver = Carver::new(&mut slab[start..], bytes).unwrap();
    let mut volume = Volume::new_in(capacity, config, &mut carver);
    assert_eq!(carver.footprint().bytes(), bytes, "the formula and the cutting agree to the byte");
    test(&mut volume);
}

fn view(rotation_rad: [f64; 3], translation_m: [f64; 3]) -> Viewpoint {
    Viewpoint {
        rig: RIG,
        width: WIDTH,
        height: HEIGHT,
        t_world_camera: Transform::new(Vector3::from(rotation_rad), Vector3::from(translation_m)),
    }
}

/// A depth image with steps, a slope and holes.
fn bumpy_depth() -> Vec<f32> {
    (0..WIDTH * HEIGHT)
        .map(|i| match (i % WIDTH, i / WIDTH) {
            (u, v) if (u / 7 + v / 5) % 6 == 0 => 0.0,
            (u, v) if u > 60 => 2.0 + v as f32 * 0.02,
            (u, v) => 4.0 + u as f32 * 0.013 + v as f32 * 0.007,
        })
        .collect()
}

fn observation<'a>(depth_m: &'a [f32], grey: &'a [u8]) -> Observation<'a> {
    let depth_m = View::new(depth_m, WIDTH, HEIGHT).unwrap();
    Observation {
        depth: DepthImage::Plain(depth_m),
        grey: View::new(grey, WIDTH, HEIGHT).unwrap(),
        colour: None,
        class: None,
    }
}

fn fuse_once(
    volume: &mut Volume<'_>,
    view: &Viewpoint,
    depth_m: &[f32],
    grey: &[u8],
) -> AllocationReport {
    let seen = observation(depth_m, grey);
    let report = volume.allocate(view, seen.depth.depth_m(), &mut NoStore, &Serial);
    volume.fuse(view, seen, &Serial);
    report
}

impl Volume<'_> {
    /// Flips a bit of a voxel, 0 to 15 of its distance, 16 to 23 of its weight, and lets the digest
    /// know.
    pub(crate) fn flip(&mut self, slot: Slot, voxel: usize, bit: u32) {
        self.flip_behind_its_back(slot, voxel, bit);
        self.update_digest(slot);
    }

    /// Flips a bit as a fault of the memory would.
    pub(crate) fn flip_behind_its_back(&mut self, slot: Slot, voxel: usize, bit: u32) {
        match bit {
            0..16 => self.blocks.voxels[slot.index()].sdf[voxel] ^= 1 << bit,
            _ => self.blocks.voxels[slot.index()].weight[voxel] ^= 1 << (bit - 16),
        }
    }
}
