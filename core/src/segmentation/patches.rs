//! More matches where candidates are few: patches of the mask that an object would have, searched
//! for where its motion projects them.
//!
//! A small or fast object has too few features for a group. Of a few candidates that move alike,
//! and of an object of the frame before, the mask grows first. Its cells are then searched for in
//! the other images: from where the supposed motion projects them and, where they are not found or
//! move otherwise, from where a static point would be. The gates for the group of those that move
//! as supposed are the same as for features: enough members, and few static patches among them.
//!
//! Time: at most [`MAX_SEARCHES`] patches a frame, each searched for once or twice.

use super::groups::CANDIDATE_SHARE_MIN;
use super::residual::CANDIDATE_CHI_SQUARE;
use super::{
    candidate::{Candidate, motion_tolerance_m},
    groups::{Group, measure},
    joint::FROM_M,
    lattice::Lattice,
    residual::{Residual, StaticModel},
    seed::Seed,
};
use crate::{
    geometry::Transform,
    tracking::{GuidedMatching, expected},
};
use nalgebra::Vector3;

/// Most patches of one of them.
pub(super) const MAX_PATCHES: usize = 48;
/// Most patches of a frame.
const MAX_SEARCHES: usize = 384;

/// Least share of moving patches on an object that was found before.
const KNOWN_SHARE_MIN: f64 = 0.7;
/// Error of a sideways motion, one sigma, by metre of depth.
const SIDE_PER_DEPTH: f64 = 0.002;

/// The square of a motion, by what it errs by along the depth and to the side.
fn scaled(motion_m: &Vector3<f64>, residual: &Residual) -> f64 {
    let side = residual.point_m.z * SIDE_PER_DEPTH;
    let along = motion_m.z / residual.depth_sigma_m;
    (motion_m.x * motion_m.x + motion_m.y * motion_m.y) / (side * side) + along * along
}

/// Content of a patch.
enum Patch {
    Moving(Candidate),
    Static,
}

/// Images and motion with which patches are searched for in a frame.
pub(super) struct PatchSearch<'a, 's> {
    images: GuidedMatching<'a, 's>,
    t_previous_current: Transform,
    lattice: &'a Lattice<'a>,
    /// Patches left for this frame.
    left: usize,
}

/// Memory for one mask and its patches.
pub(super) struct PatchMemory<'m> {
    pub cells: &'m mut [u8],
    pub queue: &'m mut [u32],
    pub members: &'m mut [Candidate],
    pub values: &'m mut [f32],
}

impl<'a, 's> PatchSearch<'a, 's> {
    pub fn new(
        images: GuidedMatching<'a, 's>,
        t_current_previous: &Transform,
        lattice: &'a Lattice<'a>,
    ) -> Self {
        Self {
            images,
            t_previous_current: t_current_previous.inverse(),
            lattice,
            left: MAX_SEARCHES,
        }
    }

    /// The group of a supposed object's patches, if it passes the gates.
    pub fn verify(
        &mut self,
        model: &StaticModel<'_>,
        seed: &Seed,
        memory: &mut PatchMemory<'_>,
    ) -> Option<Group> {
        let PatchMemory { cells, queue, members, values } = memory;
        let pixels = self.lattice.grow(&seed.extent(), &[], cells, queue)?;
        // Evenly spread over the object, at most MAX_PATCHES.
        let every = self.lattice.marked(cells, &pixels).count().div_ceil(MAX_PATCHES);
        let (mut moving, mut still) = (0usize, 0usize);
        let marked = self
            .lattice
            .marked(cells, &pixels)
            .enumerate()
            .filter(|(index, _)| index.is_multiple_of(every));
        for (_, at) in marked {
            // The frame's budget of patches: used up, nothing is verified.
            self.left = self.left.checked_sub(1)?;
            match self.search_patch(model, at, seed) {
                Some(Patch::Moving(candidate)) => {
                    *members.get_mut(moving)? = candidate;
                    moving += 1;
                }
                Some(Patch::Static) => still += 1,
                None => {}
            }
        }
        // A known object needs fewer moving patches than a supposed one.
        let share = if seed.is_known() { KNOWN_SHARE_MIN } else { f64::from(CANDIDATE_SHARE_MIN) };
        let is_moving = moving as f64 >= share * (moving + still) as f64;
        let group = measure(members.get(..moving)?, 0, values).filter(|_| is_moving)?;
        group.passes().then_some(group)
    }

