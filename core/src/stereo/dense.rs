//! Dense matching of both images, row by row (Geiger et al., section 3.3), and the check that they
//! agree.
//!
//! Each pixel takes the disparity of least energy among those near the plane of its triangle and
//! those of its grid cell. Both images' rows are matched while their descriptors are at hand, so
//! the right image's disparities are never kept. Sixteen pixels are matched at a time (`eight`);
//! fractions of a pixel are found last, for the disparities that are left (`fraction`).
//!
//! Energies are integers: 16 times the descriptor distance plus the cost of leaving the plane. Of
//! equal ones the smaller disparity wins.

mod eight;
mod fraction;
#[cfg(test)]
mod tests;

use self::{eight::Row, fraction::refine_row};
use super::{
    StereoConfig,
    descriptor::{Descriptor, Gradients, MARGIN, describe_rows},
    prior::{CellGrid, DisparitySet, NO_PLANE, PlaneCost},
    rows::MatchedRows,
};
use crate::{
    lanes::{Eight, LANES},
    sad::{Comparison, Kernels},
    slices::{clipped, clipped_mut, padded},
};
use core::cell::Cell;

/// A disparity of the working images: 1/64 px.
pub(super) const WORKING_ONE_PX: i16 = 64;
/// No disparity, in the working images: so far from any that no difference of two disparities comes
/// near.
pub(super) const NONE: i16 = i16::MIN / 2;
/// Set in a working disparity that was filled in; beyond what 255 px take.
pub(super) const FILLED: i16 = 1 << 14;

/// All that dense matching reads.
pub(super) struct DenseMatching<'a> {
    /// Parameters.
    pub config: &'a StereoConfig,
    /// Rows to be matched.
    pub rows: MatchedRows,
    /// Gradients of the left and the right image.
    pub gradients: [Gradients<'a>; 2],
    /// Grid priors of the left and the right image.
    pub cells: [CellGrid<'a>; 2],
    /// Cost of leaving the plane.
    pub cost: PlaneCost,
}

/// Buffers that one band writes.
pub(super) struct DenseBand<'a> {
    /// First matched row.
    pub first: usize,
    /// The left planes, to become the disparities in 1/64 px.
    pub left: &'a mut [i16],
    /// The right planes, to become the right disparities, px.
    pub right: &'a mut [i16],
    /// Two descriptor rows.
    pub scratch: &'a mut [Descriptor],
    /// Pixels matched in the left image; pixels of them that the right image contradicts.
    pub counts: [u32; 2],
}

/// The matching of a band, as work that compares descriptors.
pub(super) struct MatchBand<'m, 'b, 'a> {
    /// Input of the matching.
    pub matching: &'m DenseMatching<'a>,
    /// Output of the matching.
    pub band: &'m mut DenseBand<'b>,
}

impl Comparison for MatchBand<'_, '_, '_> {
    #[inline(always)]
    fn run(self, kernels: &impl Kernels) {
        self.matching.match_band(self.band, kernels);
    }
}

