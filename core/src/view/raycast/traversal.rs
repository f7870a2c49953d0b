//! Which cells a ray passes, one after the other (Amanatides, Woo, 1987).

use super::{
    cell::NO_AXIS,
    cell_index::{CellIndex, stride},
    ray_camera::{AXES, Depth, Ray},
};
use crate::volume::BLOCK_SIDE;

/// Where a ray is: in a cell, on its way to the next.
pub(super) struct Traversal<'r> {
    pub ray: &'r Ray,
    pub block: [i32; 3],
    pub cell: CellIndex,
    /// Depth at which the cell was entered.
    pub entry: Depth,
    /// Across which axis; [`NO_AXIS`] where the ray begins within.
    pub entered: usize,
    /// Depths at which the cell is left along each axis.
    exits: [Depth; 3],
    /// Cells to the block's end along each axis, this one included.
    left: [u32; 3],
    /// From one cell to the next along each axis.
    steps: [u32; 3],
    depths: [Depth; 3],
}

impl<'r> Traversal<'r> {
    /// Begins just after a depth.
    #[inline(always)]
    pub fn new(ray: &'r Ray, depth: Depth) -> Self {
        let step = |axis: usize| if ray.is_ahead(axis) { stride(axis) } else { stride(axis).wrapping_neg() };
        let mut traversal = Self {
            ray,
            block: [0; 3],
            cell: CellIndex::new([0; 3]),
            entry: depth,
            entered: NO_AXIS,
            exits: [0; 3],
            left: [0; 3],
            steps: [step(0), step(1), step(2)],
            depths: [ray.stride(0), ray.stride(1), ray.stride(2)],
        };
        traversal.begin(depth);
        traversal
    }

    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    fn begin(&mut self, depth: Depth) {
        let (cell, exits) = self.ray.cell_and_exits(depth);
        (self.cell, self.exits, self.entry) = (CellIndex::new(cell), exits, depth);
        for axis in AXES {
            let behind = cell[axis] as u32 & 7;
            self.block[axis] = cell[axis] >> 3;
            self.left[axis] = if self.ray.is_ahead(axis) { BLOCK_SIDE as u32 - behind } else { behind + 1 };
        }
    }

    /// Leaves the block at once.
    #[inline(always)]
    pub fn leave_block(&mut self) {
        let (depth, axis) = self.ray.leaves(self.block);
        self.begin(depth);
        self.entered = axis;
    }

    /// The axis across which the ray leaves the cell. Ties go to the first axis; the cells of no depth between them stop no ray.
    #[inline(always)]
    pub fn axis(&self) -> usize {
        let [x, y, z] = self.exits;
        if x <= y {
            if x <= z { 0 } else { 2 }
        } else if y <= z {
            1
        } else {
            2
        }
    }

    /// Depth at which the ray leaves the cell across an axis.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    pub fn exit<const AXIS: usize>(&self) -> Depth {
        self.exits[AXIS]
    }

    /// Goes on to the next cell, across an axis; whether that is in the next block.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    pub fn step<const AXIS: usize>(&mut self) -> bool {
        (self.entry, self.entered) = (self.exits[AXIS], AXIS);
        self.exits[AXIS] += self.depths[AXIS];
        self.cell = self.cell.plus(self.steps[AXIS]);
        self.left[AXIS] -= 1;
        let leaves = self.left[AXIS] == 0;
        if leaves {
            self.block[AXIS] += if self.ray.is_ahead(AXIS) { 1 } else { -1 };
            self.cell = self.cell.plus(self.steps[AXIS].wrapping_mul(BLOCK_SIDE as u32).wrapping_neg());
            self.left[AXIS] = BLOCK_SIDE as u32;
        }
        leaves
    }
}
