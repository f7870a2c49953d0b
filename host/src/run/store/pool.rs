//! A map that is partly in memory and partly on disk, read as one: a block of the pool is newer
//! than its records.
//!
//! Memory: about 30 bytes for each block of the pool.

use super::BlockFile;
use super::block_index::{Tile, tile_of};
use super::mesh::BlockSource;
use dynvox_core::volume::{BlockKey, BlockStore, EvictedBlock, LoadedBlock, Slot, Volume};
use hashbrown::HashMap;
use std::io::{Read, Seek, Write};

/// Pool and file.
pub struct PoolAndFile<'a, 's, F> {
    volume: &'a Volume<'s>,
    file: &'a mut BlockFile<F>,
    /// The pool's blocks that hold anything.
    slots: HashMap<BlockKey, Slot>,
    by_tile: HashMap<Tile, Vec<BlockKey>>,
}

impl<'a, 's, F: Read + Write + Seek> PoolAndFile<'a, 's, F> {
    /// Joins a volume with the file that its blocks were evicted to.
    pub fn new(volume: &'a Volume<'s>, file: &'a mut BlockFile<F>) -> Self {
        let (mut slots, mut by_tile) = (HashMap::new(), HashMap::<_, Vec<_>>::new());
        let blocks = volume.blocks();
        for slot in volume.pool().live() {
            let holds_any =
                blocks.weight(slot).is_some_and(|weight| weight.iter().any(|&weight| weight > 0));
            if let Some(key) = blocks.key(slot).filter(|_| holds_any) {
                slots.insert(key, slot);
                by_tile.entry(tile_of(key)).or_default().push(key);
            }
        }
        Self { volume, file, slots, by_tile }
    }
}

impl<F: Read + Write + Seek> BlockSource for PoolAndFile<'_, '_, F> {
    fn tiles(&self) -> Vec<Tile> {
        let mut tiles = self.file.tiles();
        tiles.extend(self.by_tile.keys());
        tiles.sort_unstable();
        tiles.dedup();
        tiles
    }

    fn blocks_of(&mut self, tile: Tile) -> Vec<BlockKey> {
        let mut keys = self.file.blocks_of(tile);
        keys.extend(self.by_tile.get(&tile).into_iter().flatten());
        keys.sort_unstable();
        keys.dedup();
        keys
    }
}

impl<F: Read + Write + Seek> BlockStore for PoolAndFile<'_, '_, F> {
    fn store(&mut self, _: EvictedBlock<'_>) -> bool {
        false
    }

    fn load(&mut self, block: LoadedBlock<'_>) -> bool {
        let Some(&slot) = self.slots.get(&block.key) else { return self.file.load(block) };
        let blocks = self.volume.blocks();
        let (Some(sdf), Some(weight)) = (blocks.sdf(slot), blocks.weight(slot)) else {
            return false;
        };
        (*block.sdf, *block.weight) = (*sdf, *weight);
        if let (Some(to), Some(from)) = (block.colour, blocks.colour(slot)) {
            *to = *from;
        }
        true
    }
}
