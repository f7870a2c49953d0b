//! The groups of a frame that contradict a static world, and the hypotheses they continue.

use super::groups::MEMBERS_MIN;
use super::{
    MotionSegmenter, SegmentationReport,
    collect::{Owned, free_matches},
    groups::{self, Group, MAX_GROUPS},
    joint,
    lattice::Lattice,
    patches::{PatchMemory, PatchSearch},
    residual::StaticModel,
    seed::Seed,
};
use crate::{geometry::Transform, masks::PixelBox};

/// Camera and model against which contradictions to a static world are found.
pub(super) struct Contradictions<'a> {
    pub model: &'a StaticModel<'a>,
    pub t_world_camera: &'a Transform,
    /// Matches refined below the pixel, and those at whole pixels.
    pub refined: Owned<'a>,
    pub sparse: Owned<'a>,
    pub lattice: &'a Lattice<'a>,
}

/// The groups found so far.
#[derive(Default)]
struct Found {
    groups: heapless::Vec<Group, MAX_GROUPS>,
    report: SegmentationReport,
}

impl MotionSegmenter<'_> {
    /// Groups what contradicts the static model and continues the hypotheses. With `search`, the
    /// places that have too few matches are searched for more.
    pub(super) fn observe(
        &mut self,
        input: &Contradictions<'_>,
        search: Option<PatchSearch<'_, '_>>,
    ) -> SegmentationReport {
        let (model, refined) = (input.model, &input.refined);
        let mut found = Found::default();
        let len = self.collect(model, refined, &mut found.report);
        let len = self.collect_joint(model, refined, input.lattice.ground(), len);
        // Where static matches lie, no object grows.
        self.block_static(input.lattice, refined);
        let Some(candidates) = self.candidates.get_mut(..len) else { return found.report };
        groups::join(candidates, model.rig.focal_px);
        let marked = free_matches(refined, self.is_candidate);
        found.report.refused +=
            groups::select(model, candidates, marked, self.values, &mut found.groups);
        // Patch search costs time: without it the groups are the answer.
        if let Some(mut search) = search {
            // A row of posts looks as if it moved by one post.
            found.groups.retain(|group| !search.is_repeated(model, candidates, group));
            self.seed_count = 0;
            self.seed_predicted(input.t_world_camera);
            self.seed_small_groups(len);
            let len = self.add_sparse(model, &input.sparse, &mut search, &mut found);
            self.seed_small_groups(len);
            self.verify(model, search, &mut found);
        }
        found.report.groups = found.groups.len() as u32;
        found.report.refused +=
            self.hypotheses.update(model.config, &found.groups, input.t_world_camera);
        found.report
    }

    /// Widens the groups by those of sparse matches: the sides of a near object are too steep for
    /// refined ones, whose neighbours must have like disparities. Returns how many candidates there
    /// are.
    // Never inlined, so that its groups are off the stack when patches are searched for.
    #[inline(never)]
    fn add_sparse(
        &mut self,
        model: &StaticModel<'_>,
        sparse: &Owned<'_>,
        search: &mut PatchSearch<'_, '_>,
        found: &mut Found,
    ) -> usize {
        // The report counts the dense matches alone: that of the sparse ones is dropped.
        let len = self.collect(model, sparse, &mut SegmentationReport::default());
        let candidates = self.candidates.get_mut(..len).unwrap_or_default();
        groups::join(candidates, model.rig.focal_px);
        let marked = free_matches(sparse, self.is_candidate);
        let mut groups = heapless::Vec::<Group, MAX_GROUPS>::new();
        found.report.refused += groups::select(model, candidates, marked, self.values, &mut groups);
        // Posts of a fence match their neighbours and seem to move.
        groups.retain(|group| !search.is_repeated(model, candidates, group));
        found.report.refused += groups::add(&mut found.groups, &groups, MEMBERS_MIN);
        len
    }

    /// Supposes an object; one beyond the bound is not searched for.
    fn seed(&mut self, seed: Seed) {
        if let Some(slot) = self.seeds.get_mut(self.seed_count) {
            *slot = seed;
            self.seed_count += 1;
        }
    }

    /// Supposes each followed group where its motion takes it.
    fn seed_predicted(&mut self, t_world_camera: &Transform) {
        for index in 0..self.hypotheses.all().len() {
            let Some(hypothesis) = self.hypotheses.all().get(index).copied() else { break };
            let (extent, motion_m) = hypothesis.predicted(t_world_camera);
            self.seed(Seed::new(&extent, motion_m).known(hypothesis.is_confirmed()));
        }
    }

    /// Supposes an object at each group of three candidates or more that moves.
    fn seed_small_groups(&mut self, len: usize) {
        for first in 0..len {
            let Some(candidates) = self.candidates.get(..len) else { return };
            // Each group once: by its first member.
            if candidates.get(first).is_none_or(|candidate| !candidate.is_first(first)) {
                continue;
            }
            let group = groups::measure(candidates, first as u32, self.values)
                .filter(|group| group.is_plausible());
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
        found: &mut Found,
    ) {
        let Self { seeds, seed_count, cells, blocked, queue, patches, values, .. } = self;
        let mut memory = PatchMemory { cells, queue, members: patches, values };
        for seed in seeds.iter().take(*seed_count) {
            // A group found by its matches needs no patches.
            if found.groups.iter().any(|group| seed.is_at(group)) {
                continue;
            }
            if let Some(group) = search.verify(model, seed, &mut memory) {
                // What the patches showed to move no longer blocks growth.
                search.unblock(
                    memory.members.get(..group.members as usize).unwrap_or_default(),
                    blocked,
                );
                found.report.refused += u32::from(found.groups.push(group).is_err());
            }
        }
    }

    /// Grows the mask of the confirmed hypothesis at that position; the pixels it lies in.
    pub(super) fn grow(
        &mut self,
        index: usize,
        lattice: &Lattice<'_>,
        t_world_camera: &Transform,
    ) -> Option<PixelBox> {
        let hypothesis =
            self.hypotheses.all().get(index).filter(|hypothesis| hypothesis.is_shown())?;
        let extent = hypothesis.extent(t_world_camera);
        // Of what was not found again, far matches say nothing.
        let is_decided = hypothesis.is_observed() || extent.center().z < joint::FROM_M;
        let blocked = if is_decided { &*self.blocked } else { &[] };
        lattice.grow(&extent, blocked, self.cells, self.queue)
    }
}
