//! Dense matching of both images, row by row (Geiger et al., section 3.3), and the check that they agree.
//!
//! Each pixel takes the disparity of least energy among those near the plane of its triangle and those of its grid cell. Both images'
//! rows are matched while their descriptors are at hand, so the right image's disparities are never kept.
//!
//! Energies are integers: 16 times the descriptor distance plus the cost of leaving the plane. Of equal ones the smaller disparity wins.

use crate::part::part;

use super::{
    StereoConfig,
    descriptor::{Descriptor, Gradients, MARGIN, distance, texture},
    prior::{CellGrid, DisparitySet, NO_PLANE, PlaneCost, STEEP},
};

/// A disparity of the working images: 1/64 px.
pub(super) const WORKING_ONE_PX: i16 = 64;
/// No disparity, in the working images: so far from any that no difference of two disparities comes near.
pub(super) const NONE: i16 = i16::MIN / 2;

/// All that dense matching reads.
pub(super) struct DenseMatching<'a> {
    /// Parameters.
    pub config: &'a StereoConfig,
    /// Gradients of the left and the right image.
    pub gradients: [Gradients<'a>; 2],
    /// Grid priors of the left and the right image.
    pub cells: [CellGrid<'a>; 2],
    /// Cost of leaving the plane.
    pub cost: PlaneCost,
}

/// What one band writes and needs.
pub(super) struct DenseBand<'a> {
    /// First image row.
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

impl DenseMatching<'_> {
    /// Matches a band.
    pub fn match_band(&self, band: &mut DenseBand<'_>) {
        let width = self.gradients[0].width.max(1);
        let Some((left_row, right_row)) = band.scratch.split_at_mut_checked(width) else { return };
        let Some(right_row) = right_row.get_mut(..width) else { return };
        let rows = band.left.chunks_exact_mut(width).zip(band.right.chunks_exact_mut(width));
        for (i, (left, right)) in rows.enumerate() {
            let v = band.first + i;
            if self.gradients[0].describe_row(v, left_row) && self.gradients[1].describe_row(v, right_row) {
                self.match_row::<true>(left_row, right_row, v, left);
                self.match_row::<false>(right_row, left_row, v, right);
                let [matched, contradicted] = consistent(left, right, self.config.consistency_threshold);
                band.counts[0] += matched;
                band.counts[1] += contradicted;
            } else {
                left.fill(NONE);
            }
        }
    }

    /// Replaces the planes of one row by disparities, or [`NO_PLANE`] where no plane lies: in working units in the left image, whose
    /// result is kept, in px in the right one, which is only compared with.
    fn match_row<const LEFT: bool>(&self, here: &[Descriptor], other: &[Descriptor], v: usize, planes: &mut [i16]) {
        let (first, end) = (MARGIN, here.len().saturating_sub(MARGIN));
        let [left_cells, right_cells] = &self.cells;
        let grid = if LEFT { left_cells } else { right_cells };
        let size = self.config.grid_size.max(1);
        let sets = part(grid.cells, v / size * grid.columns..);
        let least_texture = u32::from(self.config.match_texture);
        let most = usize::from(self.config.disparity_max);
        let mut list = [0u8; 256];
        for ((cell, (planes, points)), set) in planes.chunks_mut(size).zip(here.chunks(size)).enumerate().zip(sets) {
            let listed = list_disparities(set, &mut list);
            for (i, (plane, point)) in planes.iter_mut().zip(points).enumerate() {
                let u = cell * size + i;
                if *plane == NO_PLANE || u < first || u >= end || texture(point) < least_texture {
                    *plane = NO_PLANE;
                    continue;
                }
                let reach = most.min(if LEFT { u - first } else { end - 1 - u });
                // The columns that may match, from disparity 0 on.
                let columns = if LEFT { other.get(u - reach..=u) } else { other.get(u..=u + reach) };
                *plane = self.match_pixel::<LEFT>(point, Candidates { columns: columns.unwrap_or(&[]), reach }, listed, *plane);
            }
        }
    }

    /// The disparity of one pixel.
    #[inline(always)]
    fn match_pixel<const LEFT: bool>(&self, point: &Descriptor, others: Candidates<'_>, listed: &[u8], plane: i16) -> i16 {
        // Energy above, disparity below: the least key is the least energy and, of equal ones, the smallest disparity.
        let mean = usize::from((plane & 255) as u8);
        let costs = if plane >= STEEP { &self.cost.about_steep } else { &self.cost.about_plane };
        let low = mean.saturating_sub(self.cost.radius);
        let costs = part(costs, low + self.cost.radius - mean..=2 * self.cost.radius);
        let best = least_key::<LEFT>(point, others, listed, self.cost.elsewhere, low, costs);
        if best == u32::MAX {
            return NO_PLANE;
        }
        let d = (best & 255) as i16;
        match (LEFT, self.config.subpixel) {
            (true, true) => d * WORKING_ONE_PX + fraction(point, others, d as usize),
            (true, false) => d * WORKING_ONE_PX,
            (false, _) => d,
        }
    }
}

