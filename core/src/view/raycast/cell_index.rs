//! A lattice point of a block in one word, so that a step, the block it leads to and a voxel are a few integer operations.

use crate::volume::BLOCK_VOXELS;

/// A lattice point or cell of a block: `x + 32 y + 1024 z` with 8 added to each coordinate, from -1 (7) to 8 (16).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CellIndex {
    at: u32,
}

/// Bits per coordinate.
const FIELD: u32 = 5;
/// One step along each axis.
const UNITS: [u32; 3] = [1, 1 << FIELD, 1 << (2 * FIELD)];
/// The bits set for coordinates from 0 to 7.
const INSIDE: u32 = 8 * (1 | 1 << FIELD | 1 << (2 * FIELD));
/// The bits set for a coordinate of 8: in the next block.
const BEYOND: u32 = 2 * INSIDE;
/// Steps from one voxel to the next along each axis.
const VOXEL_STRIDES: [usize; 3] = [1, 8, 64];

/// How a cell's faces across one axis are laid out.
#[derive(Debug)]
pub(super) struct CellFace {
    /// The other axes.
    pub u: usize,
    /// The other axes.
    pub v: usize,
    /// From the lower face to the upper.
    pub delta: u32,
    /// From a face's first corner along `v`.
    pub delta_v: u32,
    /// From a face's first corner to its last.
    pub far: u32,
    /// From voxel to voxel along `u`.
    pub stride_u: usize,
    /// From voxel to voxel along `v`.
    pub stride_v: usize,
}

/// By axis.
pub(super) static FACES: [CellFace; 3] = [face(0, 1, 2), face(1, 0, 2), face(2, 0, 1)];

#[expect(clippy::indexing_slicing, reason = "evaluated at compile time, where a wrong index does not compile")]
const fn face(axis: usize, u: usize, v: usize) -> CellFace {
    CellFace {
        u,
        v,
        delta: UNITS[axis],
        delta_v: UNITS[v],
        far: UNITS[u] + UNITS[v],
        stride_u: VOXEL_STRIDES[u],
        stride_v: VOXEL_STRIDES[v],
    }
}

impl CellIndex {
    /// From a cell's first corner to its last.
    pub const FAR: u32 = UNITS[0] + UNITS[1] + UNITS[2];

    /// A cell in its block.
    #[inline(always)]
    pub fn new(cell: [i32; 3]) -> Self {
        Self { at: Self::steps(cell.map(|c| c as u32 & 7)) + INSIDE }
    }

    /// Steps along the axes as one number for [`Self::plus`].
    #[inline(always)]
    pub fn steps([x, y, z]: [u32; 3]) -> u32 {
        x | y << FIELD | z << (2 * FIELD)
    }

    /// One step along an axis, upwards if `ahead` is 1, downwards if 0.
    #[inline(always)]
    pub fn delta(axis: usize, ahead: i32) -> u32 {
        ((2 * ahead - 1) as u32) << (FIELD * axis as u32)
    }

    #[inline(always)]
    pub fn plus(self, delta: u32) -> Self {
        Self { at: self.at.wrapping_add(delta) }
    }

    /// Whether the last step led out of the block.
    #[inline(always)]
    pub fn is_outside(self) -> bool {
        self.at & INSIDE != INSIDE
    }

    /// The coordinate along an axis, from -1 to 8.
    #[inline(always)]
    pub fn coordinate(self, axis: usize) -> i32 {
        (self.at >> (FIELD * axis as u32) & 0x1F) as i32 - 8
    }

    /// The layer, below 8, and the bit of a cell in it.
    #[inline(always)]
    pub fn bit(self) -> (usize, u32) {
        ((self.at >> (2 * FIELD) & 7) as usize, (self.at & 7) | (self.at >> (FIELD - 3) & 0x38))
    }

    /// The voxel in its block, below 512.
    #[inline(always)]
    pub fn voxel(self) -> usize {
        ((self.at & 7) | (self.at >> (FIELD - 3) & 0x38) | (self.at >> (2 * FIELD - 6) & 0x1C0)) as usize
    }

    /// Which of the blocks around a block's last corner this point is in: 1 the next in x, 2 in y, 4 in z.
    #[inline(always)]
    pub fn block(self) -> usize {
        ((self.at >> 4 & 1) | (self.at >> (FIELD + 3) & 2) | (self.at >> (2 * FIELD + 2) & 4)) as usize
    }

    #[inline(always)]
    pub fn is_in_own_block(self) -> bool {
        self.at & BEYOND == 0
    }

    /// Whether the point some steps on lies in the same block.
    #[inline(always)]
    pub fn shares_block(self, delta: u32) -> bool {
        (self.at ^ (self.at + delta)) & BEYOND == 0
    }

    /// The corners of the cell.
    #[inline(always)]
    pub fn corners(self) -> [Self; 8] {
        [0, 1, 2, 3, 4, 5, 6, 7].map(|corner: u32| self.plus(Self::steps([corner & 1, corner >> 1 & 1, corner >> 2])))
    }

    /// The block a step led to, relative to the one left, and the place in it.
    #[inline(always)]
    pub fn arrived(self) -> ([i32; 3], Self) {
        let block = [self.coordinate(0) >> 3, self.coordinate(1) >> 3, self.coordinate(2) >> 3];
        (block, Self { at: self.at & (INSIDE - INSIDE / 8) | INSIDE })
    }

    /// The corners of a cell whose corners all lie in the block.
    #[inline(always)]
    pub fn corner_values<T: Copy>(self, voxels: &[T; BLOCK_VOXELS]) -> Option<[T; 8]> {
        // From the cell's first corner to its last.
        let window: &[T; 74] = voxels.get(self.voxel()..)?.first_chunk()?;
        Some([window[0], window[1], window[8], window[9], window[64], window[65], window[72], window[73]])
    }
}
