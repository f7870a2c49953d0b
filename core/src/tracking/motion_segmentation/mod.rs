//! Moving objects without a detector: matches that contradict a static world, grouped and grown to
//! masks.
//!
//! The statistics are those of Zhou, Frémont, Quost, Dai, Li, *Moving object detection and
//! segmentation in urban environments from a moving platform* (IVC 68, 2017), on sparse matches
//! over two stereo pairs in place of dense flow:
//!
//! 1. matches whose residual against the camera's motion is too large for its covariance are
//!    *candidates* (`residual`);
//! 2. so are far matches that contradict it only together with their neighbours (`joint`): what
//!    keeps its distance to the camera;
//! 3. candidates that lie together and move alike form groups; a group must have enough members and
//!    motion, and nearly all matches within its box must be candidates (`groups`): of wrong matches
//!    and of poorly known depth that is not so;
//! 4. where candidates are few, and where an object of the frames before must be, patches are
//!    searched for by projection; a near group whose patches are found as well where static points
//!    would be is one of a row of posts or the like, and no moving object (`patches`);
//! 5. a group that agrees with one of the frames before is an object, and is predicted over frames
//!    without one (`hypotheses`);
//! 6. what it left in the static map before that is erased (`trail`);
//! 7. its mask grows from its extent over the disparity image, above the ground, but not over
//!    matches that do not move (`lattice`, `ground`).
//!
//! Matches assigned to an instance of the detector are left out: an object is not found twice.
//!
//! Memory: 44 bytes for each of 1,024 candidates, 48 for each of 1,024 far matches, a byte a match,
//! 6 bytes for each 4 x 4 px of the image, 96 bytes for each of 64 hypotheses, 80 for each of 32
//! supposed objects. Time: a triangulation and projection a match, a comparison for each pair of
//! candidates and of far matches, the cells of each mask, and at most 384 patches a frame.
//!
//! # What can go wrong
//!
//! Objects with fewer matches than a group needs are not found, nor are those that move less than
//! depth errs by. What moves along the line of sight in the camera's own direction and speed has no
//! residual in the image, but in disparity. A wrong camera motion makes everything a candidate:
//! groups are then too large, and refused.

mod collect;
mod config;
mod ground;
mod groups;
mod hypotheses;
mod joint;
mod lattice;
mod patches;
mod residual;
#[cfg(test)]
mod tests;
mod trail;

pub use config::SegmentationConfig;
pub use ground::Ground;
pub(crate) use trail::Trail;

use super::{
    CameraMotion, Class, FrameMatches, GuidedMatching, Tracker, match_assignment::OwnerCode,
};
use crate::{
    geometry::{StereoRig, Transform},
    image::View,
    masks::PixelBox,
    memory::{Capacity, Carver, region_bytes},
    scene_flow::Match,
    state::Visitor,
};
use collect::free_matches;
use groups::{CANDIDATES_MAX, Candidate, GROUPS_MAX, Group};
use hypotheses::{HYPOTHESES_MAX, Hypotheses, Hypothesis};
use joint::{FarMatch, JOINT_MAX};
use lattice::{CELL_PX, Lattice};
use patches::{PATCHES_MAX, PatchMemory, PatchSearch, SEEDS_MAX, Seed};
use residual::StaticModel;

/// Score of an instance found by its motion.
const SCORE: f32 = 0.9;

/// Variance of a sparse match, at whole pixels, against that of a refined one.
const SPARSE_VARIANCE: f64 = 4.0;

/// What the disparity image says of a frame.
struct Shape<'a> {
    lattice: Lattice<'a>,
    ground: Option<Ground>,
}

/// What motion segmentation found in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct SegmentationReport {
    /// Matches that were not assigned to an instance of the detector.
    pub matches: u32,
    /// Candidates among them.
    pub candidates: u32,
    /// Groups that passed the gates.
    pub groups: u32,
    /// Instances made of them, or predicted.
    pub instances: u32,
    /// Groups and instances beyond a bound.
    pub refused: u32,
}

