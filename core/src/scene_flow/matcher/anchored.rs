//! Scene points of an older frame, kept as patches that later frames are searched for.
//!
//! Refinement errs by some hundredth of a pixel, alike in frames that share a phase, so that a sum
//! of many short motions is wrong by a share of the way. A patch kept from one frame is found in
//! each later one with a single such error. Only the patch of the left image is kept, and where
//! the right image showed it: not the images.

use super::{FlowMatcher, images};
use crate::{
    geometry::{StereoRig, Transform},
    scene_flow::{
        matches::Match,
        refine::{Pixels, Template},
    },
    state::Visitor,
};
use bytemuck::{Pod, Zeroable};

/// Side of a stored patch, px: a template, and a pixel around it for the gradients.
const SIDE: usize = 10;
/// Middle of a template within the stored patch, px.
const MIDDLE: usize = SIDE / 2;
/// Distance from a match's position to the pixel that its patch lies around, px.
const HALF_PX: f32 = 0.5;

/// One scene point of an older frame, the patch around it, and its match with the current frame.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct AnchorPoint {
    /// From the older frame to the current one, corrected; the current positions are no numbers
    /// where the point was not found.
    m: Match,
    /// Position in the older right image as it is, without a correction.
    right: [f32; 2],
    patch: [[u8; SIDE]; SIDE],
}

impl AnchorPoint {
    /// The match with the current frame.
    pub fn matched(&self) -> &Match {
        &self.m
    }

    /// Visits what lives from frame to frame.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { m: Match { previous_left, .. }, right, patch } = self;
        // The rest of the match belongs to one frame.
        previous_left.iter_mut().chain(right).for_each(|px| visitor.f32(px));
        visitor.bytes(patch.as_flattened_mut());
    }
}

impl FlowMatcher<'_> {
    /// Keeps a refined match's scene point as the previous frame shows it; `None` where its patch
    /// is not around a whole pixel, or reaches out of the image.
    pub(crate) fn anchor_point(&self, m: &Match) -> Option<AnchorPoint> {
        let [previous_left, _] = self.left_images()?;
        // Refinement leaves the middle of a patch half a pixel before a whole one.
        let at = m.previous_left.map(|px| px + HALF_PX);
        let [u, v] = at.map(|px| px as usize);
        if [u as f32, v as f32] != at {
            return None;
        }
        let (left, top) = (u.checked_sub(MIDDLE)?, v.checked_sub(MIDDLE)?);
        let mut patch = [[0; SIDE]; SIDE];
        for (to, v) in patch.iter_mut().zip(top..) {
            let row = previous_left.row(v).get(left..)?.get(..SIDE)?;
            to.iter_mut().zip(row).for_each(|(to, from)| *to = *from);
        }
        Some(AnchorPoint { m: *m, right: self.correction.uncorrected(m.previous_right), patch })
    }

    /// Looks for a kept point in both current images, near where the motion since its frame puts
    /// it.
    #[inline(never)]
    pub(crate) fn find_anchored(
        &self,
        point: &mut AnchorPoint,
        rig: &StereoRig,
        t_current_anchor: &Transform,
    ) {
        point.m.previous_right = self.correction.corrected(point.right);
        let found = self.find_patch(point, rig, t_current_anchor);
        [point.m.current_left, point.m.current_right] = found.unwrap_or([[f32::NAN; 2]; 2]);
    }

    fn find_patch(
        &self,
        point: &AnchorPoint,
        rig: &StereoRig,
        t_current_anchor: &Transform,
    ) -> Option<[[f32; 2]; 2]> {
        let size = self.last.filter(|_| self.matched)?;
        let images = images(&self.left, &self.right, size);
        let seen = rig.observation(point.m.previous_left, point.m.previous_right);
        let there = rig.project(t_current_anchor.transform_point(rig.triangulate(&seen)?))?;
        let patch = Pixels { data: point.patch.as_flattened(), width: SIDE };
        let template = Template::extract(patch, MIDDLE, MIDDLE)?;
        // Images show a point where no correction puts it.
        let start = |u_px| {
            [rig.center_u_px + u_px, rig.center_v_px + there.v_px].map(|px| px as f32 + HALF_PX)
        };
        let (left, right) = (start(there.u_left_px), start(there.u_right_px));
        let right = self.correction.uncorrected(right);
        let is_inside = |[u, v]: &[f32; 2]| {
            *u >= 0.0 && *v >= 0.0 && *u < size[0] as f32 && *v < size[1] as f32
        };
        if ![left, right].iter().all(is_inside) {
            return None;
        }
        let left = template.find_alike(images.current_left, left)?;
        let right = template.find_alike(images.current_right, right)?;
        let right = self.correction.corrected(right);
        (left[0] > right[0]).then_some([left, right])
    }
}
