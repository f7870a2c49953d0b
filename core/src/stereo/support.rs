//! Support points: sparse matches on a grid of candidates, found over the whole disparity range and
//! kept when they are distinct and agree from left to right and back (Geiger et al., section 3.1).
//!
//! A candidate is compared by four descriptors at the corners of a 5 x 5 square about it: 64
//! gradient samples. Only two rows of descriptors per image and row of candidates are ever needed.
//!
//! Memory: two bytes a candidate, four rows of descriptors. Time: candidates x disparities x 4
//! descriptor distances, and once more for those that pass the other tests.

use crate::{
    lanes::{Eight, LANES},
    sad::{Comparison, Kernels},
    slices::{clipped, clipped_mut},
};
use core::ops::RangeInclusive;

use super::{
    StereoConfig,
    config::{CANDIDATE_STEP, DISPARITY_LIMIT},
    descriptor::{Descriptor, Gradients, MARGIN, UNTEXTURED, describe_rows, eight, texture},
};

/// No match at this candidate.
pub(super) const NO_MATCH: i16 = -1;
/// The corner descriptors stand so far from the candidate in both directions, px.
const CORNER: usize = 2;
/// Least texture of a support point's descriptor, as published: sum of gradient magnitudes over its
/// 16 samples.
const SUPPORT_TEXTURE: u32 = 10;
/// A candidate needs at least so many disparities to choose from.
const MIN_CHOICE: usize = 10;
/// The second best match is sought farther than this from the best, px.
const NEIGHBOURHOOD: usize = 1;

/// Candidates along `length` px.
pub(super) const fn candidates(length: usize, step: usize) -> usize {
    if step == 0 { 0 } else { length.div_ceil(step) }
}

/// Costs looked through at once. As many as disparities are whole blocks.
const BLOCK: usize = 16;

/// Gradients of both images, from which rows of candidates are matched.
#[derive(Clone, Copy)]
pub(super) struct SupportMatching<'a> {
    /// Parameters.
    pub config: &'a StereoConfig,
    /// Left gradients.
    pub left: Gradients<'a>,
    /// Right gradients.
    pub right: Gradients<'a>,
    /// Candidates that are matched.
    pub lattice: Lattice,
}

/// Candidates that are matched: all, but within a budget. Then every so many rows and columns are,
/// about as many of both, so that points still have neighbours above and beside them.
///
/// Four bits each for the rows and the columns from one that is matched to the next; no rows where
/// nothing is matched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Lattice(u8);

/// Most rows or columns from one that is matched to the next.
const SPARSEST: u8 = 15;

impl Lattice {
    /// Every candidate.
    pub const ALL: Self = Self::every(1, 1);
    /// No candidate.
    const NONE: Self = Self::every(0, 1);

    const fn every(rows: u8, columns: u8) -> Self {
        Self(rows << 4 | columns)
    }

    /// Rows and columns from one that is matched to the next.
    fn steps(self) -> [usize; 2] {
        [self.0 >> 4, self.0 & 15].map(usize::from)
    }

    /// The densest lattice with at most `most` of the candidates of a grid, or one without any
    /// where even the sparsest has more.
    pub fn within(grid: [usize; 2], most: usize) -> Self {
        // Rows first: one that is left out needs no descriptors either.
        let lattices = (1..=SPARSEST).flat_map(|rows| {
            [rows.saturating_sub(1).max(1), rows].map(|columns| Self::every(rows, columns))
        });
        lattices.into_iter().find(|lattice| lattice.count(grid) <= most).unwrap_or(Self::NONE)
    }

    /// Candidates of a grid of so many columns and rows that are matched.
    pub fn count(self, [columns, rows]: [usize; 2]) -> usize {
        let of = |all: usize, step: usize| all.checked_div(step).unwrap_or_default();
        let [every_row, every_column] = self.steps();
        of(columns, every_column) * of(rows, every_row)
    }

    /// Returns true if the candidates of that row are matched.
    fn has_row(self, row: usize) -> bool {
        // Of so many rows the last: the first ones have no row above.
        (row + 1).checked_rem(self.steps()[0]) == Some(0)
    }

