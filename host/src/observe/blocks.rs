//! Blocks of the map over a run: made, pruned, evicted, stored.

use super::{DepthTotals, Finished, FrameContext, ObserveError, ObservedRun, Observer};
use crate::formats::Mesh;
use dynvox_core::memory::Region;
use dynvox_core::volume::EvictionReport;
use serde::{Deserialize, Serialize};

/// Contents of the block store after the last frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StoreStats {
    /// Records written, replaced ones included.
    pub records: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// Records that could not be read back.
    pub unreadable: u64,
    /// Blocks evicted at the end of the run.
    pub end: EvictionReport,
    /// Reason why nothing more was stored, if the disk failed.
    pub failure: Option<String>,
}

/// Counts over all frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BlockTotals {
    /// Most blocks in use at once.
    pub peak: u32,
    /// Blocks refused.
    pub refused: u64,
    /// Blocks evicted and stored.
    pub stored: u64,
    /// Blocks evicted and lost.
    pub lost: u64,
    /// Blocks evicted with nothing in them.
    pub empty: u64,
    /// Blocks loaded back.
    pub loaded: u64,
    /// Most comparisons in one lookup of the index.
    pub probes_most: u32,
    /// Blocks visited by pruning.
    pub prune_visited: u64,
    /// Voxels reset.
    pub voxels_reset: u64,
    /// Blocks freed by pruning.
    pub blocks_freed: u64,
    /// Most blocks whose pruning waited for a later frame.
    pub carried_over_most: u32,
    /// Frames pruned early because the history was full.
    pub early: u64,
    /// Voxels reset because a moving object had been there.
    pub voxels_erased: u64,
    /// Most frames in the history.
    pub history_frames_most: usize,
}

/// Blocks of the map over a run.
#[derive(Clone, Debug)]
pub struct BlocksSection {
    /// Counts over all frames, pruning after the last one included.
    pub totals: BlockTotals,
    /// The slab, region by region, at the end.
    pub regions: Vec<Region>,
    /// Depth of all frames, by what the map shows of it.
    pub depth: DepthTotals,
    /// Blocks in memory at the end.
    pub blocks: usize,
    /// The mesh written.
    pub mesh: Mesh,
    /// The block store.
    pub store: StoreStats,
}

impl BlocksSection {
    /// Blocks that are neither in memory nor on disk: evicted and not stored, or not readable.
    pub fn lost(&self) -> u64 {
        self.totals.lost + u64::from(self.store.end.lost) + self.store.unreadable
    }

    /// Bytes of the slab in use by the map's regions (`volume.*`).
    pub fn map_bytes(&self) -> u64 {
        self.regions
            .iter()
            .filter(|region| region.name.starts_with("volume."))
            .map(|region| region.used as u64)
            .sum()
    }
}

/// Counts blocks.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct BlocksObserver {
    totals: BlockTotals,
    depth: DepthTotals,
}

impl Observer for BlocksObserver {
    type Section = BlocksSection;

    fn frame(
        &mut self,
        _: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        let (totals, row) = (&mut self.totals, frame.row);
        let (allocation, prune) = (&row.report.allocate, &row.report.prune);
        // The pool keeps its peak itself; all others are of one frame.
        totals.peak = row.report.blocks.peak;
        totals.refused += u64::from(row.blocks_refused());
        totals.stored += u64::from(allocation.eviction.stored);
        totals.lost += u64::from(allocation.eviction.lost);
        totals.empty += u64::from(allocation.eviction.empty);
        totals.loaded += u64::from(allocation.eviction.loaded);
        totals.probes_most = totals.probes_most.max(allocation.probes_most);
        totals.prune_visited += u64::from(prune.visited);
        totals.voxels_reset += u64::from(prune.voxels_reset);
        totals.blocks_freed += u64::from(prune.blocks_freed);
        totals.carried_over_most = totals.carried_over_most.max(prune.carried_over);
        totals.early += u64::from(prune.early);
        totals.voxels_erased += u64::from(prune.voxels_erased);
        self.depth.add(&row.depth);
        totals.history_frames_most = totals.history_frames_most.max(row.history_frames);
        Ok(())
    }

    fn finish(
        mut self,
        _: &ObservedRun<'_>,
        finished: &Finished,
    ) -> Result<BlocksSection, ObserveError> {
        self.totals.prune_visited += u64::from(finished.pruned.visited);
        self.totals.voxels_reset += u64::from(finished.pruned.voxels_reset);
        self.totals.blocks_freed += u64::from(finished.pruned.blocks_freed);
        Ok(BlocksSection {
            totals: self.totals,
            depth: self.depth,
            regions: finished.regions.clone(),
            blocks: finished.blocks,
            mesh: finished.mesh,
            store: finished.store.clone(),
        })
    }
}
