//! One segment of a map, read as a map of its own.

use super::Tile;
use super::mesh::BlockSource;
use dynvox_core::geometry::MapSegment;
use dynvox_core::volume::{BlockKey, BlockStore, EvictedBlock, LoadedBlock};

/// Blocks of one segment, in its own frame of reference: keys are those of a first segment.
pub struct OneSegment<'s, S> {
    source: &'s mut S,
    segment: MapSegment,
}

impl<'s, S> OneSegment<'s, S> {
    /// Blocks of `segment` in `source`.
    pub fn new(source: &'s mut S, segment: MapSegment) -> Self {
        Self { source, segment }
    }
}

impl<S: BlockSource> BlockSource for OneSegment<'_, S> {
    fn tiles(&self) -> Vec<Tile> {
        let own = self.source.tiles().into_iter().filter(|tile| tile.segment == self.segment);
        own.map(|tile| Tile { segment: MapSegment::FIRST, ..tile }).collect()
    }

    fn blocks_of(&mut self, tile: Tile) -> Vec<BlockKey> {
        let own = self.source.blocks_of(Tile { segment: self.segment, ..tile });
        own.into_iter().map(|key| BlockKey::in_first(key.coord)).collect()
    }
}

impl<S: BlockStore> BlockStore for OneSegment<'_, S> {
    fn store(&mut self, block: EvictedBlock<'_>) -> bool {
        let key = BlockKey { segment: self.segment, ..block.key };
        self.source.store(EvictedBlock { key, ..block })
    }

    fn load(&mut self, block: LoadedBlock<'_>) -> bool {
        let key = BlockKey { segment: self.segment, ..block.key };
        self.source.load(LoadedBlock { key, ..block })
    }
}
