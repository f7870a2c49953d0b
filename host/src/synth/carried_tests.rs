//! What moves with the camera, pasted into the street: it must not carry the pose.

use super::*;
use dynvox_core::image::View;
use dynvox_core::memory::SLAB_ALIGN;
use dynvox_core::{Capacity, Config, Mapper, Serial, Severity, StereoFrame};

const WIDTH: usize = 320;
const HEIGHT: usize = 96;
const FRAMES: u32 = 5;

/// A pasted part: the pixels of the left image that it covers, and its disparity, px.
struct Part {
    columns: std::ops::Range<usize>,
    rows: std::ops::Range<usize>,
    disparity_px: usize,
}

impl Part {
    /// Covers the part of an image with grain that stays in place.
    fn paste(&self, image: &mut [u8], is_right: bool) {
        let shift = if is_right { self.disparity_px } else { 0 };
        for v in self.rows.clone() {
            for u in self.columns.clone().filter(|&u| u >= shift) {
                image[v * WIDTH + u - shift] = self.grain(u / 3, v / 3);
            }
        }
    }

    /// Grey of a grain of 3 x 3 px.
    fn grain(&self, u: usize, v: usize) -> u8 {
        let mixed = (u as u64 * 0x9E37_79B9 + v as u64 * 0x85EB_CA6B).wrapping_mul(0xC2B2_AE3D);
        (mixed >> 16) as u8
    }
}

/// Largest distance, m, from the true position in frames reported below "map affected".
fn unreported_error_m(part: &Part) -> f64 {
    let config = StreetConfig {
        width: WIDTH as u32,
        height: HEIGHT as u32,
        frames: FRAMES,
        ..StreetConfig::default()
    };
    let street = Street::new(config).unwrap();
    let capacity = Capacity { image_width: WIDTH, image_height: HEIGHT, ..Capacity::TINY };
    let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&capacity, &Config::for_rig(street.rig()), &mut slab).unwrap();
    let first = street.t_world_camera(0);
    let mut worst_m = 0.0f64;
    for index in 0..FRAMES {
        let mut frame = street.frame(index);
        part.paste(&mut frame.left_grey, false);
        part.paste(&mut frame.right_grey, true);
        let [left, right] = [&frame.left_grey, &frame.right_grey]
            .map(|pixels| View::new(pixels, WIDTH, HEIGHT).unwrap());
        let report = mapper.step(&StereoFrame::pair(left, right), &Serial).unwrap();
        let truth = first.inverse() * frame.t_world_camera;
        let error_m = (truth.inverse() * report.t_world_camera).distance_m();
        if report.severity() < Severity::MapAffected {
            worst_m = worst_m.max(error_m);
        }
    }
    worst_m
}

#[dynvox_needs::long]
#[test]
fn a_truck_ahead_at_our_speed_does_not_hold_the_pose() {
    let truck = Part { columns: 115..205, rows: 4..82, disparity_px: 16 };
    let error_m = unreported_error_m(&truck);
    assert!(error_m < 0.3, "{error_m} m");
}