/// Where between d - 1 and d + 1 the distance has its least value, if it falls and rises with the same slope; 1/64 px about d, less than
/// half a pixel, so that it still rounds to d. Left image only.
#[inline(never)]
fn fraction(point: &Descriptor, others: Candidates<'_>, d: usize) -> i16 {
    // In the right image disparity grows to the left.
    let beside = others.reach.checked_sub(d + 1).and_then(|from| others.columns.get(from..)?.first_chunk());
    let Some([after, here, before]) = beside else { return 0 };
    let (before, here, after) = (distance(point, before) as i32, distance(point, here) as i32, distance(point, after) as i32);
    let (least, rise) = (before.min(after), before.max(after) - here);
    // Divided first and compared later: a branch here is unpredictable.
    let offset = (i32::from(WORKING_ONE_PX / 2 - 1) * (before - after) / rise.max(1)) as i16;
    if least < here { 0 } else { offset }
}

/// The descriptors of the other image's row that a pixel may match.
#[derive(Clone, Copy)]
struct Candidates<'a> {
    columns: &'a [Descriptor],
    reach: usize,
}

impl<'a> Candidates<'a> {
    /// The one at disparity d.
    #[inline(always)]
    fn at<const LEFT: bool>(self, d: usize) -> Option<&'a Descriptor> {
        self.columns.get(if LEFT { self.reach.wrapping_sub(d) } else { d })
    }
}

/// The least key among listed disparities and those from `low` on, as many as there are costs. Never inlined, as all loops over distances
/// here: on its own the compiler keeps the descriptor in one register, in the midst of others it takes it to pieces.
#[inline(never)]
fn least_key<const LEFT: bool>(
    point: &Descriptor,
    others: Candidates<'_>,
    listed: &[u8],
    elsewhere: u32,
    low: usize,
    costs: &[u32],
) -> u32 {
    let mut best = u32::MAX;
    for &d in listed {
        let Some(other) = others.at::<LEFT>(usize::from(d)) else { break };
        best = best.min((distance(point, other) << 12) + (elsewhere << 8) + u32::from(d));
    }
    for (i, cost) in costs.iter().enumerate() {
        let Some(other) = others.at::<LEFT>(low + i) else { break };
        best = best.min((distance(point, other) << 12) + (cost << 8) + (low + i) as u32);
    }
    best
}

/// The members of a set, ascending.
fn list_disparities<'l>(set: &DisparitySet, list: &'l mut [u8; 256]) -> &'l [u8] {
    // As many members as bits, at most.
    let mut slots = list.iter_mut();
    for (i, &word) in set.iter().enumerate() {
        let mut rest = word;
        while rest != 0 {
            if let Some(slot) = slots.next() {
                *slot = (i as u32 * 64 + rest.trailing_zeros()) as u8;
            }
            rest &= rest - 1;
        }
    }
    let free = slots.len();
    part(list, ..list.len() - free)
}

/// Takes from the left row, in working units, what the right row, in px, contradicts. Returns how many matches there were and how many
/// of them went.
fn consistent(left: &mut [i16], right: &[i16], threshold: u16) -> [u32; 2] {
    let (mut matched, mut contradicted) = (0, 0);
    for (u, disparity) in left.iter_mut().enumerate() {
        if *disparity == NO_PLANE {
            *disparity = NONE;
            continue;
        }
        matched += 1;
        let d = (*disparity + WORKING_ONE_PX / 2) / WORKING_ONE_PX;
        let back = u.checked_sub(usize::from(d.unsigned_abs())).and_then(|x| right.get(x)).copied().unwrap_or(NO_PLANE);
        if back == NO_PLANE || back.abs_diff(d) > threshold {
            *disparity = NONE;
            contradicted += 1;
        }
    }
    [matched, contradicted]
}
