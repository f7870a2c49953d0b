//! Reading voxels one lattice point after the other, along a ray or around a cell: most reads fall
//! into the block of the last one.

use super::{BlockCoord, Slot, Volume};

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
    volume: &'v Volume<'s>,
    last: Option<(BlockCoord, Option<Slot>)>,
}

impl<'v, 's> Sampler<'v, 's> {
    /// A reader of a map's current segment.
    pub(super) fn new(volume: &'v Volume<'s>) -> Self {
        Self { volume, last: None }
    }

    /// The slot of a block, if the block exists.
    #[inline]
    fn slot(&mut self, coord: BlockCoord) -> Option<Slot> {
        match self.last {
            // Neighbouring samples mostly lie in one block.
            Some((last, slot)) if last == coord => slot,
            _ => {
                let slot = self.volume.find(coord);
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
        let voxels = self.volume.blocks.voxels.get(slot)?;
        let (sdf, weight) = (*voxels.sdf.get(voxel)?, *voxels.weight.get(voxel)?);
        (weight > 0).then_some(VoxelSample { sdf, weight })
    }
}
