//! Reading voxels one lattice point after the other, along a ray or around a cell: most reads fall
//! into the block of the last one.

use super::{BlockCoord, BlockIndex, Blocks, Slot};

/// A voxel as it stands in the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VoxelSample {
    /// Signed distance in units of truncation / 32,767.
    pub sdf: i16,
    /// Observations, at least 1.
    pub weight: u8,
}

/// A reader with a memory of one block.
#[derive(Debug)]
pub struct Sampler<'v, 's> {
    index: &'v BlockIndex<'s>,
    blocks: &'v Blocks<'s>,
    last: Option<(BlockCoord, Option<Slot>)>,
}

impl<'v, 's> Sampler<'v, 's> {
    /// A reader of the map made of `index` and `blocks`.
    pub(super) fn new(index: &'v BlockIndex<'s>, blocks: &'v Blocks<'s>) -> Self {
        Self { index, blocks, last: None }
    }

    /// The slot of a block, if the block exists.
    #[inline]
    fn slot(&mut self, coord: BlockCoord) -> Option<Slot> {
        match self.last {
            Some((last, slot)) if last == coord => slot,
            _ => {
                let slot = self.index.find(coord, |slot| self.blocks.coord(slot));
                self.last = Some((coord, slot));
                slot
            }
        }
    }

    /// The voxel at a lattice point, if it was ever seen.
    #[inline]
    pub fn voxel(&mut self, point: [i32; 3]) -> Option<VoxelSample> {
        let slot = self.slot(BlockCoord::of_lattice(point)?)?.index();
        let voxel = ((point[0] & 7) | (point[1] & 7) << 3 | (point[2] & 7) << 6) as usize;
        let voxels = self.blocks.voxels.get(slot)?;
        let (sdf, weight) = (*voxels.sdf.get(voxel)?, *voxels.weight.get(voxel)?);
        (weight > 0).then_some(VoxelSample { sdf, weight })
    }
}
