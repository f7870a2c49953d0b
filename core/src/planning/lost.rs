//! Cells of blocks that leave the map: an obstacle in them may still stand there, so they are
//! unknown until a frame sees them again.
//!
//! A block marks the cells about its surface: those within a voxel of a point behind it that has a
//! point before it as a neighbour, and of points close before it on the block's sides, whose
//! neighbours lie in other blocks. What was seen free above a road stays so when the road leaves.
//!
//! Time: at most a block's points times the cells within a voxel, for each block that leaves and
//! may reach into the window. Order: cells are only marked, so none matters.

use super::{
    Planning,
    grid::{Cell, Grid},
};
use crate::{
    view::signs_of_block,
    volume::{BLOCK_SIDE, BlockStore, EvictedBlock, LoadedBlock},
};

/// Points of a layer by x and y: its sides.
const SIDES: u64 = 0xFF81_8181_8181_81FF;
/// Signed distance up to which a point counts as close before a surface: a quarter of the
/// truncation, a voxel where that is four.
const CLOSE: i16 = i16::MAX / 4;

/// A store that tells the planner which blocks leave the map.
pub(crate) struct Watched<'a, 's, S> {
    pub planning: &'a mut Planning<'s>,
    pub store: &'a mut S,
}

impl<S: BlockStore> BlockStore for Watched<'_, '_, S> {
    fn store(&mut self, block: EvictedBlock<'_>) -> bool {
        self.planning.lose(&block);
        self.store.store(block)
    }

    fn load(&mut self, block: LoadedBlock<'_>) -> bool {
        self.store.load(block)
    }
}

impl Planning<'_> {
    /// Makes the cells about a block's surface unknown. Nothing without a window.
    fn lose(&mut self, block: &EvictedBlock<'_>) {
        if self.is_empty() {
            return;
        }
        let origin = block.key.coord.origin().map(f64::from);
        let side = BLOCK_SIDE as f64;
        let whole = cells_of_cube(&self.grid, origin.map(|at| at + 0.5 * side), side + 2.0);
        if !self.cells.meets(whole) {
            return;
        }
        let [before, behind] = signs_of_block(block.sdf, block.weight, self.config.min_weight);
        for (z, points) in near_surface(&before, &behind, block.sdf).into_iter().enumerate() {
            // Each set bit is a point of the layer.
            let mut left = points;
            while left != 0 {
                let bit = left.trailing_zeros() as usize;
                left &= left - 1;
                let mut point = origin;
                let local = [bit % BLOCK_SIDE, bit / BLOCK_SIDE, z];
                point.iter_mut().zip(local).for_each(|(point, local)| *point += local as f64);
                let [first, last] = cells_of_cube(&self.grid, point, 2.0);
                for y in first[1]..=last[1] {
                    for x in first[0]..=last[0] {
                        (first[2]..=last[2]).for_each(|z| self.cells.lose([x, y, z]));
                    }
                }
            }
        }
    }
}

/// The points of each layer that a surface may run beside.
fn near_surface(
    before: &[u64; BLOCK_SIDE],
    behind: &[u64; BLOCK_SIDE],
    sdf: &[i16; BLOCK_SIDE * BLOCK_SIDE * BLOCK_SIDE],
) -> [u64; BLOCK_SIDE] {
    const FIRST_COLUMN: u64 = 0x0101_0101_0101_0101;
    let layer = |z: usize| before.get(z).copied().unwrap_or_default();
    let mut near = [0; BLOCK_SIDE];
    for (z, (near, behind)) in near.iter_mut().zip(behind).enumerate() {
        let own = layer(z);
        // The neighbours along x, y and z of points before the surface.
        let along_x = (own << 1 & !FIRST_COLUMN) | (own & !FIRST_COLUMN) >> 1;
        let along_y = own << 8 | own >> 8;
        let along_z = layer(z + 1) | z.checked_sub(1).map_or(0, layer);
        let sides = if z == 0 || z + 1 == BLOCK_SIDE { u64::MAX } else { SIDES };
        *near = behind & (along_x | along_y | along_z | sides);
        // Points before the surface whose neighbour behind it may be in the next block.
        let mut left = own & sides;
        while left != 0 {
            let bit = left.trailing_zeros() as usize;
            left &= left - 1;
            let point = bit + BLOCK_SIDE * BLOCK_SIDE * z;
            if sdf.get(point).is_some_and(|&sdf| sdf <= CLOSE) {
                *near |= 1 << bit;
            }
        }
    }
    near
}

/// The first and the last cell along each axis that a cube of the map reaches. Its middle and side
/// are given in voxels.
fn cells_of_cube(grid: &Grid, middle: [f64; 3], side: f64) -> [Cell; 2] {
    let (middle, half) = grid.of_cube(middle, side);
    [-1.0, 1.0].map(|sign| {
        let mut cell = [0; 3];
        for ((cell, middle), half) in cell.iter_mut().zip(middle).zip(half) {
            *cell = libm::floor(middle + sign * half) as i32;
        }
        cell
    })
}
