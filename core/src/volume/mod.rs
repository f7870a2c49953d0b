//! The voxel-hashed map (Section III-E of the paper; Nießner et al., *Real-time 3D Reconstruction
//! at Scale using Voxel Hashing*, 2013).
//!
//! Space is a lattice of points `voxel_size_m` apart; lattice point (i, j, k) lies at
//! `voxel_size_m * (i, j, k)` in the map's frame. 8 x 8 x 8 of them are a block. Each point keeps a
//! signed distance, how often it was seen and, where the profile has it, a colour. A depth image is
//! fused in two steps: blocks within the truncation of its surface are made ([`Volume::allocate`]),
//! then every visible block is updated by integer averages ([`Volume::fuse`]); what was visible a
//! fixed lag ago is rid of noise (`Volume::prune`).
//!
//! A map has segments, each with a lattice of its own; a block's record names its segment, and
//! blocks of several may be in the pool. One segment is current: frames are fused into it, and
//! pictures, surfaces and samples are of it unless another one is named
//! (docs/decisions/0061-segments-by-number.md).

mod allocate;
mod archived;
pub(crate) mod block;
mod config;
mod erase;
mod fuse;
mod history;
mod index;
mod lru_list;
mod noted_depth;
mod observed;
mod pool;
mod prune;
mod request;
mod sampler;
mod store;
pub(crate) mod submaps;
mod surroundings;
#[cfg(test)]
pub(crate) mod tests;
mod viewpoint;
mod visible;
mod visit;

pub use allocate::AllocationReport;
pub(crate) use allocate::is_within_map;
pub use block::{BLOCK_SIDE, BLOCK_VOXELS, BlockCoord, BlockKey, Blocks};
pub use config::{CLASS_COUNT, DistanceAlong, ObservationWeight, PruneBy, VolumeConfig, WhenFull};
use fuse::BEFORE_FAR;
pub(crate) use fuse::FusedBlocks;
pub use fuse::Observation;
pub use history::VisibleHistory;
#[cfg(feature = "hashbrown")]
pub use index::HashedIndex;
pub use index::{BlockIndex, PlainIndex};
pub(crate) use lru_list::LruList;
pub use noted_depth::{DepthImage, NotedDepth};
pub(crate) use observed::ObservedDepth;
pub use pool::{Full, Slot, SlotPool};
pub use prune::PruneReport;
pub use request::MAX_BLOCKS_PER_RAY;
pub(crate) use request::PIXEL_STEP;
pub use sampler::{Sampler, VoxelSample};
pub use store::{BlockStore, EvictedBlock, EvictionReport, LoadedBlock, NoStore};
pub(crate) use surroundings::{BLOCK, EDGE_Q8, Surroundings};
pub use viewpoint::Viewpoint;
pub use visible::VisibleList;

use crate::geometry::MapSegment;
use crate::memory::{Capacity, Carver, Footprint};

/// A map of blocks.
#[derive(Debug)]
pub struct Volume<'s> {
    config: VolumeConfig,
    index: BlockIndex<'s>,
    pool: SlotPool<'s>,
    blocks: Blocks<'s>,
    visible: VisibleList<'s>,
    requested: request::RequestedCache<'s>,
    history: VisibleHistory<'s>,
    lru: LruList<'s>,
    segment: MapSegment,
    digest: u64,
    submaps: submaps::Submaps<'s>,
}

impl<'s> Volume<'s> {
    /// Bytes of the slab.
    pub const fn bytes(capacity: &Capacity) -> usize {
        BlockIndex::bytes(capacity.blocks)
            + SlotPool::bytes(capacity.blocks)
            + Blocks::bytes(capacity.blocks, capacity.colour)
            + VisibleList::bytes(capacity)
            + request::RequestedCache::bytes()
            + VisibleHistory::bytes(capacity)
            + LruList::bytes(capacity.blocks)
            + submaps::Submaps::bytes(capacity)
    }

    /// Bytes of it that belong in large memory: voxels and their colour.
    pub(crate) const fn cold_bytes(capacity: &Capacity) -> usize {
        Blocks::voxel_bytes(capacity.blocks, capacity.colour)
    }

