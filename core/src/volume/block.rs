//! What blocks hold: an array of records, and beside it one for what is read without the voxels and
//! one for colour (docs/decisions/0017-blocks-as-records.md).
//!
//! Memory: 1,536 bytes of voxels a block, 3,072 with colour, a header of 16, and one of least
//! weight.

use super::Slot;
use crate::geometry::MapSegment;
use crate::memory::{Capacity, Carver, region_bytes};
use crate::state::Visitor;
use bytemuck::{Pod, Zeroable};

/// Lattice points along a block's side.
pub const BLOCK_SIDE: usize = 8;
/// Lattice points in a block.
pub const BLOCK_VOXELS: usize = BLOCK_SIDE * BLOCK_SIDE * BLOCK_SIDE;

/// Lattice points of a block with one z.
pub const LAYER_VOXELS: usize = BLOCK_SIDE * BLOCK_SIDE;
/// One value for each of them.
pub(crate) type Layer<T> = [T; LAYER_VOXELS];

/// A block's place: it holds the lattice points `8 * coord ..= 8 * coord + 7` on each axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BlockCoord {
    /// Coordinate along x, blocks.
    pub x: i16,
    /// Coordinate along y, blocks.
    pub y: i16,
    /// Coordinate along z, blocks.
    pub z: i16,
}

impl BlockCoord {
    /// The block at these coordinates; `None` beyond 16 bits (13 km at 5 cm), where the map ends.
    pub fn new(x: i32, y: i32, z: i32) -> Option<Self> {
        Some(Self {
            x: i16::try_from(x).ok()?,
            y: i16::try_from(y).ok()?,
            z: i16::try_from(z).ok()?,
        })
    }

    /// The block that holds a lattice point.
    pub fn of_lattice(point: [i32; 3]) -> Option<Self> {
        Self::new(point[0] >> 3, point[1] >> 3, point[2] >> 3)
    }

    /// The block `offset` blocks away; `None` beyond the map.
    pub(crate) fn offset(self, offset: [i32; 3]) -> Option<Self> {
        Self::new(
            i32::from(self.x) + offset[0],
            i32::from(self.y) + offset[1],
            i32::from(self.z) + offset[2],
        )
    }

    /// The first lattice point of the block.
    pub(crate) fn origin(self) -> [i32; 3] {
        [self.x, self.y, self.z].map(|c| i32::from(c) * BLOCK_SIDE as i32)
    }
}

/// Name of a block among all blocks of a map: coordinates are those of its segment's lattice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BlockKey {
    /// Segment of the map that the block is of.
    pub segment: MapSegment,
    /// Coordinates in the segment's lattice.
    pub coord: BlockCoord,
}

impl BlockKey {
    /// Key of the block at `coord` in the first segment.
    pub const fn in_first(coord: BlockCoord) -> Self {
        Self { segment: MapSegment::FIRST, coord }
    }

    /// Key of the block `offset` blocks away in the same segment; `None` beyond the map.
    pub(crate) fn offset(self, offset: [i32; 3]) -> Option<Self> {
        Some(Self { coord: self.coord.offset(offset)?, ..self })
    }
}

/// A block without its colour: what every stage that visits it reads together.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Voxels {
    /// Signed distance in units of truncation / 32,767: positive before the surface, meaningless
    /// where the weight is 0.
    pub sdf: [i16; BLOCK_VOXELS],
    /// Observations, up to `max_weight`; 0 is never observed.
    pub weight: [u8; BLOCK_VOXELS],
}

impl Voxels {
    /// Distances and weights by layer, z ascending.
    pub fn layers_mut(&mut self) -> impl Iterator<Item = (&mut Layer<i16>, &mut Layer<u8>)> {
        self.sdf.as_chunks_mut().0.iter_mut().zip(self.weight.as_chunks_mut().0)
    }
}

/// The colour planes of layer `z`, which is below [`BLOCK_SIDE`].
#[inline]
pub(super) fn colour_layer_mut(colour: &mut Colour, z: usize) -> Option<[&mut Layer<u8>; 3]> {
    let [red, green, blue] = colour.each_mut().map(|plane| plane.as_chunks_mut().0.get_mut(z));
    Some([red?, green?, blue?])
}

/// Red, green and blue planes of a block; all three 0 is no colour yet.
pub(crate) type Colour = [[u8; BLOCK_VOXELS]; 3];

/// Record of a block besides its voxels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Header {
    /// Digest of the block's coordinates and content; 0 until the block is first fused.
    pub digest: u64,
    coord: [i16; 3],
    segment: MapSegment,
}

impl Header {
    /// Returns the header of an empty block.
    pub fn new(BlockKey { segment, coord }: BlockKey) -> Self {
        Self { digest: 0, coord: [coord.x, coord.y, coord.z], segment }
    }

    /// Returns the block's key.
    #[inline]
    pub fn key(&self) -> BlockKey {
        let [x, y, z] = self.coord;
        BlockKey { segment: self.segment, coord: BlockCoord { x, y, z } }
    }
}

