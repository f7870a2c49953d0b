//! More matches where candidates are few: patches of the mask that an object would have, searched for where its motion projects them.
//!
//! A small or fast object has too few features for a group. Of a few candidates that move alike, and of an object of the frame before, the
//! mask grows first. Its cells are then searched for in the other images: from where the supposed motion projects them and, where
//! they are not found or move otherwise, from where a static point would be. The gates for the group of those that move as supposed are
//! the same as for features: enough members, and few static patches among them.
//!
//! Time: at most [`SEARCHES_MAX`] patches a frame, each searched for once or twice.

use super::{
    SegmentationConfig,
    ground::Ground,
    groups::{Candidate, Extent, Group, measure, motion_tolerance_m},
    lattice::Lattice,
    residual::StaticModel,
};
use crate::{
    geometry::Transform,
    tracking::guided_matching::{GuidedMatching, expected},
};
use bytemuck::{Pod, Zeroable};
use nalgebra::Vector3;

/// Most supposed objects of a frame.
pub(super) const SEEDS_MAX: usize = 32;
/// Most patches of one of them.
pub(super) const PATCHES_MAX: usize = 48;
/// Most patches of a frame.
const SEARCHES_MAX: usize = 384;
/// How far an object reaches beyond a few members, m.
const REACH_M: f64 = 0.3;
/// The same along the depth, m for each m^2 of squared depth.
const REACH_PER_SQUARED_DEPTH: f64 = 0.001;

/// An object that is supposed to be there: its extent in the current camera, and its motion against the static prediction.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(in crate::tracking) struct Seed {
    low_m: [f64; 3],
    high_m: [f64; 3],
    motion_m: [f64; 3],
}

impl Seed {
    pub fn new(extent: &Extent, motion_m: Vector3<f64>) -> Self {
        Self { low_m: extent.low, high_m: extent.high, motion_m: motion_m.into() }
    }

    /// Its extent and a little more.
    fn extent(&self) -> Extent {
        let mut extent = Extent { low: self.low_m, high: self.high_m };
        let depth_m = extent.center().z;
        let reaches = [REACH_M, REACH_M, REACH_M + REACH_PER_SQUARED_DEPTH * depth_m * depth_m];
        for ((low, high), reach_m) in extent.low.iter_mut().zip(&mut extent.high).zip(reaches) {
            (*low, *high) = (*low - reach_m, *high + reach_m);
        }
        extent
    }

    /// Whether a group lies where it is.
    pub fn is_at(&self, group: &Group) -> bool {
        Extent { low: self.low_m, high: self.high_m }.gap(&group.extent) < REACH_M
    }
}

/// What a patch shows.
enum Patch {
    Moving(Candidate),
    Static,
}

/// What patches are searched for with in a frame.
pub(super) struct PatchSearch<'a, 's> {
    images: GuidedMatching<'a, 's>,
    t_previous_current: Transform,
    lattice: &'a Lattice<'a>,
    ground: Option<&'a Ground>,
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
        ground: Option<&'a Ground>,
    ) -> Self {
        Self {
            images,
            t_previous_current: t_current_previous.inverse(),
            lattice,
            ground,
            left: SEARCHES_MAX,
        }
    }

    /// The group of a supposed object's patches, if it passes the gates.
    pub fn verify(&mut self, model: &StaticModel<'_>, seed: &Seed, memory: &mut PatchMemory<'_>) -> Option<Group> {
        let PatchMemory { cells, queue, members, values } = memory;
        let pixels = self.lattice.grow(&seed.extent(), self.ground, cells, queue)?;
        let every = self.lattice.marked(cells, &pixels).count().div_ceil(PATCHES_MAX);
        let (mut moving, mut still) = (0usize, 0usize);
        let marked = self.lattice.marked(cells, &pixels).enumerate().filter(|(index, _)| index.is_multiple_of(every));
        for (_, at) in marked {
            self.left = self.left.checked_sub(1)?;
            match self.search_patch(model, at, &seed.motion_m.into()) {
                Some(Patch::Moving(candidate)) => {
                    *members.get_mut(moving)? = candidate;
                    moving += 1;
                }
                Some(Patch::Static) => still += 1,
                None => {}
            }
        }
        let share = f64::from(model.config.candidate_share_min);
        let is_moving = moving as f64 >= share * (moving + still) as f64;
        let group = measure(members.get(..moving)?, 0, values).filter(|_| is_moving)?;
        group.passes(model.config).then_some(group)
    }

    /// Searches for the patch at a pixel.
    fn search_patch(&self, model: &StaticModel<'_>, at: [usize; 2], motion_m: &Vector3<f64>) -> Option<Patch> {
        let config: &SegmentationConfig = model.config;
        let disparity_px = self.lattice.disparity_px(at)?;
        let pixel = at.map(|at| at as i32);
        let found = |t_previous_current: &Transform| {
            let m = self.images.matcher.find(&expected(model.rig, pixel, disparity_px, t_previous_current)?)?;
            Some((m, model.residual(&m)?))
        };
        let is_static = |chi_square: f64| chi_square <= f64::from(config.candidate_chi_square);
        let back = Transform::from_translation((-motion_m).into());
        if let Some((m, residual)) = found(&(self.t_previous_current * back)) {
            let side_m = motion_tolerance_m(residual.point_m.z);
            let off = residual.motion_m - motion_m;
            let is_as_supposed =
                libm::fabs(off.x) < side_m && libm::fabs(off.y) < side_m && libm::fabs(off.z) < side_m + 2.0 * residual.depth_sigma_m;
            if is_static(residual.chi_square) {
                return Some(Patch::Static);
            }
            if is_as_supposed {
                return Some(Patch::Moving(Candidate::new(&m, &residual, 0)));
            }
        }
        found(&self.t_previous_current).filter(|(_, residual)| is_static(residual.chi_square)).map(|_| Patch::Static)
    }
}
