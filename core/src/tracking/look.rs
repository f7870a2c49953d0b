//! A closer look at a thing on which few matches lie.
//!
//! Features are found where the whole image has its strongest patterns and matched where most of what is around them went: of a small car, or
//! one that comes out from behind another, few are left. Here pixels of its mask, in a grid, are sought where they must have been if the thing
//! moved as is supposed: each has a depth, and so a place in the three other images. A patch found there is a match like any other; one that
//! went elsewhere is not found within the 1.75 px that are searched, or is found to have moved otherwise.
//!
//! Time: at most [`LOOKS`] refinements a thing and frame.

use super::claim::pixel;
use crate::{
    geometry::{StereoRig, Transform},
    image::{DISPARITY_ONE_PX, View},
    masks::{MaskPlace, MaskStore},
    scene_flow::{FlowMatcher, Match},
};
use nalgebra::Point3;

/// Most patches sought on one thing.
pub(crate) const LOOKS: usize = 256;
/// Least distance between two of them, px.
const STEP_MIN_PX: i32 = 3;
/// Most lines of the grid in a direction: that many are nowhere needed.
const LINES_MAX: i32 = 4096;
/// Nearest depth at which a point can be seen, m.
const DEPTH_MIN_M: f64 = 0.05;
/// Half a patch and a pixel, px: all around it must lie under the mask, for at the rim a patch shows what is behind as well.
const RIM_PX: i32 = 5;

/// Where matches come from in a frame.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a, 's> {
    /// Refined below the pixel.
    pub refined: &'a [Match],
    /// Of other features, at whole pixels.
    pub sparse: &'a [Match],
    /// Where more can be looked for: the images, and the disparity of the current left one.
    pub images: Option<(&'a FlowMatcher<'s>, View<'a, u16>)>,
}

/// A thing's mask now and in the frame before.
#[derive(Clone, Copy)]
pub(super) struct Outline<'a, 's> {
    pub now: (&'a MaskStore<'s>, MaskPlace),
    pub before: (&'a MaskStore<'s>, MaskPlace),
}

impl Outline<'_, '_> {
    /// Whether the patch around a pixel lies under the mask, by its middle, its corners and the middles of its sides.
    fn holds_patch(&self, u: i32, v: i32) -> bool {
        let ((store, place), steps) = (&self.now, [0, -RIM_PX, RIM_PX]);
        steps.iter().all(|dv| steps.iter().all(|du| store.contains(place, u + du, v + dv)))
    }

    fn held(&self, at: [f32; 2]) -> bool {
        let ((store, place), (u, v)) = (&self.before, pixel(at));
        store.contains(place, u, v)
    }
}

/// Looks for a thing's matches, supposing that `t_current_previous` carried its points from the previous camera to the current one. Returns
/// how many there are at the beginning of `found`.
pub(super) fn look(
    (matcher, disparity_q8): (&FlowMatcher<'_>, View<'_, u16>),
    rig: &StereoRig,
    outline: &Outline<'_, '_>,
    t_current_previous: &Transform,
    found: &mut [Match],
) -> usize {
    let t_previous_current = t_current_previous.inverse();
    let pixels = outline.now.1.pixels;
    let step_px = step_px(pixels.width, pixels.height);
    let lines = |first: i32, length: i32| (0..LINES_MAX).map(move |line| first + line * step_px).take_while(move |at| *at < first + length);
    let mut slots = found.iter_mut();
    let mut count = 0;
    for v in lines(pixels.top, pixels.height) {
        for u in lines(pixels.left, pixels.width) {
            if !outline.holds_patch(u, v) {
                continue;
            }
            let disparity = disparity_q8.get(u as usize, v as usize).filter(|&disparity| disparity > 0);
            let Some(disparity_px) = disparity.map(|q8| f64::from(q8) / f64::from(DISPARITY_ONE_PX)) else { continue };
            let Some(expected) = expected(rig, [u, v], disparity_px, &t_previous_current) else { continue };
            let Some(m) = matcher.find(&expected).filter(|m| outline.held(m.previous_left)) else { continue };
            let Some(slot) = slots.next() else { return count };
            *slot = m;
            count += 1;
        }
    }
    count
}

/// Distance of the grid's lines, so that no more than about [`LOOKS`] points lie in a box.
pub(crate) fn step_px(width: i32, height: i32) -> i32 {
    let area = f64::from(width) * f64::from(height);
    let step = libm::ceil(libm::sqrt(area / LOOKS as f64)) as i32;
    if step > STEP_MIN_PX { step } else { STEP_MIN_PX }
}

/// Where a pixel of the current left image is in all four.
fn expected(rig: &StereoRig, [u, v]: [i32; 2], disparity_px: f64, t_previous_current: &Transform) -> Option<Match> {
    let per_px = rig.baseline_m / disparity_px;
    let (x, y) = (f64::from(u) - rig.center_u_px, f64::from(v) - rig.center_v_px);
    let before = t_previous_current.transform_point(Point3::new(x * per_px, y * per_px, rig.focal_px * per_px));
    // Not so for NaN.
    let ahead = before.z > DEPTH_MIN_M;
    if !ahead {
        return None;
    }
    let per_m = rig.focal_px / before.z;
    let (u_before, v_before) = (before.x * per_m + rig.center_u_px, before.y * per_m + rig.center_v_px);
    Some(Match {
        previous_left: [u_before as f32, v_before as f32],
        previous_right: [(u_before - rig.baseline_m * per_m) as f32, v_before as f32],
        current_left: [u as f32, v as f32],
        current_right: [(f64::from(u) - disparity_px) as f32, v as f32],
    })
}
