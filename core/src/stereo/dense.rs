//! Dense matching of both images, row by row (Geiger et al., section 3.3), and the check that they agree.
//!
//! Each pixel takes the disparity of least energy among those near the plane of its triangle and those of its grid cell. Both images'
//! rows are matched while their descriptors are at hand, so the right image's disparities are never kept.
//!
//! Energies are integers: 16 times the descriptor distance plus the cost of leaving the plane. Of equal ones the smaller disparity wins.

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
        let width = self.gradients[0].width;
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

    /// Replaces the planes of one row by disparities in px, or [`NO_PLANE`] where there is none.
    #[expect(clippy::indexing_slicing, reason = "columns of matches are held within first..end, which lies within both rows")]
    fn match_row<const LEFT: bool>(&self, here: &[Descriptor], other: &[Descriptor], v: usize, planes: &mut [i16]) {
        let (first, end) = (MARGIN, here.len().saturating_sub(MARGIN));
        let grid = &self.cells[usize::from(!LEFT)];
        let size = self.config.grid_size;
        let sets = grid.cells.get(v / size * grid.columns..).unwrap_or(&[]);
        let mut list = [0u8; 256];
        for ((cell, planes), set) in planes.chunks_mut(size).enumerate().zip(sets) {
            let listed = list_disparities(set, &mut list);
            for (i, plane) in planes.iter_mut().enumerate() {
                let u = cell * size + i;
                if *plane == NO_PLANE {
                    continue;
                }
                if u < first || u >= end {
                    *plane = NO_PLANE;
                    continue;
                }
                let point = &here[u];
                if texture(point) < u32::from(self.config.match_texture) {
                    *plane = NO_PLANE;
                    continue;
                }
                let reach = if LEFT { u - first } else { end - 1 - u }.min(usize::from(self.config.disparity_max));
                let column = |d: usize| if LEFT { u - d } else { u + d };
                // Energy above, disparity below: the least key is the least energy and, of equal ones, the smallest disparity.
                let mut best = u32::MAX;
                for &d in listed {
                    let d = usize::from(d);
                    if d > reach {
                        break;
                    }
                    let energy = (distance(point, &other[column(d)]) << 4) + self.cost.elsewhere;
                    best = best.min(energy << 8 | d as u32);
                }
                let steep = *plane >= STEEP;
                let mean = usize::from((*plane & 255) as u8);
                for d in mean.saturating_sub(self.cost.radius)..=(mean + self.cost.radius).min(reach) {
                    let cost = if steep { self.cost.elsewhere } else { self.cost.by_distance[d.abs_diff(mean)] };
                    let energy = (distance(point, &other[column(d)]) << 4) + cost;
                    best = best.min(energy << 8 | d as u32);
                }
                *plane = if best == u32::MAX { NO_PLANE } else { (best & 255) as i16 };
            }
        }
    }
}

/// The members of a set, ascending.
#[expect(clippy::indexing_slicing, reason = "a set has at most 256 members, and n counts them")]
fn list_disparities<'l>(set: &DisparitySet, list: &'l mut [u8; 256]) -> &'l [u8] {
    let mut n = 0;
    for (i, &word) in set.iter().enumerate() {
        let mut rest = word;
        while rest != 0 {
            list[n] = (i as u32 * 64 + rest.trailing_zeros()) as u8;
            n += 1;
            rest &= rest - 1;
        }
    }
    &list[..n]
}

/// Turns the left row from px to 1/64 px, without what the right row contradicts. Returns how many matches there were and how many of
/// them went.
fn consistent(left: &mut [i16], right: &[i16], threshold: u16) -> [u32; 2] {
    let (mut matched, mut contradicted) = (0, 0);
    for (u, disparity) in left.iter_mut().enumerate() {
        let d = *disparity;
        *disparity = NONE;
        if d == NO_PLANE {
            continue;
        }
        matched += 1;
        let back = usize::try_from(d).ok().and_then(|d| right.get(u.checked_sub(d)?));
        match back {
            Some(&back) if back != NO_PLANE && back.abs_diff(d) <= threshold => *disparity = d * WORKING_ONE_PX,
            _ => contradicted += 1,
        }
    }
    [matched, contradicted]
}