    /// Returns true if the candidates of that column are matched.
    fn has_column(self, column: usize) -> bool {
        (column + 1).checked_rem(self.steps()[1]) == Some(0)
    }
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
        Some([
            *self.above.get(west)?,
            *self.above.get(east)?,
            *self.below.get(west)?,
            *self.below.get(east)?,
        ])
    }

    /// Returns the costs of eight columns from `first` on. Those beyond the row, which have no
    /// descriptors, are meaningless.
    #[inline(always)]
    fn costs(
        &self,
        point: &[Descriptor; 4],
        first: usize,
        costs: &mut [Eight<i16>],
        kernels: &impl Kernels,
    ) {
        // A support point is described by the four corners of a square about it.
        let (west, east) = (first - CORNER, first + CORNER);
        let from = [(self.above, west), (self.above, east), (self.below, west), (self.below, east)];
        let columns = from.map(|(row, at)| clipped(row, at..).as_chunks().0);
        kernels.costs(point, columns, costs);
        // The east ends first.
        let whole = columns[1].len();
        if let Some(last) = costs.get_mut(whole..) {
            let mut spare = [UNTEXTURED; 4];
            for (i, costs) in (whole..).zip(last) {
                let mut from = from
                    .iter()
                    .zip(&mut spare)
                    .map(|(&(row, at), spare)| [*eight(row, at + i * LANES, spare)]);
                let columns = [(); 4].map(|()| from.next().unwrap_or([UNTEXTURED]));
                kernels.costs(
                    point,
                    columns.each_ref().map(|columns| &columns[..]),
                    core::slice::from_mut(costs),
                );
            }
        }
    }
}

/// The matching of rows of candidates, as work that compares descriptors.
pub(super) struct MatchRows<'m, 'a> {
    /// Input of the matching.
    pub matching: SupportMatching<'a>,
    /// The first row of candidates.
    pub first: usize,
    /// Receives disparities, or [`NO_MATCH`]: as many rows as it holds.
    pub grid: &'m mut [i16],
    /// Four descriptor rows.
    pub scratch: &'m mut [Descriptor],
}

impl Comparison for MatchRows<'_, '_> {
    #[inline(always)]
    fn run(self, kernels: &impl Kernels) {
        self.matching.match_rows(self.first, self.grid, self.scratch, kernels);
    }
}