/// Motion segmentation, with what it remembers from frame to frame.
#[derive(Debug)]
pub(super) struct MotionSegmenter<'s> {
    candidates: &'s mut [Candidate],
    is_candidate: &'s mut [u8],
    far: &'s mut [FarMatch],
    values: &'s mut [f32],
    cells: &'s mut [u8],
    blocked: &'s mut [u8],
    queue: &'s mut [u32],
    seeds: &'s mut [Seed],
    seed_count: usize,
    patches: &'s mut [Candidate],
    hypotheses: Hypotheses<'s>,
}

/// Cells of the largest image.
const fn cells(capacity: &Capacity) -> usize {
    capacity.image_width.div_ceil(CELL_PX) * capacity.image_height.div_ceil(CELL_PX)
}

impl<'s> MotionSegmenter<'s> {
    /// Bytes of the slab.
    pub const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<Candidate>(CANDIDATES_MAX)
            + region_bytes::<u8>(capacity.matches)
            + region_bytes::<FarMatch>(JOINT_MAX)
            + region_bytes::<f32>(CANDIDATES_MAX)
            + 2 * region_bytes::<u8>(cells(capacity))
            + region_bytes::<u32>(cells(capacity))
            + region_bytes::<Seed>(SEEDS_MAX)
            + region_bytes::<Candidate>(PATCHES_MAX)
            + region_bytes::<Hypothesis>(HYPOTHESES_MAX)
    }

    /// Allocates its regions.
    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self {
            candidates: carver.alloc("segmentation.candidate", CANDIDATES_MAX),
            is_candidate: carver.alloc("segmentation.is_candidate", capacity.matches),
            far: carver.alloc("segmentation.far", JOINT_MAX),
            values: carver.alloc("segmentation.value", CANDIDATES_MAX),
            cells: carver.alloc("segmentation.cell", cells(capacity)),
            blocked: carver.alloc("segmentation.blocked", cells(capacity)),
            queue: carver.alloc("segmentation.queue", cells(capacity)),
            seeds: carver.alloc("segmentation.seed", SEEDS_MAX),
            seed_count: 0,
            patches: carver.alloc("segmentation.patch", PATCHES_MAX),
            hypotheses: Hypotheses::new(carver.alloc("segmentation.hypothesis", HYPOTHESES_MAX)),
        }
    }

    /// Visits what outlives a frame.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self {
            candidates: _,
            is_candidate: _,
            far: _,
            values: _,
            cells: _,
            blocked: _,
            queue: _,
            seeds: _,
            seed_count: _,
            patches: _,
            hypotheses,
        } = self;
        hypotheses.visit(visitor);
    }

    /// Visits where objects were before they were known to move.
    pub fn take_trails(&mut self, t_world_camera: &Transform, visit: impl FnMut(&Trail)) {
        self.hypotheses.take_trails(t_world_camera, visit);
    }

    /// Groups what contradicts the static model and continues the hypotheses. With `search`, the
    /// places that have too few matches are searched for more. `match_owners` are those of the
    /// refined and of the sparse matches.
    fn observe(
        &mut self,
        model: &StaticModel<'_>,
        camera: &CameraMotion,
        matches: &FrameMatches<'_>,
        match_owners: [&[OwnerCode]; 2],
        shape: &Shape<'_>,
        search: Option<PatchSearch<'_, '_>>,
    ) -> SegmentationReport {
        let mut report = SegmentationReport::default();
        let [match_owner, sparse_owner] = match_owners;
        let len = self.collect(model, matches.refined, match_owner, 1.0, &mut report);
        let len =
            self.collect_joint(model, matches.refined, match_owner, shape.ground.as_ref(), len);
        self.block_static(&shape.lattice, matches.refined, match_owner);
        let Some(candidates) = self.candidates.get_mut(..len) else { return report };
        groups::join(candidates, model.rig.focal_px);
        let marked = free_matches(matches.refined, match_owner, self.is_candidate);
        let mut groups = heapless::Vec::<Group, GROUPS_MAX>::new();
        groups::select(model, candidates, marked, self.values, &mut groups, &mut report.refused);
        if let Some(mut search) = search {
            groups.retain(|group| !search.is_repeated(model, candidates, group));
            self.seed_count = 0;
            self.seed_predicted(camera);
            self.seed_small_groups(model.config, len);
            let len = self.collect(
                model,
                matches.sparse,
                sparse_owner,
                SPARSE_VARIANCE,
                &mut SegmentationReport::default(),
            );
            self.add_sparse(
                model,
                (matches.sparse, sparse_owner),
                len,
                &mut search,
                &mut groups,
                &mut report,
            );
            self.seed_small_groups(model.config, len);
            self.verify(model, search, &mut groups, &mut report);
        }
        report.groups = groups.len() as u32;
        report.refused += self.hypotheses.update(model.config, &groups, &camera.t_world_camera);
        report
    }

    /// Widens the groups by those among the first `len` candidates, of sparse matches: the sides of
    /// a near object are too steep for refined ones, whose neighbours must have like disparities.
    // Never inlined, so that its groups are off the stack when patches are searched for.
    #[inline(never)]
    fn add_sparse(
        &mut self,
        model: &StaticModel<'_>,
        (matches, match_owner): (&[Match], &[OwnerCode]),
        len: usize,
        search: &mut PatchSearch<'_, '_>,
        groups: &mut heapless::Vec<Group, GROUPS_MAX>,
        report: &mut SegmentationReport,
    ) {
        let candidates = self.candidates.get_mut(..len).unwrap_or_default();
        groups::join(candidates, model.rig.focal_px);
        let marked = free_matches(matches, match_owner, self.is_candidate);
        let mut sparse = heapless::Vec::<Group, GROUPS_MAX>::new();
        groups::select(model, candidates, marked, self.values, &mut sparse, &mut report.refused);
        sparse.retain(|group| !search.is_repeated(model, candidates, group));
        report.refused += groups::add(groups, &sparse, model.config.members_min);
    }

    /// Supposes an object; one beyond the bound is not searched for.
    fn seed(&mut self, seed: Seed) {
        if let Some(slot) = self.seeds.get_mut(self.seed_count) {
            *slot = seed;
            self.seed_count += 1;
        }
    }

    /// Supposes each followed group where its motion takes it.
    fn seed_predicted(&mut self, camera: &CameraMotion) {
        for index in 0..self.hypotheses.all().len() {
            let Some(hypothesis) = self.hypotheses.all().get(index).copied() else { break };
            let (extent, motion_m) = hypothesis.predicted(&camera.t_world_camera);
            self.seed(Seed::new(&extent, motion_m).known(hypothesis.is_confirmed()));
        }
    }

    /// Supposes an object at each group of three candidates or more that moves.
    fn seed_small_groups(&mut self, config: &SegmentationConfig, len: usize) {
        for first in 0..len {
            let Some(candidates) = self.candidates.get(..len) else { return };
            if candidates.get(first).is_none_or(|candidate| !candidate.is_first(first)) {
                continue;
            }
            let group = groups::measure(candidates, first as u32, self.values)
                .filter(|group| group.is_plausible(config));
            if let Some(group) = group {
                self.seed(Seed::new(&group.extent, group.motion_m));
            }
        }
    }

    /// Adds the groups of supposed objects that are there, where none was found.
    fn verify(
        &mut self,
        model: &StaticModel<'_>,
        mut search: PatchSearch<'_, '_>,
        groups: &mut heapless::Vec<Group, GROUPS_MAX>,
        report: &mut SegmentationReport,
    ) {
        let Self { seeds, seed_count, cells, blocked, queue, patches, values, .. } = self;
        let mut memory = PatchMemory { cells, queue, members: patches, values };
        for seed in seeds.iter().take(*seed_count) {
            if groups.iter().any(|group| seed.is_at(group)) {
                continue;
            }
            if let Some(group) = search.verify(model, seed, &mut memory) {
                search.unblock(
                    memory.members.get(..group.members as usize).unwrap_or_default(),
                    blocked,
                );
                report.refused += u32::from(groups.push(group).is_err());
            }
        }
    }

    /// Grows the mask of the confirmed hypothesis at that position; the pixels it lies in.
    fn grow(
        &mut self,
        config: &SegmentationConfig,
        index: usize,
        shape: &Shape<'_>,
        camera: &CameraMotion,
    ) -> Option<PixelBox> {
        let hypothesis =
            self.hypotheses.all().get(index).filter(|hypothesis| hypothesis.is_shown(config))?;
        let extent = hypothesis.extent(&camera.t_world_camera);
        // Of what was not found again, far matches say nothing.
        let is_decided = hypothesis.is_observed() || extent.center().z < joint::FROM_M;
        let blocked = if is_decided { &*self.blocked } else { &[] };
        shape.lattice.grow(&extent, shape.ground.as_ref(), blocked, self.cells, self.queue)
    }
}