    /// Cuts an empty map.
    pub fn new_in(capacity: &Capacity, config: &VolumeConfig, carver: &mut Carver<'s>) -> Self {
        Self {
            config: *config,
            index: BlockIndex::new_in(capacity.blocks, carver),
            pool: SlotPool::new_in(carver, capacity.blocks, ["volume.live", "volume.free"]),
            blocks: Blocks::new_in(capacity, carver),
            visible: VisibleList::new_in(capacity, carver),
            requested: request::RequestedCache::new_in(carver),
            history: VisibleHistory::new_in(capacity, carver),
            lru: LruList::new_in(capacity.blocks, carver),
            segment: MapSegment::FIRST,
            digest: 0,
            submaps: submaps::Submaps::new_in(capacity, carver),
        }
    }

    /// The parameters the map was made with.
    pub fn config(&self) -> &VolumeConfig {
        &self.config
    }

    /// The pool of slots: how many blocks there are, and which slots hold one.
    pub fn pool(&self) -> &SlotPool<'s> {
        &self.pool
    }

    /// The payload of all blocks.
    pub fn blocks(&self) -> &Blocks<'s> {
        &self.blocks
    }

    /// The blocks visible in the last frame.
    pub fn visible(&self) -> &VisibleList<'s> {
        &self.visible
    }

    /// Returns the blocks that were visible in the frames of the window.
    pub fn history(&self) -> &VisibleHistory<'s> {
        &self.history
    }

    /// Segment that frames are fused into.
    pub fn segment(&self) -> MapSegment {
        self.segment
    }

    /// Makes a segment the current one. Blocks of the others stay in the pool until they are
    /// unseen for longest.
    pub fn enter_segment(&mut self, segment: MapSegment) {
        self.segment = segment;
    }

    /// Slots and coordinates of the current segment's blocks, by slot.
    pub fn current_blocks(&self) -> impl Iterator<Item = (Slot, BlockCoord)> + Clone + '_ {
        let current =
            |slot: &Slot| self.blocks.key(*slot).filter(|key| key.segment == self.segment);
        self.pool.live().filter_map(move |slot| Some((slot, current(&slot)?.coord)))
    }

    /// The block at `coord` in the current segment.
    pub(crate) fn find(&self, coord: BlockCoord) -> Option<Slot> {
        self.find_key(self.key(coord))
    }

    /// The block of a key.
    pub(crate) fn find_key(&self, key: BlockKey) -> Option<Slot> {
        self.index.find(key, |slot| self.blocks.key(slot))
    }

    /// Key of the block at `coord` in the current segment.
    pub(crate) fn key(&self, coord: BlockCoord) -> BlockKey {
        BlockKey { segment: self.segment, coord }
    }

    /// A reader of single voxels of the current segment.
    pub fn sampler(&self) -> Sampler<'_, 's> {
        Sampler::new(self)
    }

    /// Digest of the segments, coordinates and contents of all blocks, in any order they were made:
    /// the wrapping sum of theirs.
    pub fn digest(&self) -> u64 {
        self.digest
    }

    /// Sums a block up anew after its content changed, and corrects the map's digest by the
    /// difference.
    fn update_digest(&mut self, slot: Slot) {
        let at = slot.index();
        let Blocks { header, min_weight, voxels, colour } = &mut self.blocks;
        if let (Some(header), Some(least), Some(voxels)) =
            (header.get_mut(at), min_weight.get_mut(at), voxels.get(at))
        {
            let new = fuse::block_digest(header.key(), voxels, colour.get(at));
            // The digest is a sum over blocks, so that one block's part can be exchanged.
            self.digest = self.digest.wrapping_sub(header.digest).wrapping_add(new);
            header.digest = new;
            *least = block::least_weight(&voxels.weight);
        }
    }

    /// Enters what is in use into a footprint.
    pub(crate) fn note_use(&self, footprint: &mut Footprint) {
        let (now, peak) = (self.pool.len(), self.pool.peak());
        footprint.set_use::<block::Header>("volume.header", now, peak);
        footprint.set_use::<u8>("volume.min_weight", now, peak);
        footprint.set_use::<block::Voxels>("volume.voxels", now, peak);
        footprint.set_use::<block::Colour>("volume.colour", now, peak);
        let [history, history_peak] = self.history.words_in_use();
        footprint.set_use::<u64>("volume.history", history, history_peak);
        footprint.set_use::<Slot>(
            "volume.visible",
            self.visible.slots().len(),
            self.visible.peak(),
        );
    }
}
