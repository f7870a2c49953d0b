//! What blocks hold: structure of arrays, one entry a block.
//!
//! Memory: 1,536 bytes of voxels a block, 3,072 with colour, and 17 bytes beside them (coordinates, content digest, faintest
//! weight).

use crate::memory::{Capacity, Carver, region_bytes};
use crate::snapshot::Archive;

/// Lattice points along a block's side.
pub const BLOCK_SIDE: usize = 8;
/// Lattice points in a block.
pub const BLOCK_VOXELS: usize = BLOCK_SIDE * BLOCK_SIDE * BLOCK_SIDE;

/// A block's place: it holds the lattice points `8 * coord ..= 8 * coord + 7` on each axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlockCoord {
    /// Along x.
    pub x: i16,
    /// Along y.
    pub y: i16,
    /// Along z.
    pub z: i16,
}

impl BlockCoord {
    /// The block at these coordinates; `None` beyond 16 bits (13 km at 5 cm), where the map ends.
    pub fn new(x: i32, y: i32, z: i32) -> Option<Self> {
        Some(Self { x: i16::try_from(x).ok()?, y: i16::try_from(y).ok()?, z: i16::try_from(z).ok()? })
    }

    /// The block that holds a lattice point.
    pub fn of_lattice(point: [i32; 3]) -> Option<Self> {
        Self::new(point[0] >> 3, point[1] >> 3, point[2] >> 3)
    }

    /// The block `offset` blocks away; `None` beyond the map.
    pub fn offset(self, offset: [i32; 3]) -> Option<Self> {
        Self::new(i32::from(self.x) + offset[0], i32::from(self.y) + offset[1], i32::from(self.z) + offset[2])
    }

    /// The first lattice point of the block.
    pub fn origin(self) -> [i32; 3] {
        [self.x, self.y, self.z].map(|c| i32::from(c) * BLOCK_SIDE as i32)
    }

    pub(super) fn packed(self) -> [i16; 4] {
        [self.x, self.y, self.z, 0]
    }

    pub(super) fn unpacked(packed: [i16; 4]) -> Self {
        Self { x: packed[0], y: packed[1], z: packed[2] }
    }
}

/// The payload of all blocks, by slot of the block pool. Voxel (x, y, z) of a block is item `x + 8 y + 64 z`.
#[derive(Debug)]
pub struct Blocks<'s> {
    /// Coordinates.
    pub(super) coord: &'s mut [[i16; 4]],
    /// Signed distance in units of truncation / 32,767: positive before the surface, meaningless where the weight is 0.
    pub(super) sdf: &'s mut [[i16; BLOCK_VOXELS]],
    /// Observations, up to `max_weight`; 0 is never seen.
    pub(super) weight: &'s mut [[u8; BLOCK_VOXELS]],
    /// Red, green and blue planes; all three 0 is no colour yet. Empty without colour.
    pub(super) colour: &'s mut [[[u8; BLOCK_VOXELS]; 3]],
    /// Digest of each block's content and place.
    pub(super) digest: &'s mut [u64],
    /// Least weight of each block's seen voxels, so that pruning need not look; 0 where it is not known.
    pub(super) faintest: &'s mut [u8],
}

impl<'s> Blocks<'s> {
    /// Bytes of the slab.
    pub const fn bytes(blocks: usize, colour: bool) -> usize {
        region_bytes::<[i16; 4]>(blocks)
            + region_bytes::<[i16; BLOCK_VOXELS]>(blocks)
            + region_bytes::<[u8; BLOCK_VOXELS]>(blocks)
            + if colour { region_bytes::<[[u8; BLOCK_VOXELS]; 3]>(blocks) } else { 0 }
            + region_bytes::<u64>(blocks)
            + region_bytes::<u8>(blocks)
    }

    /// Cuts the payload of `capacity.blocks` blocks.
    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        let coloured = if capacity.colour { capacity.blocks } else { 0 };
        Self {
            coord: carver.alloc("volume.coord", capacity.blocks),
            sdf: carver.alloc_as_found("volume.sdf", capacity.blocks),
            weight: carver.alloc_as_found("volume.weight", capacity.blocks),
            colour: if capacity.colour { carver.alloc_as_found("volume.colour", coloured) } else { &mut [] },
            digest: carver.alloc("volume.digest", capacity.blocks),
            faintest: carver.alloc("volume.faintest", capacity.blocks),
        }
    }

    /// Writes or reads the block in a slot: its place, its voxels and what they were last summed up to. The digest of a block that was made and
    /// never fused is 0, which its voxels would not tell.
    pub(super) fn archive(&mut self, slot: usize, archive: &mut impl Archive) {
        if let (Some(coord), Some(sdf), Some(weight)) = (self.coord.get_mut(slot), self.sdf.get_mut(slot), self.weight.get_mut(slot)) {
            archive.i16s(coord);
            archive.i16s(sdf);
            archive.raw(weight);
        }
        if let (Some(digest), Some(faintest)) = (self.digest.get_mut(slot), self.faintest.get_mut(slot)) {
            archive.u64(digest);
            archive.u8(faintest);
        }
        self.colour.get_mut(slot).into_iter().flatten().for_each(|plane| archive.raw(plane));
    }

    /// Makes a slot an empty block at `coord`.
    pub(super) fn clear(&mut self, slot: u32, coord: BlockCoord) {
        let slot = slot as usize;
        if let Some(entry) = self.coord.get_mut(slot) {
            *entry = coord.packed();
        }
        if let Some(block) = self.sdf.get_mut(slot) {
            block.fill(0);
        }
        if let Some(block) = self.weight.get_mut(slot) {
            block.fill(0);
        }
        if let Some(planes) = self.colour.get_mut(slot) {
            planes.iter_mut().for_each(|plane| plane.fill(0));
        }
        if let Some(digest) = self.digest.get_mut(slot) {
            *digest = 0;
        }
        if let Some(faintest) = self.faintest.get_mut(slot) {
            *faintest = 0;
        }
    }

    /// Where the block in a slot lies.
    pub fn coord(&self, slot: u32) -> Option<BlockCoord> {
        self.coord.get(slot as usize).copied().map(BlockCoord::unpacked)
    }

    /// Signed distances of the block in a slot.
    pub fn sdf(&self, slot: u32) -> Option<&[i16; BLOCK_VOXELS]> {
        self.sdf.get(slot as usize)
    }

    /// Weights of the block in a slot.
    pub fn weight(&self, slot: u32) -> Option<&[u8; BLOCK_VOXELS]> {
        self.weight.get(slot as usize)
    }

    /// Colour planes of the block in a slot; `None` without colour.
    pub fn colour(&self, slot: u32) -> Option<&[[u8; BLOCK_VOXELS]; 3]> {
        self.colour.get(slot as usize)
    }
}

/// Least weight of the seen voxels; 0 where none is seen.
pub(super) fn faintest_weight(weight: &[u8; BLOCK_VOXELS]) -> u8 {
    // Never seen wraps around to the most there is, and back.
    weight.iter().map(|weight| weight.wrapping_sub(1)).fold(u8::MAX, |least, one| if one < least { one } else { least }).wrapping_add(1)
}