impl Tracker<'_> {
    /// Adds instances of class [`Class::MovingObject`] for what moves in this frame, associates
    /// them with tracks and assigns their matches to them.
    pub(super) fn segment_motion(
        &mut self,
        rig: &StereoRig,
        camera: &CameraMotion,
        matches: &FrameMatches<'_>,
        disparity_q8: View<'_, u16>,
        search: Option<GuidedMatching<'_, '_>>,
    ) {
        let config = self.config;
        let Some(t_current_previous) =
            camera.t_current_previous.filter(|_| config.dynamic && config.segmentation.enabled)
        else {
            return;
        };
        let bias_px = [config.motion.bias_px, config.motion.lens_px].map(f64::from);
        let model = StaticModel::new(&config.segmentation, rig, &t_current_previous, bias_px);
        let lattice = Lattice::new(rig, disparity_q8);
        let shape = Shape { ground: Ground::find(&lattice), lattice };
        let search = search.map(|search| PatchSearch::new(search, &t_current_previous, &shape));
        let match_owners = [&*self.refined_owner, &*self.sparse_owner];
        let mut report =
            self.segmenter.observe(&model, camera, matches, match_owners, &shape, search);
        let first = self.instances.all().len();
        let mut index = 0;
        while index < self.segmenter.hypotheses.all().len() {
            let grown = self.segmenter.grow(&config.segmentation, index, &shape, camera);
            let added = grown.map(|pixels| self.add_moving_object(&shape, pixels));
            match added {
                Some(Added::Covered) => {
                    // A detector's instance has taken over.
                    self.segmenter.hypotheses.remove(index);
                    continue;
                }
                Some(Added::Yes) => report.instances += 1,
                Some(Added::Full) => report.refused += 1,
                None => {}
            }
            let shown = matches!(added, Some(Added::Yes));
            self.segmenter.hypotheses.note_shown(&config.segmentation, index, shown);
            index += 1;
        }
        self.report.segmentation = report;
        if self.instances.all().len() > first {
            let masks = &self.masks;
            self.tracks.associate_from(
                first,
                &config,
                self.frame,
                self.instances.all_mut(),
                masks,
                &mut self.report.tracks,
            );
            self.assign_from(first, matches);
        }
    }

    /// Adds the marked cells as an instance.
    fn add_moving_object(&mut self, shape: &Shape<'_>, pixels: PixelBox) -> Added {
        let masks = self.masks.current_mut();
        let Some(mask) = masks.alloc(pixels) else { return Added::Full };
        let cells = &*self.segmenter.cells;
        masks.fill(&mask, |u, v| shape.lattice.is_own(shape.ground.as_ref(), cells, u, v));
        let whole = masks.area(&mask);
        self.instances.all().iter().for_each(|instance| masks.subtract(&mask, &instance.mask));
        if 3 * masks.area(&mask) <= 2 * whole {
            masks.free_last(mask);
            return Added::Covered;
        }
        if self.instances.add(&self.config, mask, Class::MovingObject, SCORE, self.size[0]) {
            Added::Yes
        } else {
            masks.free_last(mask);
            Added::Full
        }
    }
}

/// What became of a moving object.
enum Added {
    Yes,
    /// Other instances have a third of its pixels or more.
    Covered,
    /// There was no space for it.
    Full,
}
