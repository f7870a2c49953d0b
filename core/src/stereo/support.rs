//! Support points: sparse matches on a grid of candidates, found over the whole disparity range and kept when they are distinct and
//! agree from left to right and back (Geiger et al., section 3.1).
//!
//! A candidate is compared by four descriptors at the corners of a 5 x 5 square about it: 64 gradient samples. Only two rows of
//! descriptors per image and row of candidates are ever needed.
//!
//! Memory: two bytes a candidate, four rows of descriptors. Time: candidates x disparities x 4 descriptor distances, and once more for
//! those that pass the other tests.

use super::{
    StereoConfig,
    config::DISPARITY_LIMIT,
    descriptor::{Descriptor, Gradients, MARGIN, distance_of_four, texture},
};

/// No match at this candidate.
pub(super) const NO_MATCH: i16 = -1;
/// The corner descriptors stand so far from the candidate in both directions, px.
const CORNER: usize = 2;
/// A candidate needs at least so many disparities to choose from.
const MIN_CHOICE: usize = 10;
/// The second best match is sought farther than this from the best, px.
const NEIGHBOURHOOD: usize = 1;

/// Candidates along `length` px.
pub(super) const fn candidates(length: usize, step: usize) -> usize {
    if step == 0 { 0 } else { length.div_ceil(step) }
}

/// Costs looked through at once.
const BLOCK: usize = 32;

/// What is needed to match rows of candidates: the gradients of both images.
#[derive(Clone, Copy)]
pub(super) struct SupportMatching<'a> {
    /// Parameters.
    pub config: &'a StereoConfig,
    /// Left gradients.
    pub left: Gradients<'a>,
    /// Right gradients.
    pub right: Gradients<'a>,
}

/// Two rows of descriptors, above and below a row of candidates.
struct Rows<'a> {
    above: &'a [Descriptor],
    below: &'a [Descriptor],
}

impl Rows<'_> {
    /// The four corner descriptors of column `u`.
    fn corners(&self, u: usize) -> Option<[Descriptor; 4]> {
        let (west, east) = (u.checked_sub(CORNER)?, u + CORNER);
        Some([*self.above.get(west)?, *self.above.get(east)?, *self.below.get(west)?, *self.below.get(east)?])
    }
}

impl SupportMatching<'_> {
    /// Matches the rows of candidates that begin at candidate row `first` into `grid`, as many as it holds. `scratch` is four
    /// descriptor rows.
    pub fn match_rows(&self, first: usize, grid: &mut [i16], scratch: &mut [Descriptor]) {
        let (width, step) = (self.left.width, self.config.candidate_step);
        grid.fill(NO_MATCH);
        let Some((left, right)) = scratch.split_at_mut_checked(2 * width) else { return };
        let (Some((l0, l1)), Some((r0, r1))) = (left.split_at_mut_checked(width), right.split_at_mut_checked(width)) else { return };
        for (j, out) in grid.chunks_exact_mut(candidates(width, step).max(1)).enumerate() {
            let v = (first + j) * step;
            let Some(above) = v.checked_sub(CORNER) else { continue };
            let ready = self.left.describe_row(above, l0)
                && self.left.describe_row(v + CORNER, l1)
                && self.right.describe_row(above, r0)
                && self.right.describe_row(v + CORNER, r1);
            if ready {
                self.match_row(&Rows { above: l0, below: l1 }, &Rows { above: r0, below: r1 }, out);
            }
        }
    }

    fn match_row(&self, left: &Rows<'_>, right: &Rows<'_>, out: &mut [i16]) {
        let (first, end) = (MARGIN + CORNER, self.left.width.saturating_sub(MARGIN + CORNER));
        let most = usize::from(self.config.disparity_max);
        let tolerance = usize::from(self.config.consistency_threshold);
        for (i, out) in out.iter_mut().enumerate() {
            let u = i * self.config.candidate_step;
            if u < first || u >= end {
                continue;
            }
            let Some(x) = self.best(left.corners(u), right, first.max(u.saturating_sub(most)), u) else { continue };
            let Some(back) = self.best(right.corners(x), left, x, (end - 1).min(x + most)) else { continue };
            if back.abs_diff(u) <= tolerance {
                *out = (u - x) as i16;
            }
        }
    }

    /// The column in `first..=last` of the other image that looks like `point`, if one does and no other nearly as much.
    fn best(&self, point: Option<[Descriptor; 4]>, other: &Rows<'_>, first: usize, last: usize) -> Option<usize> {
        let point = point?;
        if point.iter().any(|corner| texture(corner) < u32::from(self.config.support_texture)) {
            return None;
        }
        // At most 64 x 255 = 16,320, so that costs fit i16, whose minimum is one instruction everywhere.
        let mut costs = [i16::MAX; DISPARITY_LIMIT as usize + 1];
        let costs = costs.get_mut(..(last + 1).checked_sub(first)?)?;
        if costs.len() < MIN_CHOICE {
            return None;
        }
        let west = first - CORNER..=last - CORNER;
        let east = first + CORNER..=last + CORNER;
        let (above_west, above_east) = (other.above.get(west.clone())?, other.above.get(east.clone())?);
        let (below_west, below_east) = (other.below.get(west)?, other.below.get(east)?);
        let corners = above_west.iter().zip(above_east).zip(below_west.iter().zip(below_east));
        for (cost, ((e, f), (g, h))) in costs.iter_mut().zip(corners) {
            *cost = distance_of_four(&point, [e, f, g, h]) as i16;
        }
        self.distinct(costs).map(|i| first + i)
    }

    /// Position of the least cost, if it passes the ratio test.
    fn distinct(&self, costs: &[i16]) -> Option<usize> {
        let least = |costs: &[i16]| costs.iter().fold(i16::MAX, |a, &b| a.min(b));
        let best = least(costs);
        // By blocks, as looking for equals in one is done many at a time.
        let block = costs.chunks(BLOCK).position(|block| block.iter().fold(false, |found, &cost| found | (cost == best)))?;
        let at = block * BLOCK + costs.get(block * BLOCK..)?.iter().position(|&cost| cost == best)?;
        let before = costs.get(..at.saturating_sub(NEIGHBOURHOOD)).map_or(i16::MAX, least);
        let after = costs.get(at + NEIGHBOURHOOD + 1..).map_or(i16::MAX, least);
        (f32::from(best) < self.config.support_ratio * f32::from(before.min(after))).then_some(at)
    }
}