/// All blocks, by slot of the block pool. Voxel (x, y, z) of a block is item `x + 8 y + 64 z`.
#[derive(Debug)]
pub struct Blocks<'s> {
    pub(super) header: &'s mut [Header],
    /// Least weight of the observed voxels, so that pruning need not read them; 0 where it is not
    /// known.
    pub(super) min_weight: &'s mut [u8],
    pub(super) voxels: &'s mut [Voxels],
    /// Empty without colour.
    pub(super) colour: &'s mut [Colour],
}

impl<'s> Blocks<'s> {
    /// Bytes of the slab.
    pub(crate) const fn bytes(blocks: usize, colour: bool) -> usize {
        region_bytes::<Header>(blocks)
            + region_bytes::<u8>(blocks)
            + Self::voxel_bytes(blocks, colour)
    }

    /// Bytes of voxels and their colour.
    pub(crate) const fn voxel_bytes(blocks: usize, colour: bool) -> usize {
        region_bytes::<Voxels>(blocks) + if colour { region_bytes::<Colour>(blocks) } else { 0 }
    }

    /// Cuts the memory of `capacity.blocks` blocks.
    pub(crate) fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self {
            header: carver.alloc("volume.header", capacity.blocks),
            min_weight: carver.alloc("volume.min_weight", capacity.blocks),
            // Not cleared: a block is when its slot is taken, and memory of free slots is never
            // touched.
            voxels: carver.alloc_as_found("volume.voxels", capacity.blocks),
            colour: if capacity.colour {
                carver.alloc_as_found("volume.colour", capacity.blocks)
            } else {
                &mut []
            },
        }
    }

    /// Visits the block in a slot: its segment and coordinates, its voxels and what they were last
    /// summed up to. The digest of a block that was made and never fused is 0, which its voxels
    /// would not tell.
    pub(super) fn visit(&mut self, slot: Slot, visitor: &mut impl Visitor) {
        let Self { header, min_weight, voxels, colour } = self;
        if let (Some(header), Some(min_weight), Some(voxels)) = (
            header.get_mut(slot.index()),
            min_weight.get_mut(slot.index()),
            voxels.get_mut(slot.index()),
        ) {
            let (Header { coord, segment, digest }, Voxels { sdf, weight }) = (header, voxels);
            let mut number = segment.get();
            visitor.u16s(core::slice::from_mut(&mut number));
            *segment = MapSegment::new(number);
            visitor.i16s(coord);
            visitor.i16s(sdf);
            visitor.bytes(weight);
            visitor.u64(digest);
            visitor.u8(min_weight);
        }
        colour.get_mut(slot.index()).into_iter().flatten().for_each(|plane| visitor.bytes(plane));
    }

    /// Makes a slot the empty block of a key.
    pub(super) fn clear(&mut self, slot: Slot, key: BlockKey) {
        if let Some(header) = self.header.get_mut(slot.index()) {
            *header = Header::new(key);
        }
        if let Some(min_weight) = self.min_weight.get_mut(slot.index()) {
            *min_weight = 0;
        }
        if let Some(Voxels { sdf, weight }) = self.voxels.get_mut(slot.index()) {
            sdf.fill(0);
            weight.fill(0);
        }
        if let Some(planes) = self.colour.get_mut(slot.index()) {
            planes.iter_mut().for_each(|plane| plane.fill(0));
        }
    }

    /// Moves the block in a slot to another segment.
    pub(super) fn set_segment(&mut self, slot: Slot, segment: MapSegment) {
        if let Some(header) = self.header.get_mut(slot.index()) {
            header.segment = segment;
        }
    }

    /// Returns the segment and the coordinates of the block in a slot.
    #[inline]
    pub fn key(&self, slot: Slot) -> Option<BlockKey> {
        self.header.get(slot.index()).map(Header::key)
    }

    /// Returns the coordinates of the block in a slot, in the lattice of its segment.
    #[inline]
    pub fn coord(&self, slot: Slot) -> Option<BlockCoord> {
        self.key(slot).map(|key| key.coord)
    }

    /// Returns true if every observed voxel of the block in a slot is known to have a weight above
    /// `weight`.
    #[inline]
    pub(super) fn exceeds(&self, slot: Slot, weight: u8) -> bool {
        self.min_weight.get(slot.index()).is_some_and(|least| *least > weight)
    }

    /// Signed distances of the block in a slot.
    pub fn sdf(&self, slot: Slot) -> Option<&[i16; BLOCK_VOXELS]> {
        self.voxels.get(slot.index()).map(|voxels| &voxels.sdf)
    }

    /// Weights of the block in a slot.
    pub fn weight(&self, slot: Slot) -> Option<&[u8; BLOCK_VOXELS]> {
        self.voxels.get(slot.index()).map(|voxels| &voxels.weight)
    }

    /// Colour planes of the block in a slot; `None` without colour.
    pub fn colour(&self, slot: Slot) -> Option<&Colour> {
        self.colour.get(slot.index())
    }
}

/// Least weight of the seen voxels; 0 where none is seen.
pub(super) fn least_weight(weight: &[u8; BLOCK_VOXELS]) -> u8 {
    // Never seen wraps around to the most there is, and back.
    weight
        .iter()
        .map(|weight| weight.wrapping_sub(1))
        .fold(u8::MAX, |least, one| if one < least { one } else { least })
        .wrapping_add(1)
}
