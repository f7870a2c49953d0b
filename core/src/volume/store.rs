//! Where blocks go when the pool is full, and where they come back from.
//!
//! When a block is to be made and no slot is free, the block unseen for longest leaves, unless it
//! was visible in this frame or the last: then the pool is too small for what is in view, and the
//! new block is refused. What is still within the pruning window when it leaves is pruned first, as
//! it would have been had it stayed. Constant work per block made, for maps of any size.
//!
//! Blocks of earlier segments are not handed over when another segment begins: they leave like
//! others that are not seen any more, and without a store they are lost then, and counted.

use super::{BLOCK_VOXELS, BlockKey, Slot, Volume, block::Voxels, config::WhenFull};

/// A block as it leaves the map.
#[derive(Clone, Copy, Debug)]
pub struct EvictedBlock<'b> {
    /// Segment and coordinates of the block.
    pub key: BlockKey,
    /// Signed distances.
    pub sdf: &'b [i16; BLOCK_VOXELS],
    /// Weights.
    pub weight: &'b [u8; BLOCK_VOXELS],
    /// Colour planes, where the map has colour.
    pub colour: Option<&'b [[u8; BLOCK_VOXELS]; 3]>,
}

/// A block to be filled from the store; all zero before.
#[derive(Debug)]
pub struct LoadedBlock<'b> {
    /// Segment and coordinates of the block.
    pub key: BlockKey,
    /// Signed distances.
    pub sdf: &'b mut [i16; BLOCK_VOXELS],
    /// Weights.
    pub weight: &'b mut [u8; BLOCK_VOXELS],
    /// Colour planes, where the map has colour.
    pub colour: Option<&'b mut [[u8; BLOCK_VOXELS]; 3]>,
}

/// The caller's memory for blocks: evicted blocks are stored in it and loaded from it.
pub trait BlockStore {
    /// Stores a block that leaves the map; the last one stored with its key counts. `false` when
    /// it cannot be stored: it is lost, and counted.
    fn store(&mut self, block: EvictedBlock<'_>) -> bool;

    /// Fills a block that is made again; `false` when none is stored with its key; the block must
    /// then stay all zero.
    fn load(&mut self, block: LoadedBlock<'_>) -> bool;
}

/// Stores nothing: every block that leaves the map is lost.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoStore;

impl BlockStore for NoStore {
    fn store(&mut self, _: EvictedBlock<'_>) -> bool {
        false
    }

    fn load(&mut self, _: LoadedBlock<'_>) -> bool {
        false
    }
}

/// Counts of blocks evicted to the store and loaded from it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct EvictionReport {
    /// Blocks evicted and stored.
    pub stored: u32,
    /// Blocks evicted and lost: the store refused them, or no store is attached.
    pub lost: u32,
    /// Blocks evicted with nothing in them, or nothing that pruning would have spared.
    pub empty: u32,
    /// Blocks loaded from the store.
    pub loaded: u32,
}

impl Volume<'_> {
    /// Evicts the block unseen for longest. Whether a slot is free now.
    pub(super) fn evict<S: BlockStore>(
        &mut self,
        store: &mut S,
        report: &mut EvictionReport,
    ) -> bool {
        let Some(slot) = self.lru.oldest() else { return false };
        // What is visible now is needed now: no block is evicted for another one of the same view.
        if self.config.when_full == WhenFull::Refuse || self.visible.was_lately(slot) {
            return false;
        }
        self.evict_block(slot, store, report);
        true
    }

    /// Evicts the block in a slot, which is free then.
    pub(super) fn evict_block<S: BlockStore>(
        &mut self,
        slot: Slot,
        store: &mut S,
        report: &mut EvictionReport,
    ) {
        // Still in the window of pruning: it is pruned before it leaves, as it would be later.
        if self.config.prunes() && self.history.covers(self.visible.last_visible(slot)) {
            let (_, freed) = self.prune_block(slot, self.rule());
            if freed {
                report.empty += 1;
                return;
            }
        }
        // An empty block is no loss and takes no disk space.
        match self.evicted(slot) {
            Some(block) if block.weight.iter().all(|&weight| weight == 0) => report.empty += 1,
            Some(block) if store.store(block) => report.stored += 1,
            _ => report.lost += 1,
        }
        self.free_block(slot);
    }

    /// Returns the contents of a slot.
    fn evicted(&self, slot: Slot) -> Option<EvictedBlock<'_>> {
        Some(EvictedBlock {
            key: self.blocks.key(slot)?,
            sdf: self.blocks.sdf(slot)?,
            weight: self.blocks.weight(slot)?,
            colour: self.blocks.colour(slot),
        })
    }

    /// Lets every block leave, in slot order, as at the end of a run.
    pub fn stream_out<S: BlockStore>(&mut self, store: &mut S) -> EvictionReport {
        let mut report = EvictionReport::default();
        let mut from = 0;
        while let Some(slot) = self.pool.next_live(from) {
            from = slot.get() + 1;
            match self.evicted(slot) {
                Some(block) if block.weight.iter().all(|&weight| weight == 0) => report.empty += 1,
                Some(block) if store.store(block) => report.stored += 1,
                _ => report.lost += 1,
            }
            self.free_block(slot);
        }
        report
    }

    /// Loads the block stored with a key into the map, as when a map on disk is viewed part by
    /// part. Whether the block is in the map now; where none is stored, or no slot is free, it is
    /// not.
    pub fn load<S: BlockStore>(&mut self, key: BlockKey, store: &mut S) -> bool {
        if self.find_key(key).is_some() {
            return true;
        }
        let Some(slot) = self.make(key) else { return false };
        let loaded = self.load_into(slot, key, store);
        if !loaded {
            self.free_block(slot);
        }
        loaded
    }

    /// Fills a block that was just made from the store.
    pub(super) fn load_into<S: BlockStore>(
        &mut self,
        slot: Slot,
        key: BlockKey,
        store: &mut S,
    ) -> bool {
        let at = slot.index();
        let Some(Voxels { sdf, weight }) = self.blocks.voxels.get_mut(at) else { return false };
        let colour = self.blocks.colour.get_mut(at);
        let returned = store.load(LoadedBlock { key, sdf, weight, colour });
        // The digest of what came back.
        if returned {
            self.update_digest(slot);
        }
        returned
    }
}
