//! More matches on an object that has few: guided matching.
//!
//! Features are found where the whole image has its strongest patterns and matched where most of
//! their neighbours moved: a small car, or one that appears from behind another, gets few. Here the
//! pixels of its mask, on a grid, are searched for where an assumed motion projects them: each has
//! a depth, and so a position in the three other images. A patch that is found is a match like any
//! other; one that moved otherwise is not found within the 1.75 px that are searched, or is found
//! to have moved otherwise.
//!
//! Time: at most [`MAX_GUIDED_MATCHES`] refinements an object and frame.

use super::pixel;
use crate::{
    geometry::{StereoRig, Transform},
    image::{DISPARITY_ONE_PX, View},
    masks::{MaskHandle, MaskStore},
    scene_flow::{FlowMatcher, Match},
};

/// Most patches searched for on one object.
pub(crate) const MAX_GUIDED_MATCHES: usize = 256;
/// Least distance between two of them, px.
const STEP_MIN_PX: i32 = 3;
/// Most lines of the grid in a direction, more than any image needs.
const MAX_LINES: i32 = 4096;
/// Half a patch and a pixel, px: all around it must lie under the mask, for at the rim a patch also
/// shows what is behind.
const RIM_PX: i32 = 5;

/// Images and features in which more matches are searched for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GuidedMatching<'a, 's> {
    /// The images of this pair and the last.
    pub matcher: &'a FlowMatcher<'s>,
    /// Disparity of the current left image, 1/256 px, 0 none.
    pub disparity_q8: View<'a, u16>,
}

/// An object's mask in this frame and in the one before.
#[derive(Clone, Copy)]
pub(in super::super) struct ObjectMasks<'a, 's> {
    pub current: (&'a MaskStore<'s>, MaskHandle),
    pub previous: (&'a MaskStore<'s>, MaskHandle),
}

impl ObjectMasks<'_, '_> {
    /// Returns true if the patch around a pixel lies under the mask, by its middle, its corners and
    /// the middles of its sides.
    fn contains_patch(&self, u: i32, v: i32) -> bool {
        let ((store, mask), steps) = (&self.current, [0, -RIM_PX, RIM_PX]);
        steps.iter().all(|dv| steps.iter().all(|du| store.contains(mask, u + du, v + dv)))
    }

    fn contained_before(&self, at: [f32; 2]) -> bool {
        let ((store, mask), (u, v)) = (&self.previous, pixel(at));
        store.contains(mask, u, v)
    }
}

/// Searches for an object's matches where `t_current_previous`, the motion of its points from the
/// previous camera to the current one, projects them. Returns how many there are at the beginning
/// of `found`.
pub(in super::super) fn search_by_projection(
    search: &GuidedMatching<'_, '_>,
    rig: &StereoRig,
    masks: &ObjectMasks<'_, '_>,
    t_current_previous: &Transform,
    found: &mut [Match],
) -> usize {
    let t_previous_current = t_current_previous.inverse();
    let pixels = masks.current.1.pixels;
    let step_px = step_px(pixels.width, pixels.height);
    let lines = |first: i32, length: i32| {
        (0..MAX_LINES)
            .map(move |line| first + line * step_px)
            .take_while(move |at| *at < first + length)
    };
    let mut slots = found.iter_mut();
    let mut count = 0;
    for v in lines(pixels.top, pixels.height) {
        for u in lines(pixels.left, pixels.width) {
            if !masks.contains_patch(u, v) {
                continue;
            }
            let disparity =
                search.disparity_q8.get(u as usize, v as usize).filter(|&disparity| disparity > 0);
            let Some(disparity_px) =
                disparity.map(|q8| f64::from(q8) / f64::from(DISPARITY_ONE_PX))
            else {
                continue;
            };
            let Some(expected) = expected(rig, [u, v], disparity_px, &t_previous_current) else {
                continue;
            };
            let Some(m) =
                search.matcher.find(&expected).filter(|m| masks.contained_before(m.previous_left))
            else {
                continue;
            };
            let Some(slot) = slots.next() else { return count };
            *slot = m;
            count += 1;
        }
    }
    count
}

/// Distance of the grid's lines, so that a box has no more than about [`MAX_GUIDED_MATCHES`]
/// points.
pub(super) fn step_px(width: i32, height: i32) -> i32 {
    let area = f64::from(width) * f64::from(height);
    let step = libm::ceil(libm::sqrt(area / MAX_GUIDED_MATCHES as f64)) as i32;
    if step > STEP_MIN_PX { step } else { STEP_MIN_PX }
}

/// Predicts the position in all four images of a pixel of the current left one.
pub(crate) fn expected(
    rig: &StereoRig,
    [u, v]: [i32; 2],
    disparity_px: f64,
    t_previous_current: &Transform,
) -> Option<Match> {
    let current_left = [u as f32, v as f32];
    let current_right = [(f64::from(u) - disparity_px) as f32, v as f32];
    let current = rig.triangulate(&rig.observation(current_left, current_right))?;
    let previous = rig.project(t_previous_current.transform_point(current))?;
    let v_previous = (previous.v_px + rig.center_v_px) as f32;
    Some(Match {
        previous_left: [(previous.u_left_px + rig.center_u_px) as f32, v_previous],
        previous_right: [(previous.u_right_px + rig.center_u_px) as f32, v_previous],
        current_left,
        current_right,
    })
}
