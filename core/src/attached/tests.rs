//! A ride with a bonnet, a stop among traffic, vehicles ahead.

use super::*;
use crate::{Slab, random::Random};
use std::{boxed::Box, vec, vec::Vec};

const WIDTH: usize = 320;
const HEIGHT: usize = 96;
const CAPACITY: Capacity = Capacity { image_width: WIDTH, image_height: HEIGHT, ..Capacity::TINY };
const BYTES: usize = AttachedCells::bytes(&CAPACITY);
const RIG: StereoRig =
    StereoRig { focal_px: 180.0, center_u_px: 160.0, center_v_px: 40.0, baseline_m: 0.5 };
/// First row of the bonnet.
const BONNET: usize = 66;

/// Camera, cells and what they see.
struct Ride<'s> {
    cells: AttachedCells<'s>,
    random: Random,
    images: [Vec<u8>; 2],
}

impl<'s> Ride<'s> {
    fn new(slab: &'s mut Slab<BYTES>) -> Self {
        let cells = AttachedCells::new_in(&CAPACITY, &mut Carver::new(&mut slab.0, BYTES).unwrap());
        Self { cells, random: Random::new(1), images: [(); 2].map(|()| vec![0; WIDTH * HEIGHT]) }
    }

    fn uniform(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * (self.random.below(1_000_000) as f32 / 1e6)
    }

    /// A match at a pixel of the current image that was at the other one before.
    fn matched(now: [f32; 2], before: [f32; 2], disparities_px: [f32; 2]) -> Match {
        let right = |[u, v]: [f32; 2], disparity_px: f32| [u - disparity_px, v];
        Match {
            previous_left: before,
            previous_right: right(before, disparities_px[0]),
            current_left: now,
            current_right: right(now, disparities_px[1]),
        }
    }

    /// A frame after which the camera has gone `way_m` ahead. The pixels that `is_part` names stay,
    /// at a disparity; the others show the world, 8 m away before.
    fn frame(&mut self, way_m: f64, disparity_px: f32, is_part: impl Fn(usize, usize) -> bool) {
        let mut matches = Vec::new();
        for _ in 0..500 {
            let at = [self.uniform(0.0, WIDTH as f32), self.uniform(0.0, HEIGHT as f32)];
            let is_here = is_part(at[0] as usize, at[1] as usize);
            let cell = [at[0] as usize / CELL_PX, at[1] as usize / CELL_PX];
            // Nothing is matched in an attached cell.
            if self.cells.attached().any(|attached| attached == cell) {
                continue;
            }
            matches.push(if is_here {
                Self::matched(at, at, [disparity_px; 2])
            } else {
                let before = [8.0, 8.0 - way_m as f32].map(|z| 90.0 / z);
                let center = [RIG.center_u_px as f32, RIG.center_v_px as f32];
                let previous = [0, 1]
                    .map(|axis| center[axis] + (at[axis] - center[axis]) * before[0] / before[1]);
                Self::matched(at, previous, before)
            });
        }
        let [previous, current] = &mut self.images;
        core::mem::swap(previous, current);
        for (at, pixel) in current.iter_mut().enumerate() {
            let (u, v) = (at % WIDTH, at / WIDTH);
            // A pattern that stays, or noise that does not.
            *pixel = if is_part(u, v) {
                ((u * 37) ^ (v * 101)) as u8
            } else {
                self.random.below(256) as u8
            };
        }
        let left = self.images.each_ref().map(|pixels| View::new(pixels, WIDTH, HEIGHT).unwrap());
        let input = AttachedInput {
            rig: &RIG,
            t_current_previous: &Transform::from_translation([0.0, 0.0, -way_m]),
            left,
        };
        self.cells.observe(&input, matches.iter());
    }

    /// Intersection over union of attached cells with the bonnet.
    fn overlap_with_bonnet(&self) -> f64 {
        let mut attached = vec![false; WIDTH * HEIGHT];
        for [column, row] in self.cells.attached() {
            for v in row * CELL_PX..(row + 1) * CELL_PX {
                for u in column * CELL_PX..(column + 1) * CELL_PX {
                    attached[v * WIDTH + u] = true;
                }
            }
        }
        let both = |is: fn(bool, bool) -> bool| {
            let pixels = attached.iter().enumerate();
            pixels.filter(|&(at, &attached)| is(attached, at / WIDTH >= BONNET)).count() as f64
        };
        both(|a, b| a && b) / both(|a, b| a || b)
    }
}

fn is_bonnet(_: usize, v: usize) -> bool {
    v >= BONNET
}

fn slab() -> Box<Slab<BYTES>> {
    Box::new(Slab([0; BYTES]))
}

#[test]
fn a_bonnet_is_masked_after_thirty_frames_and_let_go_when_it_changes() {
    let mut slab = slab();
    let mut ride = Ride::new(&mut slab);
    for _ in 0..15 {
        ride.frame(0.9, 40.0, is_bonnet);
    }
    assert!(ride.cells.is_empty(), "not yet earned");
    for _ in 0..15 {
        ride.frame(0.9, 40.0, is_bonnet);
    }
    let overlap = ride.overlap_with_bonnet();
    assert!(overlap > 0.8, "{overlap}");
    for _ in 0..15 {
        ride.frame(0.9, 40.0, is_bonnet);
    }
    let overlap = ride.overlap_with_bonnet();
    assert!(overlap > 0.8, "it stays masked without a match: {overlap}");
    // The camera is taken to another car.
    for _ in 0..20 {
        ride.frame(0.9, 40.0, |_, _| false);
    }
    assert!(ride.cells.is_empty());
}

#[test]
fn matches_that_stay_where_others_stayed_are_doubted_long_before() {
    let mut slab = slab();
    let mut ride = Ride::new(&mut slab);
    let (low, high) = ([150.0, 85.0], [150.0, 20.0]);
    let still = |at| Ride::matched(at, at, [40.0; 2]);
    for _ in 0..3 {
        ride.frame(0.9, 40.0, is_bonnet);
    }
    assert!(!ride.cells.doubts(&still(low)), "three frames say little");
    for _ in 0..3 {
        ride.frame(0.9, 40.0, is_bonnet);
    }
    assert!(ride.cells.doubts(&still(low)));
    assert!(!ride.cells.doubts(&still(high)), "elsewhere");
    let [u, v] = low;
    assert!(!ride.cells.doubts(&Ride::matched(low, [u, v - 1.0], [40.0; 2])), "it moves");
    assert!(!ride.cells.doubts(&Ride::matched(low, low, [39.0, 40.0])), "it comes nearer");
}

#[test]
fn nothing_is_attached_to_a_camera_that_stands() {
    let mut slab = slab();
    let mut ride = Ride::new(&mut slab);
    for _ in 0..60 {
        ride.frame(0.0, 40.0, is_bonnet);
    }
    assert!(ride.cells.is_empty());
}

#[test]
fn vehicles_ahead_are_not_attached_far_away_or_coming_nearer() {
    let is_vehicle = |u: usize, v: usize| (100..220).contains(&u) && (20..80).contains(&v);
    let mut slab = slab();
    let mut ride = Ride::new(&mut slab);
    for _ in 0..60 {
        // 9 m away, at our own speed.
        ride.frame(0.9, 10.0, is_vehicle);
    }
    assert!(ride.cells.is_empty(), "a vehicle ahead at our own speed");
    for frame in 0..60 {
        // 4 m away, 2 cm nearer in each frame.
        ride.frame(0.9, 90.0 / (4.0 - 0.02 * frame as f32), is_vehicle);
    }
    assert!(ride.cells.is_empty(), "a vehicle that comes nearer");
}
