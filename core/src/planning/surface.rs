//! The map's surface in the window's cells.
//!
//! A cell is occupied where the surface runs through it: where two neighbouring lattice points,
//! both observed often enough, lie on either side, the point of the edge between them where the
//! distance is 0 if it runs straight marks the cell that holds it. So nothing thin is lost, no
//! matter how large cells are: every edge is looked at, not a sample per cell. Edges along the
//! lattice axis nearest to up that leave the surface upwards also tell how high ground lies in the
//! cell.
//!
//! Memory: none but the cells'. Time: linear in the map's blocks; those outside the window cost a
//! comparison. Order: blocks by slot, edges by axis, z, y, x; all that is written are sums and
//! bits, so the order does not matter.

use super::{
    cells::{Cells, OBJECT, OCCUPIED},
    grid::{Grid, TURN_BITS},
};
use crate::{
    view::signs_of_block,
    volume::{BLOCK_SIDE, BlockCoord, Slot, Volume},
};

/// The lattice points of a layer with x = 0 to 6, and those with x = 7.
const BUT_LAST_COLUMN: u64 = 0x7F7F_7F7F_7F7F_7F7F;
const LAST_COLUMN: u64 = 0x8080_8080_8080_8080;
/// Fractions of a lattice step.
const STEP_ONE: i32 = 256;
/// Fractions of a cell's side.
const SIDE_ONE: i32 = 256;

/// An edge of the lattice that the surface crosses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Crossing {
    /// Lower lattice point.
    pub point: [i32; 3],
    /// The axis it runs along.
    pub axis: usize,
    /// Position of the surface's crossing, in 1/256 of the step, 0 to 256.
    pub at_q8: i32,
    /// True if the lower point lies inside, so that the surface is left towards the upper one.
    pub leaves_upwards: bool,
}

impl Crossing {
    /// The surface point, in the map's frame, m.
    pub fn point_m(&self, voxel_size_m: f64) -> [f64; 3] {
        let mut point = self.point.map(f64::from);
        if let Some(along) = point.get_mut(self.axis) {
            *along += f64::from(self.at_q8) / f64::from(STEP_ONE);
        }
        point.map(|c| c * voxel_size_m)
    }
}

/// Hands every edge of a block that the surface crosses to `visit`: those that begin at its lattice
/// points.
pub(crate) fn crossings(
    volume: &Volume<'_>,
    slot: Slot,
    coord: BlockCoord,
    min_weight: u8,
    mut visit: impl FnMut(Crossing),
) {
    let blocks = volume.blocks();
    let (Some(sdf), Some(weight)) = (blocks.sdf(slot), blocks.weight(slot)) else { return };
    let [before, behind] = signs_of_block(sdf, weight, min_weight);
    if before.iter().all(|word| *word == 0) && behind.iter().all(|word| *word == 0) {
        return;
    }
    // Signs as bits: 64 edges are compared at once, and most words have none.
    let origin = coord.origin();
    for axis in 0..3 {
        let mut offset = [0; 3];
        if let Some(along) = offset.get_mut(axis) {
            *along = 1;
        }
        // The last plane of points has its edges into the next block.
        let next = coord.offset(offset).and_then(|coord| volume.find(coord));
        let next = next.and_then(|slot| Some((blocks.sdf(slot)?, blocks.weight(slot)?)));
        let [next_before, next_behind] = next
            .map_or([[0; BLOCK_SIDE]; 2], |(sdf, weight)| signs_of_block(sdf, weight, min_weight));
        let after = |words: &[u64; BLOCK_SIDE], next: &[u64; BLOCK_SIDE], z: usize| {
            let word = words.get(z).copied().unwrap_or_default();
            // The bits of the points one step further along the axis, those of the next block
            // filled in.
            let beside = next.get(z).copied().unwrap_or_default();
            match axis {
                0 => (word >> 1 & BUT_LAST_COLUMN) | (beside << 7 & LAST_COLUMN),
                1 => word >> 8 | beside << 56,
                _ => words.get(z + 1).or(next.first()).copied().unwrap_or_default(),
            }
        };
        for (z, (own_before, own_behind)) in before.iter().zip(&behind).enumerate() {
            let upper_before = after(&before, &next_before, z);
            let upper_behind = after(&behind, &next_behind, z);
            let mut crossed = (own_before & upper_behind) | (own_behind & upper_before);
            // Each set bit is an edge that the surface crosses.
            while crossed != 0 {
                let bit = crossed.trailing_zeros() as usize;
                crossed &= crossed - 1;
                let local = [bit % BLOCK_SIDE, bit / BLOCK_SIDE, z];
                let mut end = local;
                let wraps = end.get_mut(axis).is_some_and(|along| {
                    *along = (*along + 1) % BLOCK_SIDE;
                    *along == 0
                });
                let upper = if wraps { next.map(|(sdf, _)| sdf) } else { Some(sdf) };
                let voxel = |[x, y, z]: [usize; 3]| x + BLOCK_SIDE * (y + BLOCK_SIDE * z);
                let (Some(&low), Some(&high)) =
                    (sdf.get(voxel(local)), upper.and_then(|sdf| sdf.get(voxel(end))))
                else {
                    continue;
                };
                let (low, high) = (i32::from(low), i32::from(high));
                let mut point = origin;
                point.iter_mut().zip(local).for_each(|(point, local)| *point += local as i32);
                // Where the line between the two distances is zero, in 256ths of a voxel.
                let at_q8 = (STEP_ONE * low).checked_div(low - high).unwrap_or(0);
                visit(Crossing { point, axis, at_q8, leaves_upwards: low <= 0 });
            }
        }
    }
}

