//! The plane under a disparity image, so that an object's mask ends where it stands and a planner
//! knows where to expect ground.
//!
//! `y = height + slope z` in the camera's axes, without roll: of a few slopes the one whose heights
//! agree best, by votes of every eighth pixel of every eighth row below the horizon. Integer votes:
//! the order of points does not matter.
//!
//! Memory: 384 bytes of stack. Time: 13 passes over a 64th of the image below the horizon.
//!
//! # What can go wrong
//!
//! A wall or a long vehicle just above the road may get more votes than the road. A frame whose
//! lower half shows little road has no plane; callers say what they assume then.

use super::StereoRig;
use crate::image::{View, disparity_px};

/// Columns, and rows, from one pixel that votes to the next, px.
const STEP_PX: usize = 8;
/// The first column, and the first row, that votes, px.
const FIRST_PX: usize = 2;
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
pub struct GroundPlane {
    height_m: f64,
    slope: f64,
}

impl GroundPlane {
    /// Finds the ground of a disparity image, in 1/256 px; `None` where too few of its pixels
    /// agree.
    ///
    /// ```
    /// use dynvox_core::{geometry::{GroundPlane, StereoRig}, image::View};
    ///
    /// // A plane 1.5 m below the camera: disparities grow with the rows below the horizon.
    /// let rig = StereoRig { focal_px: 300.0, center_u_px: 160.0, center_v_px: 40.0, baseline_m: 0.5 };
    /// let row = |v: usize| (256.0 * rig.baseline_m * (v as f64 - 40.0).max(0.0) / 1.5) as u16;
    /// let disparity_q8: Vec<u16> = (0..320 * 120).map(|at| row(at / 320)).collect();
    /// let disparity_q8 = View::new(&disparity_q8, 320, 120).unwrap();
    /// let ground = GroundPlane::find(&rig, disparity_q8).unwrap();
    /// assert!((ground.above_m([0.0, 0.5, 10.0]) - 1.0).abs() < 0.1);
    /// ```
    pub fn find(rig: &StereoRig, disparity_q8: View<'_, u16>) -> Option<Self> {
        let mut best: Option<(u32, Self)> = None;
        for step in -SLOPES..=SLOPES {
            // Each point votes for the height of the plane of this slope that passes through it.
            let slope = SLOPE_STEP * f64::from(step);
            let mut counts = [0u32; HEIGHTS];
            for [x, y, z] in points_below_horizon(rig, disparity_q8) {
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
            // Neighbouring bins are added, so that a plane near a bin's edge is not split.
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

    /// Height of a point of the left camera's frame above the plane, m.
    pub fn above_m(&self, [_, y, z]: [f64; 3]) -> f64 {
        self.height_m + self.slope * z - y
    }
}

/// The points that vote, in the left camera's frame, m.
fn points_below_horizon<'a>(
    rig: &'a StereoRig,
    disparity_q8: View<'a, u16>,
) -> impl Iterator<Item = [f64; 3]> {
    // The last pixel stands for one that lies beyond the edge.
    let pixels = |size: usize| {
        (0..size.div_ceil(STEP_PX / 2).div_ceil(2))
            .map(move |at| (at * STEP_PX + FIRST_PX).min(size.saturating_sub(1)))
    };
    let (width, height) = (disparity_q8.width(), disparity_q8.height());
    // A level camera sees ground below the horizon only.
    let rows = pixels(height).filter(move |&v| v as f64 > rig.center_v_px);
    rows.flat_map(move |v| {
        pixels(width)
            .filter_map(move |u| Some(rig.pixel_point([u, v], disparity_px(disparity_q8, [u, v])?)))
    })
}
