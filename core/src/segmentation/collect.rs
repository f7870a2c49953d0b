//! The candidates among a frame's matches, and what lies still between them.

use super::residual::CANDIDATE_CHI_SQUARE;
use super::{
    MotionSegmenter, SegmentationReport, candidate::Candidate, joint::FarMatches, lattice::Lattice,
    residual::StaticModel,
};
use crate::{
    geometry::GroundPlane,
    scene_flow::Match,
    tracking::{MatchOwner, OwnerCode},
};

/// Variance of a sparse match, at whole pixels, against that of a refined one.
pub(super) const SPARSE_VARIANCE: f64 = 4.0;

/// Matches of one kind, each with what it is assigned to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Owned<'a> {
    pub matches: &'a [Match],
    pub codes: &'a [OwnerCode],
    /// Variance of a match against that of a refined one.
    pub variance: f64,
}

impl MotionSegmenter<'_> {
    /// Collects the candidates among matches; how many they are.
    pub(super) fn collect(
        &mut self,
        model: &StaticModel<'_>,
        given: &Owned<'_>,
        report: &mut SegmentationReport,
    ) -> usize {
        let (mut len, mut stride, mut count) = (0, 1, 0usize);
        let (least, far_m) =
            (given.variance * f64::from(CANDIDATE_CHI_SQUARE), f64::from(model.config.far_m));
        for ((m, match_owner), mark) in
            given.matches.iter().zip(given.codes).zip(self.is_candidate.iter_mut())
        {
            *mark = 0;
            // A match that an instance owns is explained, and no candidate.
            let residual = if is_free(*match_owner) { model.residual(m) } else { None };
            report.matches += u32::from(is_free(*match_owner));
            let Some(residual) =
                residual.filter(|found| found.chi_square > least && found.point_m.z < far_m)
            else {
                continue;
            };
            *mark = 1;
            count += 1;
            // Once the buffer has overflowed, only every second, fourth, ... candidate is taken:
            // the sample stays even over the image.
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
    pub(super) fn block_static(&mut self, lattice: &Lattice<'_>, given: &Owned<'_>) {
        self.blocked.fill(0);
        let marked = free_matches(given, self.is_candidate);
        // Those that stand first, so that one that moves frees the cell for its object.
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
        given: &Owned<'_>,
        ground: Option<&GroundPlane>,
        mut len: usize,
    ) -> usize {
        let mut far = FarMatches::new(self.far, ground);
        for (index, ((m, _), mark)) in given
            .matches
            .iter()
            .zip(given.codes)
            .zip(&*self.is_candidate)
            .enumerate()
            .filter(|(_, ((_, match_owner), _))| is_free(**match_owner))
        {
            let residual = model
                .residual(m)
                .filter(|residual| residual.point_m.z < f64::from(model.config.far_m));
            // Matches that are candidates already are added, too: they are neighbours of the
            // others.
            residual.into_iter().for_each(|residual| far.add(m, index, &residual, *mark > 0));
        }
        // Joint candidates come last: what fits into the buffer decides how many.
        for at in 0..far.len() {
            let Some(slot) = self.candidates.get_mut(len) else { break };
            let Some((index, residual)) = far.candidate(model, given.matches, at) else { continue };
            let Some((m, mark)) = given.matches.get(index).zip(self.is_candidate.get_mut(index))
            else {
                continue;
            };
            (*slot, *mark) = (Candidate::new(m, &residual, len), 1);
            len += 1;
        }
        len
    }
}

/// Returns true if a match belongs to no instance.
fn is_free(match_owner: OwnerCode) -> bool {
    match_owner.get() == MatchOwner::None
}

/// The matches that belong to no instance, each with whether it is a candidate.
pub(super) fn free_matches<'m>(
    given: &Owned<'m>,
    is_candidate: &'m [u8],
) -> impl Iterator<Item = (&'m Match, bool)> + Clone + use<'m> {
    let free = given
        .matches
        .iter()
        .zip(given.codes)
        .zip(is_candidate)
        .filter(|((_, match_owner), _)| is_free(**match_owner));
    free.map(|((m, _), mark)| (m, *mark > 0))
}

/// Keeps every second candidate; how many those are.
fn thin(candidates: &mut [Candidate]) -> usize {
    // Rounded up: of an odd number the last one stays.
    let len = candidates.len().div_ceil(2);
    for index in 0..len {
        // Written in front of where it is read, so that nothing is lost.
        let kept = candidates.get(2 * index).copied();
        if let Some((slot, kept)) = candidates.get_mut(index).zip(kept) {
            *slot = kept.at(index);
        }
    }
    len
}
