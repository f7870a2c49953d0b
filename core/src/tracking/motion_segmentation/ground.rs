//! The ground plane, so that an object's mask ends where it stands.
//!
//! `y = height + slope z` in the camera's axes, without roll: of a few slopes the one whose heights
//! agree best, by votes of lattice points below the horizon. Integer votes: the order of points
//! does not matter.

use super::lattice::Lattice;
use crate::{geometry::StereoRig, image::View};

/// Slopes that are tried: -0.06 to 0.06.
const SLOPES: i32 = 6;
const SLOPE_STEP: f64 = 0.01;
/// Heights that are tried: 0.2 to 5 m below the camera.
const HEIGHT_MIN_M: f64 = 0.2;
const HEIGHT_STEP_M: f64 = 0.05;
const HEIGHTS: usize = 96;
/// Points that vote, m: their depth, and how far to the side.
const NEAR_M: f64 = 4.0;
const FAR_M: f64 = 25.0;
const SIDE_M: f64 = 6.0;
/// Fewest votes for a ground.
const VOTES_MIN: u32 = 40;

/// The ground plane under a disparity image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    height_m: f64,
    slope: f64,
}

impl Ground {
    /// The ground of a disparity image, in 1/256 px; `None` where too few of its pixels agree.
    ///
    /// ```
    /// use dynvox_core::{geometry::StereoRig, image::View, tracking::Ground};
    ///
    /// // A plane 1.5 m below the camera: disparities grow with the rows below the horizon.
    /// let rig = StereoRig { focal_px: 300.0, center_u_px: 160.0, center_v_px: 40.0, baseline_m: 0.5 };
    /// let row = |v: usize| (256.0 * rig.baseline_m * (v as f64 - 40.0).max(0.0) / 1.5) as u16;
    /// let disparity_q8: Vec<u16> = (0..320 * 120).map(|at| row(at / 320)).collect();
    /// let ground = Ground::of(&rig, View::new(&disparity_q8, 320, 120).unwrap()).unwrap();
    /// assert!((ground.above_m([0.0, 0.5, 10.0]) - 1.0).abs() < 0.1);
    /// ```
    pub fn of(rig: &StereoRig, disparity_q8: View<'_, u16>) -> Option<Self> {
        Self::find(&Lattice::new(rig, disparity_q8))
    }

    /// The ground under most lattice points; `None` where too few agree.
    pub(super) fn find(lattice: &Lattice<'_>) -> Option<Self> {
        let mut best: Option<(u32, Self)> = None;
        for step in -SLOPES..=SLOPES {
            let slope = SLOPE_STEP * f64::from(step);
            let mut counts = [0u32; HEIGHTS];
            for [x, y, z] in lattice.points_below_horizon() {
                if !(NEAR_M..=FAR_M).contains(&z) || libm::fabs(x) > SIDE_M {
                    continue;
                }
                let bin = (y - slope * z - HEIGHT_MIN_M) / HEIGHT_STEP_M;
                if bin >= 0.0
                    && let Some(count) = counts.get_mut(bin as usize)
                {
                    *count += 1;
                }
            }
            let pairs = counts.iter().zip(counts.iter().skip(1)).map(|(a, b)| a + b);
            for (bin, count) in (1..).zip(pairs) {
                if count >= VOTES_MIN && best.is_none_or(|(most, _)| count > most) {
                    best = Some((
                        count,
                        Self { height_m: HEIGHT_MIN_M + HEIGHT_STEP_M * f64::from(bin), slope },
                    ));
                }
            }
        }
        best.map(|(_, ground)| ground)
    }

    /// How far a point of the left camera's frame is above it, m.
    pub fn above_m(&self, [_, y, z]: [f64; 3]) -> f64 {
        self.height_m + self.slope * z - y
    }
}
