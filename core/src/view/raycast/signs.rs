//! Signs of a block: the lattice points before the surface and those behind it, as bits, and from
//! them the cells it runs through.
//!
//! A layer (one z) of a block is a 64-bit word: bit `x + 8 y`.

use crate::{
    flags::bits,
    volume::{BLOCK_SIDE, BLOCK_VOXELS, block::LAYER_VOXELS},
};
use bytemuck::{Pod, Zeroable};

/// One bit per lattice point or cell of a block, a word per layer.
pub(crate) type Layers = [u64; BLOCK_SIDE];

/// The points of a layer with x = 0, and those with x = 0 to 6.
const FIRST_COLUMN: u64 = 0x0101_0101_0101_0101;
const BUT_LAST_COLUMN: u64 = 0x7F7F_7F7F_7F7F_7F7F;

/// The points seen before the surface and those seen at or behind it.
pub(crate) fn of_block(
    sdf: &[i16; BLOCK_VOXELS],
    weight: &[u8; BLOCK_VOXELS],
    min_weight: u8,
) -> [Layers; 2] {
    let mut signs = [[0; BLOCK_SIDE]; 2];
    let [before, behind] = &mut signs;
    let layers = sdf.as_chunks::<LAYER_VOXELS>().0.iter().zip(weight.as_chunks::<LAYER_VOXELS>().0);
    for ((sdf, weight), (before, behind)) in layers.zip(before.iter_mut().zip(behind)) {
        let (mut is_before, mut is_observed) = ([0u8; LAYER_VOXELS], [0u8; LAYER_VOXELS]);
        for (((is_before, is_observed), &sdf), &weight) in
            is_before.iter_mut().zip(&mut is_observed).zip(sdf).zip(weight)
        {
            *is_observed = u8::from(weight >= min_weight);
            *is_before = u8::from(sdf > 0);
        }
        // A point never observed is in neither of the two.
        let observed = bits(&is_observed);
        *before = observed & bits(&is_before);
        *behind = observed & !*before;
    }
    signs
}

/// For each cell, whether it has a corner among points, given those of the block (0) and of those
/// after it in x (1), y (2), z (4).
#[inline(never)]
#[expect(clippy::indexing_slicing, reason = "n is 0 or 4, z below 8")]
fn with_a_corner(points: &[Layers; 8]) -> Layers {
    let along_x =
        |own: u64, next: u64| own | (own >> 1 & BUT_LAST_COLUMN) | (next & FIRST_COLUMN) << 7;
    // A cell reaches one voxel further along x, and in the last column into the next block.
    let layer = |n: usize, z: usize| {
        let own = along_x(points[n][z], points[n + 1][z]);
        // And one row further, in the last row into the block after it in y.
        own | own >> 8 | along_x(points[n + 2][z], points[n + 3][z]) << 56
    };
    let mut cells = [0; BLOCK_SIDE];
    // From the last layer back, with the first layer of the block after it in z.
    let mut above = layer(4, 0);
    for (z, cells) in cells.iter_mut().enumerate().rev() {
        let here = layer(0, z);
        *cells = here | above;
        above = here;
    }
    cells
}

/// The cells of a layer, a bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct CellLayer {
    /// Cells that the surface runs through: with a corner before it and one behind.
    pub crossed: u64,
    /// Cells whose corners were all observed.
    pub fully_observed: u64,
}

/// The cells of a block.
pub(super) type Cells = [CellLayer; BLOCK_SIDE];

/// The cells of a block, given the signs of its points (0) and of those after it in x (1), y (2), z
/// (4).
pub(super) fn cells(signs: [&[Layers; 2]; 8]) -> Cells {
    let [mut before, mut behind, mut unseen] = [[[0; BLOCK_SIDE]; 8]; 3];
    for (signs, ((before, behind), unseen)) in
        signs.iter().zip(before.iter_mut().zip(&mut behind).zip(&mut unseen))
    {
        [*before, *behind] = **signs;
        unseen
            .iter_mut()
            .zip(before.iter().zip(behind.iter()))
            .for_each(|(unseen, (before, behind))| *unseen = !(before | behind));
    }
    // A cell has eight corners: its own voxel's point and those after it on each axis.
    let [before, behind, unseen] =
        [with_a_corner(&before), with_a_corner(&behind), with_a_corner(&unseen)];
    let mut cells = [CellLayer::default(); BLOCK_SIDE];
    for (cells, ((before, behind), unseen)) in
        cells.iter_mut().zip(before.into_iter().zip(behind).zip(unseen))
    {
        *cells = CellLayer { crossed: before & behind, fully_observed: !unseen };
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn agrees_with_asking_every_corner_of_every_cell() {
        let mut random = Random::new(7);
        let mut sdf = [[0i16; BLOCK_VOXELS]; 8];
        let mut weight = [[0u8; BLOCK_VOXELS]; 8];
        for round in 0..20 {
            for value in sdf.iter_mut().flatten() {
                // From all before the surface to a mixture of signs.
                *value = if random.below(20) > round { 900 } else { random.below(3) as i16 - 1 };
            }
            weight.iter_mut().flatten().for_each(|value| *value = random.below(9) as u8);
            let signs: [_; 8] = core::array::from_fn(|n| of_block(&sdf[n], &weight[n], 2));
            let cells = cells(signs.each_ref());
            // A voxel's bits: 3 each for x, y and z.
            for cell in 0..BLOCK_VOXELS {
                let (mut before, mut behind, mut fully_observed) = (false, false, true);
                for corner in 0..8 {
                    let [x, y, z] =
                        [0, 1, 2].map(|axis| (cell >> (3 * axis) & 7) + (corner >> axis & 1));
                    let block = x / 8 + 2 * (y / 8) + 4 * (z / 8);
                    let voxel = x % 8 + 8 * (y % 8) + 64 * (z % 8);
                    let observed = weight[block][voxel] >= 2;
                    fully_observed &= observed;
                    before |= observed && sdf[block][voxel] > 0;
                    behind |= observed && sdf[block][voxel] <= 0;
                }
                let layer = cells[cell >> 6];
                let bits = [layer.crossed, layer.fully_observed]
                    .map(|layer| layer >> (cell & 63) & 1 == 1);
                assert_eq!(bits, [before && behind, fully_observed]);
            }
        }
    }
}