    /// Frees the cells around the patches of an object.
    pub fn unblock(&self, members: &[Candidate], blocked: &mut [u8]) {
        members.iter().for_each(|member| self.lattice.block(member.position(), true, blocked));
    }

    /// Searches for the patch at a pixel.
    fn search_patch(&self, model: &StaticModel<'_>, at: [usize; 2], seed: &Seed) -> Option<Patch> {
        let disparity_px = self.lattice.disparity_px(at)?;
        let pixel = at.map(|at| at as i32);
        let found = |t_previous_current: &Transform| {
            let m = self.images.matcher.find(&expected(
                model.rig,
                pixel,
                disparity_px,
                t_previous_current,
            )?)?;
            Some((m, model.residual(&m)?))
        };
        let is_static = |chi_square: f64| chi_square <= f64::from(CANDIDATE_CHI_SQUARE);
        let motion_m = seed.motion_m();
        let back = Transform::from_translation((-motion_m).into());
        // First where the object's motion would put the patch.
        if let Some((m, residual)) = found(&(self.t_previous_current * back)) {
            let side_m = motion_tolerance_m(residual.point_m.z);
            let off = residual.motion_m - motion_m;
            let is_as_supposed = libm::fabs(off.x) < side_m
                && libm::fabs(off.y) < side_m
                && libm::fabs(off.z) < side_m + 2.0 * residual.depth_sigma_m;
            // Of what is known to move, the nearer of both motions decides.
            let is_static = if seed.is_known() {
                scaled(&residual.motion_m, &residual) < scaled(&off, &residual)
            } else {
                is_static(residual.chi_square)
            };
            if is_static {
                return Some(Patch::Static);
            }
            // In a row of posts the next one is found as well as the post itself.
            let is_unsure = !seed.is_known()
                && residual.point_m.z < FROM_M
                && self.is_static_at(model, pixel, disparity_px);
            if is_as_supposed && !is_unsure {
                return Some(Patch::Moving(Candidate::new(&m, &residual, 0)));
            }
        }
        self.is_static_at(model, pixel, disparity_px).then_some(Patch::Static)
    }

    /// Returns true if a patch is found where a static point would be.
    fn is_static_at(&self, model: &StaticModel<'_>, pixel: [i32; 2], disparity_px: f64) -> bool {
        let expected = expected(model.rig, pixel, disparity_px, &self.t_previous_current);
        let found = expected
            .and_then(|expected| self.images.matcher.find(&expected))
            .and_then(|m| model.residual(&m));
        found.is_some_and(|residual| residual.chi_square <= f64::from(CANDIDATE_CHI_SQUARE))
    }

    /// Returns true if a near group is one of a row of posts or the like, each taken for the next:
    /// more than a third of its members are found where static points would be.
    pub fn is_repeated(
        &mut self,
        model: &StaticModel<'_>,
        candidates: &[Candidate],
        group: &Group,
    ) -> bool {
        if group.depth_m >= FROM_M {
            return false;
        }
        let (mut still, mut searched) = (0u32, 0u32);
        for member in candidates.iter().filter(|member| member.is_of(group.first)).take(MAX_PATCHES)
        {
            // The budget of the frame: without any left, what was found so far decides.
            let Some(left) = self.left.checked_sub(1) else { break };
            self.left = left;
            let [u, v, disparity_px] = member.position();
            searched += 1;
            still += u32::from(self.is_static_at(
                model,
                [u, v].map(|at| libm::roundf(at) as i32),
                f64::from(disparity_px),
            ));
        }
        3 * still > searched
    }
}