/// Mapping of surface points into the window, in grid units of 1/2^14 voxel from its first cell.
struct Window<'g> {
    grid: &'g Grid,
    origin: [i64; 3],
    cell: i64,
    min_weight: u8,
    /// The lattice axis nearest to up, and whether up is its positive direction.
    up_axis: usize,
    up_is_positive: bool,
}

impl Window<'_> {
    /// A point of the map, in 1/256 of a lattice step, in the grid.
    #[inline]
    fn of_map(&self, point_q8: [i64; 3]) -> [i64; 3] {
        let mut to = self.grid.turn_q14.map(|[a, b, c]| {
            let sum = i64::from(a) * point_q8[0]
                + i64::from(b) * point_q8[1]
                + i64::from(c) * point_q8[2];
            sum >> 8
        });
        to.iter_mut().zip(self.origin).for_each(|(to, origin)| *to -= origin);
        to
    }

    /// Returns true if a block may reach into the window.
    fn meets(&self, coord: BlockCoord, size: [usize; 3]) -> bool {
        let center =
            coord.origin().map(|c| (i64::from(c) + BLOCK_SIDE as i64 / 2) * i64::from(STEP_ONE));
        // Half a block's diagonal, and a step for edges that end in the next block.
        let reach = (BLOCK_SIDE as i64 + 1) << TURN_BITS;
        self.of_map(center)
            .into_iter()
            .zip(size)
            .all(|(at, size)| at >= -reach && at < size as i64 * self.cell + reach)
    }
}

/// Reads the map's surface into the cells anew. Surface points in the window.
pub(super) fn read(volume: &Volume<'_>, grid: &Grid, min_weight: u8, cells: &mut Cells<'_>) -> u32 {
    cells.bits.iter_mut().for_each(|bits| *bits &= !(OCCUPIED | OBJECT));
    cells.count.fill(0);
    cells.sum.fill(0);
    let cell = i64::from(grid.cell_voxels) << TURN_BITS;
    let [.., up] = grid.turn_q14;
    let steepest = |&(_, along): &(usize, i32)| along.unsigned_abs();
    // The steepest axis; of equals the first, because `max_by_key` keeps the last of the reversed.
    let (up_axis, up_along) =
        up.into_iter().enumerate().rev().max_by_key(steepest).unwrap_or_default();
    let window = Window {
        grid,
        origin: cells.origin.map(|origin| i64::from(origin) * cell),
        cell,
        min_weight,
        up_axis,
        up_is_positive: up_along > 0,
    };
    let mut points = 0u32;
    for (slot, coord) in volume.current_blocks() {
        if window.meets(coord, cells.size) {
            crossings(volume, slot, coord, window.min_weight, |crossing| {
                points += u32::from(mark(&window, &crossing, cells))
            });
        }
    }
    points
}

/// Marks the cell of a surface point. Whether it lies in the window.
fn mark(window: &Window<'_>, crossing: &Crossing, cells: &mut Cells<'_>) -> bool {
    // Fixed point from here on: 256ths of a voxel.
    let mut point_q8 = crossing.point.map(|c| i64::from(c) * i64::from(STEP_ONE));
    if let Some(along) = point_q8.get_mut(crossing.axis) {
        *along += i64::from(crossing.at_q8);
    }
    let at = window.of_map(point_q8);
    let mut local = [0; 3];
    for ((local, size), at) in local.iter_mut().zip(cells.size).zip(at) {
        // Window sides are at most 2^10 cells of 2^4 voxels: 2^28 units.
        let Some(index) = u32::try_from(at)
            .ok()
            .and_then(|at| Some(at.checked_div(window.cell as u32)? as usize))
            .filter(|&index| index < size)
        else {
            return false;
        };
        *local = index;
    }
    let Some(position) = cells.position(local) else { return false };
    if let Some(bits) = cells.bits.get_mut(position) {
        *bits |= OCCUPIED;
    }
    // Upward faces are ground candidates: their heights are averaged by cell.
    if crossing.axis == window.up_axis && crossing.leaves_upwards == window.up_is_positive {
        // A cell's height in 256ths, for cells of any size.
        let above = (at[2] - local[2] as i64 * window.cell) as i32;
        let share =
            (i64::from(above) * i64::from(SIDE_ONE)).checked_div(window.cell).unwrap_or(0) as u16;
        if let (Some(count), Some(sum)) =
            (cells.count.get_mut(position), cells.sum.get_mut(position))
            && *count < u8::MAX
        {
            (*count, *sum) = (*count + 1, *sum + share);
        }
    }
    true
}
