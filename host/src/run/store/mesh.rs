//! A map outside a pool as triangles, cube by cube: in memory at once are a cube of 8 blocks a side
//! and the layer behind it.

use super::{BlockFile, Tile};
use crate::formats::ShownSegment;
use dynvox_core::Capacity;
use dynvox_core::memory::{Carver, SlabError};
use dynvox_core::view::{MeshConfig, MeshSink};
use dynvox_core::volume::{BlockCoord, BlockKey, BlockStore, NoStore, Volume, VolumeConfig};
use hashbrown::HashSet;
use std::io::{Read, Seek, Write};

/// A cube's side in blocks is 2 to this power.
const CUBE_BITS: u32 = 3;
/// Blocks along a cube's side, with the layer behind it.
const SIDE: i32 = (1 << CUBE_BITS) + 1;

/// The capacity of a volume for one cube.
const fn cube_capacity(colour: bool) -> Capacity {
    Capacity {
        blocks: (SIDE * SIDE * SIDE) as usize,
        visible_blocks: 1,
        history_frames: 1,
        colour,
        ..Capacity::TINY
    }
}

const _: () = assert!(
    Volume::bytes(&cube_capacity(true)) < Capacity::TINY.bytes(),
    "any profile's slab is large enough for a cube"
);

/// Blocks that are read tile by tile.
pub trait BlockSource: BlockStore {
    /// The tiles in which there are blocks, ascending.
    fn tiles(&self) -> Vec<Tile>;

    /// The blocks in a tile, ascending.
    fn blocks_of(&mut self, tile: Tile) -> Vec<BlockKey>;
}

impl<F: Read + Write + Seek> BlockSource for BlockFile<F> {
    fn tiles(&self) -> Vec<Tile> {
        Self::tiles(self)
    }

    fn blocks_of(&mut self, tile: Tile) -> Vec<BlockKey> {
        Self::blocks_of(self, tile)
    }
}

/// Bytes of the slab that a cube needs.
pub fn slab_bytes(colour: bool) -> usize {
    Volume::bytes(&cube_capacity(colour))
}

/// Hands the triangles of all blocks in `store` but those in `without` to `sink`, in an order that
/// depends on the blocks only; each segment is shown above the one before ([`ShownSegment`]).
/// `slab` holds a cube at a time: any profile's is large enough. Returns the number of triangles.
///
/// # Errors
///
/// A slab too small.
pub fn triangles(
    store: &mut impl BlockSource,
    (volume, mesh): (&VolumeConfig, &MeshConfig),
    (slab, colour): (&mut [u8], bool),
    without: &HashSet<BlockKey>,
    sink: &mut impl MeshSink,
) -> Result<u64, SlabError> {
    let capacity = cube_capacity(colour);
    let mut carver = Carver::new(slab, Volume::bytes(&capacity))?;
    let mut volume = Volume::new_in(&capacity, volume, &mut carver);
    carver.check()?;
    let mut count = 0;
    for tile in store.tiles() {
        let mut blocks = store.blocks_of(tile);
        // All blocks of a tile are of one segment.
        let cube_of =
            |BlockKey { coord, .. }: &BlockKey| [coord.x, coord.y, coord.z].map(|c| c >> CUBE_BITS);
        blocks.sort_unstable_by_key(|key| (cube_of(key), *key));
        for blocks in blocks.chunk_by(|a, b| cube_of(a) == cube_of(b)) {
            let Some(cube) = blocks.first().map(cube_of) else { continue };
            for &key in blocks {
                volume.load(key, store);
            }
            for coord in behind(cube) {
                volume.load(BlockKey { segment: tile.segment, coord }, store);
            }
            count += volume.mesh(
                mesh,
                |key| cube_of(&key) == cube && !without.contains(&key),
                &mut ShownSegment::new(tile.segment, sink),
            );
            // Empties the volume: its blocks are still in the store.
            volume.stream_out(&mut NoStore);
        }
    }
    Ok(count)
}

/// The blocks behind a cube's last ones on each axis.
fn behind(cube: [i16; 3]) -> impl Iterator<Item = BlockCoord> {
    let first = cube.map(|c| i32::from(c) << CUBE_BITS);
    (0..SIDE * SIDE * SIDE).filter_map(move |i| {
        let [x, y, z] = [i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE];
        let is_behind = x == SIDE - 1 || y == SIDE - 1 || z == SIDE - 1;
        is_behind.then(|| BlockCoord::new(first[0] + x, first[1] + y, first[2] + z)).flatten()
    })
}