impl DenseMatching<'_> {
    /// Matches a band.
    #[inline(always)]
    fn match_band(&self, band: &mut DenseBand<'_>, kernels: &impl Kernels) {
        let width = self.gradients[0].width.max(1);
        let Some((left_row, right_row)) = band.scratch.split_at_mut_checked(width) else { return };
        let Some(right_row) = right_row.get_mut(..width) else { return };
        let rows = band.left.chunks_exact_mut(width).zip(band.right.chunks_exact_mut(width));
        for (i, (left, right)) in rows.enumerate() {
            let v = self.rows.row(band.first + i);
            let [left_image, right_image] = self.gradients;
            // Rows in the margin have no descriptors, and hence no disparity.
            if describe_rows([(left_image, v, &mut *left_row), (right_image, v, &mut *right_row)]) {
                // The left row becomes the result; the right row only serves to contradict it.
                self.match_row::<true>(left_row, right_row, v, left, kernels);
                self.match_row::<false>(right_row, left_row, v, right, kernels);
                let [matched, contradicted] =
                    check_consistency(left, right, self.config.consistency_threshold);
                band.counts[0] += matched;
                band.counts[1] += contradicted;
                // Fractions come last: consistency is tested in whole pixels.
                refine_row(self.config, left_row, right_row, left, kernels);
            } else {
                left.fill(NONE);
            }
        }
    }

    /// Replaces the planes of one row by disparities in px, or [`NO_PLANE`] where no plane lies.
    #[inline(always)]
    fn match_row<const LEFT: bool>(
        &self,
        here: &[Descriptor],
        other: &[Descriptor],
        v: usize,
        planes: &mut [i16],
        kernels: &impl Kernels,
    ) {
        // A descriptor reaches MARGIN pixels to each side, and exists no nearer to the border.
        let end = planes.len().saturating_sub(MARGIN);
        clipped_mut(planes, ..MARGIN).fill(NO_PLANE);
        clipped_mut(planes, end..).fill(NO_PLANE);
        // Each image has a grid of its own: a point lies at u in the left one and at u - d in the
        // right.
        let [left_cells, right_cells] = &self.cells;
        let grid = if LEFT { left_cells } else { right_cells };
        let size = self.config.grid_size.max(1);
        let sets = clipped(grid.cells, v / size * grid.columns..);
        let mut row = Row::<LEFT>::new(self.config, &self.cost, here, other);
        let mut list = [0; 256];
        let mut cell = 0..size;
        for set in sets {
            // One list of disparities serves all pixels of a cell.
            let listed = list_candidates(set, self.cost.elsewhere, &mut list);
            for u in cell.clone().step_by(2 * LANES) {
                row.match_sixteen(u, cell.end - u, listed, planes, kernels);
            }
            cell = cell.end..cell.end + size;
            if cell.start >= planes.len() {
                break;
            }
        }
    }
}

/// The disparities of a set, ascending, each with the cost of leaving the plane in the bits from 8
/// on.
#[expect(clippy::indexing_slicing, reason = "the mask keeps members within the list")]
fn list_candidates<'l>(set: &DisparitySet, cost: u32, list: &'l mut [u32; 256]) -> &'l [u32] {
    let mut count = 0;
    for (first, &word) in ((cost << 8)..).step_by(64).zip(set) {
        let mut rest = word;
        while rest != 0 {
            // As many members as bits, at most: the mask changes nothing.
            list[count & 255] = first + rest.trailing_zeros();
            count += 1;
            rest &= rest - 1;
        }
    }
    clipped(list, ..count)
}

/// Eight pixels of a row from column `u` on; those beyond it have no plane.
#[inline(always)]
fn load(row: &[i16], u: usize) -> Eight<i16> {
    padded(row, u, 0, NO_PLANE)
}

/// Takes from the left row what the right row contradicts; both in px, [`NO_PLANE`] where there is
/// no disparity. Returns how many matches there were and how many of them went. The right row is
/// used up.
#[inline(always)]
fn check_consistency(left: &mut [i16], right: &mut [i16], threshold: u16) -> [u32; 2] {
    // First what cannot be done many at a time: the right row becomes that of each pixel's partner.
    // None is to a pixel's right, so that from the end on none is gone before it is asked for.
    let cells = Cell::from_mut(right).as_slice_of_cells();
    for ((u, disparity), cell) in left.iter().enumerate().zip(cells).rev() {
        cell.set(
            cells
                .get(u.wrapping_sub(usize::from(disparity.unsigned_abs())))
                .map_or(NO_PLANE, Cell::get),
        );
    }
    let (mut matched, mut contradicted) = (0u16, 0u16);
    for (disparity, &back) in left.iter_mut().zip(&*right) {
        // Which pixels agree is a coin toss at edges: no branches.
        let d = *disparity;
        let (is_match, agrees) =
            (d != NO_PLANE, (back != NO_PLANE) & (back.abs_diff(d) <= threshold));
        matched += u16::from(is_match);
        contradicted += u16::from(is_match & !agrees);
        *disparity = if is_match & agrees { d } else { NO_PLANE };
    }
    [matched.into(), contradicted.into()]
}
