//! Maps filled from a formula.

use crate::volume::{BLOCK_VOXELS, BlockCoord, Volume, VolumeConfig};
use crate::{
    geometry::scalar::clamp_f32,
    memory::{Capacity, Carver, SLAB_ALIGN},
};
use std::{boxed::Box, vec};

/// A lattice point's signed distance in m, weight and colour. `None`: never observed.
pub type LatticeSample = Option<(f32, u8, [u8; 3])>;

/// An empty map for `blocks` blocks on memory that is never given back.
pub fn empty(config: &VolumeConfig, blocks: usize) -> Volume<'static> {
    let capacity = Capacity { blocks, visible_blocks: blocks, colour: true, ..Capacity::TINY };
    let bytes = Volume::bytes(&capacity);
    let memory = Box::leak(vec![0u8; bytes + SLAB_ALIGN].into_boxed_slice());
    let start = memory.as_ptr().align_offset(SLAB_ALIGN);
    let mut carver = Carver::new(&mut memory[start..], bytes).unwrap();
    Volume::new_in(&capacity, config, &mut carver)
}

/// Adds the blocks of `coords` in order, filled by `sample_at`, which is given lattice points.
pub fn fill(
    volume: &mut Volume<'_>,
    coords: impl IntoIterator<Item = BlockCoord>,
    sample_at: impl Fn([i32; 3]) -> LatticeSample,
) {
    let scale = 32_767.0 / volume.config.truncation_m;
    for coord in coords {
        let slot = volume.make(volume.key(coord)).unwrap().index();
        let origin = coord.origin();
        for voxel in 0..BLOCK_VOXELS {
            let [x, y, z] = [voxel & 7, voxel >> 3 & 7, voxel >> 6].map(|c| c as i32);
            if let Some((sdf_m, weight, colour)) =
                sample_at([origin[0] + x, origin[1] + y, origin[2] + z])
            {
                volume.blocks.voxels[slot].sdf[voxel] =
                    libm::roundf(clamp_f32(sdf_m * scale, -32_767.0, 32_767.0)) as i16;
                volume.blocks.voxels[slot].weight[voxel] = weight;
                (0..3).for_each(|c| volume.blocks.colour[slot][c][voxel] = colour[c]);
            }
        }
    }
}

/// All blocks from `low` to `high`, both included, x fastest.
pub fn cuboid(low: [i32; 3], high: [i32; 3]) -> impl Iterator<Item = BlockCoord> {
    (low[2]..=high[2]).flat_map(move |z| {
        (low[1]..=high[1])
            .flat_map(move |y| (low[0]..=high[0]).map(move |x| BlockCoord::new(x, y, z).unwrap()))
    })
}