impl SupportMatching<'_> {
    #[inline(always)]
    fn match_rows(
        &self,
        first: usize,
        grid: &mut [i16],
        scratch: &mut [Descriptor],
        kernels: &impl Kernels,
    ) {
        let (width, step) = (self.left.width, CANDIDATE_STEP);
        grid.fill(NO_MATCH);
        let Some((left, right)) = scratch.split_at_mut_checked(2 * width) else { return };
        let (Some((l0, l1)), Some((r0, r1))) =
            (left.split_at_mut_checked(width), right.split_at_mut_checked(width))
        else {
            return;
        };
        // Descriptors of the two rows a support point is seen in, above and below it.
        for (j, out) in grid.chunks_exact_mut(candidates(width, step).max(1)).enumerate() {
            if !self.lattice.has_row(first + j) {
                continue;
            }
            let v = (first + j) * step;
            let Some(above) = v.checked_sub(CORNER) else { continue };
            let below = v + CORNER;
            let rows = [
                (self.left, above, &mut *l0),
                (self.left, below, &mut *l1),
                (self.right, above, &mut *r0),
                (self.right, below, &mut *r1),
            ];
            if describe_rows(rows) {
                self.match_row(
                    &Rows { above: l0, below: l1 },
                    &Rows { above: r0, below: r1 },
                    out,
                    kernels,
                );
            }
        }
    }

    #[inline(always)]
    fn match_row(
        &self,
        left: &Rows<'_>,
        right: &Rows<'_>,
        out: &mut [i16],
        kernels: &impl Kernels,
    ) {
        let (first, end) = (MARGIN + CORNER, self.left.width.saturating_sub(MARGIN + CORNER));
        let most = usize::from(self.config.disparity_max);
        let tolerance = usize::from(self.config.consistency_threshold);
        for (i, out) in out.iter_mut().enumerate() {
            let u = i * CANDIDATE_STEP;
            if u < first || u >= end || !self.lattice.has_column(i) {
                continue;
            }
            // From left to right: the partner lies at most disparity_max columns to the left.
            let Some(x) =
                self.best(left.corners(u), right, first.max(u.saturating_sub(most))..=u, kernels)
            else {
                continue;
            };
            // And back: a match that does not return to its pixel is an occlusion or a mistake.
            let Some(back) =
                self.best(right.corners(x), left, x..=(end - 1).min(x + most), kernels)
            else {
                continue;
            };
            if back.abs_diff(u) <= tolerance {
                *out = (u - x) as i16;
            }
        }
    }

    /// The column among these of the other image that looks like `point`, if one does and no other
    /// nearly as much.
    #[inline(always)]
    fn best(
        &self,
        point: Option<[Descriptor; 4]>,
        other: &Rows<'_>,
        columns: RangeInclusive<usize>,
        kernels: &impl Kernels,
    ) -> Option<usize> {
        let point = point?;
        // A corner without texture does not tell columns apart.
        if point.iter().any(|corner| texture(corner) < SUPPORT_TEXTURE) {
            return None;
        }
        let first = *columns.start();
        let count = (columns.end() + 1).checked_sub(first)?;
        // The ratio test needs a second best to compare with.
        if count < MIN_CHOICE {
            return None;
        }
        // At most 64 x 255 = 16,320, so that costs fit i16, whose minimum is one instruction
        // everywhere.
        let mut costs = [[i16::MAX; LANES]; (DISPARITY_LIMIT as usize + 1) / LANES];
        other.costs(&point, first, clipped_mut(&mut costs, ..count.div_ceil(LANES)), kernels);
        let costs = costs.as_flattened_mut();
        // What is beyond the columns was compared with them.
        clipped_mut(costs, count..count.next_multiple_of(LANES)).fill(i16::MAX);
        let (blocks, _) = costs.as_chunks_mut();
        self.distinct(clipped_mut(blocks, ..count.div_ceil(BLOCK))).map(|i| first + i)
    }

    /// Position of the least cost, if it passes the ratio test. Costs near it are overwritten.
    #[inline(always)]
    fn distinct(&self, blocks: &mut [[i16; BLOCK]]) -> Option<usize> {
        // By whole blocks, as many at a time as there are lanes.
        let least =
            |blocks: &[[i16; BLOCK]]| blocks.as_flattened().iter().fold(i16::MAX, |a, &b| a.min(b));
        let best = least(blocks);
        // Of equal costs the first is taken: the order is a part of the result.
        let block = blocks
            .iter()
            .position(|block| block.iter().fold(false, |found, &cost| found | (cost == best)))?;
        let at = block * BLOCK + blocks.get(block)?.iter().position(|&cost| cost == best)?;
        // The second best is sought in what is left.
        for near in blocks
            .as_flattened_mut()
            .iter_mut()
            .take(at + NEIGHBOURHOOD + 1)
            .skip(at.saturating_sub(NEIGHBOURHOOD))
        {
            *near = i16::MAX;
        }
        (f32::from(best) < self.config.support_ratio * f32::from(least(blocks))).then_some(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::vec::Vec;

    /// The twin: one cost at a time.
    fn plain(costs: &[i16], ratio: f32) -> Option<usize> {
        let (at, &best) = costs.iter().enumerate().min_by_key(|(_, cost)| **cost)?;
        let others = costs.iter().enumerate().filter(|(i, _)| i.abs_diff(at) > NEIGHBOURHOOD);
        let second = others.map(|(_, &cost)| cost).min().unwrap_or(i16::MAX);
        (f32::from(best) < ratio * f32::from(second)).then_some(at)
    }

    #[test]
    fn a_lattice_has_as_many_candidates_as_it_may_and_no_more() {
        for grid in [[0, 0], [1, 1], [7, 3], [64, 20], [246, 74]] {
            let [columns, rows] = grid;
            for most in 0..=columns * rows + 1 {
                let lattice = Lattice::within(grid, most);
                let found = (0..columns * rows)
                    .filter(|k| lattice.has_column(k % columns) && lattice.has_row(k / columns));
                assert_eq!(found.count(), lattice.count(grid), "{grid:?}: {lattice:?}");
                assert!(lattice.count(grid) <= most, "{grid:?}: {lattice:?} of {most}");
            }
            assert_eq!(Lattice::within(grid, columns * rows), Lattice::ALL);
        }
        let of = |share: usize| Lattice::within([240, 70], share * 240 * 70 / 100);
        let steps = [75, 50, 25, 10, 0].map(of).map(Lattice::steps);
        assert_eq!(steps, [[2, 1], [2, 1], [2, 2], [4, 3], [0, 1]]);
    }

    #[test]
    fn the_distinct_one_of_whole_blocks_is_that_of_one_cost_at_a_time() {
        let config = StereoConfig::robotics();
        let flat = Gradients { du: &[], dv: &[], width: 0, height: 0 };
        let matching =
            SupportMatching { config: &config, left: flat, right: flat, lattice: Lattice::ALL };
        let mut random = Random::new(71);
        let mut found = 0;
        // Every count of disparities, twice: lists that end within a block are the delicate ones.
        for count in (1..=256).chain(1..=256) {
            let costs: Vec<i16> = (0..count)
                .map(|_| 400 + random.below(40 + 4_000 * (count as u32 % 3)) as i16)
                .collect();
            let mut blocks = [[i16::MAX; BLOCK]; 256 / BLOCK];
            blocks.as_flattened_mut()[..count].copy_from_slice(&costs);
            let distinct = matching.distinct(&mut blocks[..count.div_ceil(BLOCK)]);
            assert_eq!(distinct, plain(&costs, config.support_ratio));
            found += u32::from(distinct.is_some());
        }
        assert!(found > 50 && found < 462, "{found} of 512 are distinct");
    }
}
