//! The candidates among a frame's matches, and what lies still between them.

use super::{
    MotionSegmenter, SegmentationReport, ground::Ground, groups::Candidate, joint::FarMatches,
    lattice::Lattice, residual::StaticModel,
};
use crate::{
    scene_flow::Match,
    tracking::match_assignment::{MatchOwner, OwnerCode},
};

impl MotionSegmenter<'_> {
    /// Collects the candidates among matches whose variance is `variance` times that of refined
    /// ones; how many they are.
    pub(super) fn collect(
        &mut self,
        model: &StaticModel<'_>,
        matches: &[Match],
        match_owner: &[OwnerCode],
        variance: f64,
        report: &mut SegmentationReport,
    ) -> usize {
        let (mut len, mut stride, mut count) = (0, 1, 0usize);
        let (least, far_m) = (
            variance * f64::from(model.config.candidate_chi_square),
            f64::from(model.config.far_m),
        );
        for ((m, match_owner), mark) in
            matches.iter().zip(match_owner).zip(self.is_candidate.iter_mut())
        {
            *mark = 0;
            let residual = if is_free(*match_owner) { model.residual(m) } else { None };
            report.matches += u32::from(is_free(*match_owner));
            let Some(residual) =
                residual.filter(|found| found.chi_square > least && found.point_m.z < far_m)
            else {
                continue;
            };
            *mark = 1;
            count += 1;
            if !(count - 1).is_multiple_of(stride) {
                continue;
            }
            if len == self.candidates.len() {
                // Every second one stays.
                len = thin(self.candidates);
                stride *= 2;
                if !(count - 1).is_multiple_of(stride) {
                    continue;
                }
            }
            if let Some(slot) = self.candidates.get_mut(len) {
                *slot = Candidate::new(m, &residual, len);
                len += 1;
            }
        }
        report.candidates = count as u32;
        len
    }

    /// Blocks the cells of matches that do not move.
    pub(super) fn block_static(
        &mut self,
        lattice: &Lattice<'_>,
        matches: &[Match],
        match_owner: &[OwnerCode],
    ) {
        self.blocked.fill(0);
        let marked = free_matches(matches, match_owner, self.is_candidate);
        for moves in [false, true] {
            let at = |m: &Match| [m.current_left[0], m.current_left[1], m.current_disparity_px()];
            marked
                .clone()
                .filter(|(_, marked)| *marked == moves)
                .for_each(|(m, _)| lattice.block(at(m), moves, self.blocked));
        }
    }

    /// Adds the far matches that are candidates only together with their neighbours, behind the
    /// first `len`; how many candidates there are then.
    pub(super) fn collect_joint(
        &mut self,
        model: &StaticModel<'_>,
        matches: &[Match],
        match_owner: &[OwnerCode],
        ground: Option<&Ground>,
        mut len: usize,
    ) -> usize {
        let mut far = FarMatches::new(self.far);
        for (index, ((m, _), mark)) in matches
            .iter()
            .zip(match_owner)
            .zip(&*self.is_candidate)
            .enumerate()
            .filter(|(_, ((_, match_owner), _))| is_free(**match_owner))
        {
            let residual = model
                .residual(m)
                .filter(|residual| residual.point_m.z < f64::from(model.config.far_m));
            residual
                .into_iter()
                .for_each(|residual| far.add(m, index, &residual, *mark > 0, ground));
        }
        for at in 0..far.len() {
            let Some(slot) = self.candidates.get_mut(len) else { break };
            let Some((index, residual)) = far.candidate(model, matches, at) else { continue };
            let Some((m, mark)) = matches.get(index).zip(self.is_candidate.get_mut(index)) else {
                continue;
            };
            (*slot, *mark) = (Candidate::new(m, &residual, len), 1);
            len += 1;
        }
        len
    }
}

/// Whether a match belongs to no instance.
fn is_free(match_owner: OwnerCode) -> bool {
    match_owner.get() == MatchOwner::None
}

/// The matches that belong to no instance, each with whether it is a candidate.
pub(super) fn free_matches<'m>(
    matches: &'m [Match],
    match_owner: &'m [OwnerCode],
    is_candidate: &'m [u8],
) -> impl Iterator<Item = (&'m Match, bool)> + Clone {
    let free = matches
        .iter()
        .zip(match_owner)
        .zip(is_candidate)
        .filter(|((_, match_owner), _)| is_free(**match_owner));
    free.map(|((m, _), mark)| (m, *mark > 0))
}

/// Keeps every second candidate; how many those are.
fn thin(candidates: &mut [Candidate]) -> usize {
    let len = candidates.len().div_ceil(2);
    for index in 0..len {
        let kept = candidates.get(2 * index).copied();
        if let Some((slot, kept)) = candidates.get_mut(index).zip(kept) {
            *slot = kept.at(index);
        }
    }
    len
}
