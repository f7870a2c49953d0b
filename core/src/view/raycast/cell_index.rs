//! Cells of a block and their corners as words, so that a corner's block and voxel are a few
//! integer operations.

use crate::volume::{BLOCK_SIDE, BLOCK_VOXELS};
use bytemuck::{Pod, Zeroable};

/// One of the cells in view: its block's entry and its number there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(super) struct CellId(pub u32);

impl CellId {
    /// No cell.
    pub const NONE: Self = Self(u32::MAX);
    /// Most blocks in view that ids tell apart.
    pub const MAX_BLOCKS: usize = u32::MAX as usize / BLOCK_VOXELS;

    #[inline(always)]
    pub fn new(entry: usize, cell: CellIndex) -> Self {
        Self((entry * BLOCK_VOXELS + cell.voxel()) as u32)
    }
}

/// The last coordinate in a block.
const LAST: u32 = BLOCK_SIDE as u32 - 1;

/// Steps from one voxel to the next along an axis.
#[inline(always)]
const fn stride(axis: usize) -> u32 {
    1 << (3 * axis as u32)
}

/// The lowest bit of each coordinate of a [`CellIndex`].
const UNITS: u32 = 0o111;

/// A cell of a block, `x + 8 y + 64 z`: the voxel of its first corner.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct CellIndex(u32);

/// A lattice point: which of the blocks around a block's last corner it is in, 1 the next in x, 2
/// in y, 4 in z, and its voxel there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Point {
    block: u32,
    voxel: u32,
}

impl CellIndex {
    /// The cell of a voxel, its first corner.
    #[inline(always)]
    pub fn of_voxel(voxel: u32) -> Self {
        Self(voxel & (BLOCK_VOXELS as u32 - 1))
    }

    /// The layer, below 8, and the bit of the cell in it.
    #[inline(always)]
    pub fn bit(self) -> (usize, u32) {
        ((self.0 >> 6 & 7) as usize, self.0 & 63)
    }

    /// The coordinate along an axis, from 0 to 7.
    #[inline(always)]
    pub fn coordinate(self, axis: usize) -> u32 {
        self.0 >> (3 * axis as u32) & 7
    }

    /// The voxel of the first corner.
    #[inline(always)]
    pub fn voxel(self) -> usize {
        self.0 as usize
    }

    /// Returns true if all corners lie in the block: no coordinate is 7.
    #[inline(always)]
    pub fn is_inner(self) -> bool {
        self.0 & self.0 >> 1 & self.0 >> 2 & UNITS == 0
    }

    /// The first corner.
    #[inline(always)]
    pub fn first(self) -> Point {
        Point { block: 0, voxel: self.0 }
    }

    /// From a corner to the next along an axis.
    #[inline(always)]
    pub fn edge(self, axis: usize) -> Point {
        let (stride, is_last) = (stride(axis), self.coordinate(axis) == LAST);
        Point {
            block: if is_last { 1 << axis } else { 0 },
            voxel: if is_last { (LAST * stride).wrapping_neg() } else { stride },
        }
    }

    /// The corners.
    #[inline(always)]
    pub fn corners(self) -> [Point; 8] {
        let (a, [x, y, z]) = (self.first(), [self.edge(0), self.edge(1), self.edge(2)]);
        let (b, c, e) = (a.plus(x), a.plus(y), a.plus(z));
        let (d, f, g) = (c.plus(x), e.plus(x), e.plus(y));
        [a, b, c, d, e, f, g, g.plus(x)]
    }

    /// The corners of a cell whose corners all lie in the block.
    #[inline(always)]
    pub fn corner_values<T: Copy>(self, voxels: &[T; BLOCK_VOXELS]) -> Option<[T; 8]> {
        // From the cell's first corner to its last.
        let window: &[T; 74] = voxels.get(self.voxel()..)?.first_chunk()?;
        Some([
            window[0], window[1], window[8], window[9], window[64], window[65], window[72],
            window[73],
        ])
    }
}

impl Point {
    /// The point at the end of an edge.
    #[inline(always)]
    pub fn plus(self, edge: Self) -> Self {
        Self { block: self.block | edge.block, voxel: self.voxel.wrapping_add(edge.voxel) }
    }

    /// Returns the block that contains the corner, below 8.
    #[inline(always)]
    pub fn block(self) -> usize {
        self.block as usize & 7
    }

    /// The voxel in its block.
    #[inline(always)]
    pub fn voxel(self) -> usize {
        self.voxel as usize & (BLOCK_VOXELS - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_and_their_corners_are_where_their_coordinates_say() {
        for (x, y, z) in
            (0..8).flat_map(|z| (0..8).flat_map(move |y| (0..8).map(move |x| (x, y, z))))
        {
            let cell = CellIndex::of_voxel((x + 8 * y + 64 * z) as u32);
            assert_eq!([0, 1, 2].map(|axis| cell.coordinate(axis) as i32), [x, y, z]);
            assert_eq!(
                (cell.voxel() as i32, cell.bit()),
                (x + 8 * y + 64 * z, (z as usize, (x + 8 * y) as u32))
            );
            // A cell is inner where all of its corners are of its own block.
            assert_eq!(cell.is_inner(), x < 7 && y < 7 && z < 7);
            for (corner, point) in (0..).zip(cell.corners()) {
                // The corners of a cell of the last layer are of the next block.
                let [x, y, z] = [x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)];
                assert_eq!(point.block() as i32, x / 8 + 2 * (y / 8) + 4 * (z / 8));
                assert_eq!(point.voxel() as i32, x % 8 + 8 * (y % 8) + 64 * (z % 8));
            }
        }
        assert_eq!([0, 1, 2].map(stride), [1, BLOCK_SIDE as u32, (BLOCK_SIDE * BLOCK_SIDE) as u32]);
    }
}
