//! The mapper as a whole, in a scene with known geometry.

mod errors;
mod ignored;
mod inertial;
mod inertial_rides;
mod loops;
mod lost;
mod mutations;
mod places;
mod plan;
mod random_runs;
mod raw;
mod resume;
mod rows;
mod self_calibration;
mod set;
mod tails;
mod two_slabs;
mod views;
mod work;

use super::*;
use crate::{
    Report, Serial,
    geometry::Transform,
    memory::SLAB_ALIGN,
    scene_flow::test_scene::{HEIGHT, RIG, WIDTH, see},
    tracking::{Class, Detection},
};
use nalgebra::Vector3;
use std::{vec, vec::Vec};

const CAPACITY: Capacity =
    Capacity { image_width: WIDTH, image_height: HEIGHT, blocks: 4_000, ..Capacity::TINY };

/// A walk through the scene past a patch that the detector takes for a parked car.
struct Walk {
    pairs: Vec<[Vec<u8>; 2]>,
    mask: Vec<u8>,
}

impl Walk {
    const CAR: [u32; 4] = [230, 50, 90, 70];

    fn new(frames: usize) -> Self {
        let pose = |frame: usize| {
            Transform::new(
                Vector3::new(0.0, 0.01 * frame as f64, 0.0),
                Vector3::new(0.02, 0.0, 0.15) * frame as f64,
            )
        };
        let [_, _, width, height] = Self::CAR;
        Self {
            pairs: (0..frames).map(|frame| see(&pose(frame))).collect(),
            mask: vec![1; (width * height) as usize],
        }
    }

    fn config() -> Config {
        let mut config = Config::for_rig(RIG);
        (config.volume.prune_lag, config.volume.voxel_size_m) = (3, 0.1);
        config.volume.truncation_m = 0.4;
        config
    }

    fn detection(&self) -> Detection<'_> {
        let [left, top, width, height] = Self::CAR;
        Detection {
            class: Class::Car,
            score: 0.9,
            left: left as i32,
            top: top as i32,
            width,
            height,
            mask: &self.mask,
        }
    }

    /// Hands frame `at` to `take`.
    fn with_frame<R>(&self, at: usize, take: impl FnOnce(&StereoFrame<'_>) -> R) -> R {
        let detections = [self.detection()];
        let [left, right] =
            self.pairs[at].each_ref().map(|pixels| View::new(pixels, WIDTH, HEIGHT).unwrap());
        take(&StereoFrame { detections: &detections, ..StereoFrame::pair(left, right) })
    }

    fn step(&self, at: usize, mapper: &mut Mapper<'_>) -> Report {
        self.with_frame(at, |frame| mapper.step(frame, &Serial).unwrap())
    }
}

/// A mapper that has seen the first `frames` frames.
fn with_mapper<R>(
    walk: &Walk,
    frames: usize,
    test: impl FnOnce(&mut Mapper<'_>, &[Report]) -> R,
) -> R {
    let mut slab = vec![0u8; CAPACITY.bytes() + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut mapper = Mapper::new(&CAPACITY, &Walk::config(), &mut slab[start..]).unwrap();
    let reports: Vec<Report> = (0..frames).map(|at| walk.step(at, &mut mapper)).collect();
    test(&mut mapper, &reports)
}
