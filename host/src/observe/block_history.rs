//! History of the static map's blocks: when each was last visible, and which of them pruning took:
//! `blocks.csv`.
//!
//! Memory: 12 bytes a slot of the pool. A row is written when a block leaves the pool, and for
//! those that are left at the end.

use super::tables::{BlockFate, block_rows};
use super::{EndContext, Finished, FrameContext, GrowingFile, ObserveError, ObservedRun, Observer};
use crate::formats::BLOCKS_TABLE_FILE;
use dynvox_core::geometry::MapSegment;
use dynvox_core::volume::{BlockCoord, BlockKey, Volume};
use hashbrown::HashSet;
use serde::{Deserialize, Serialize};
use std::io;

/// Segment and coordinates of a block.
type SavedKey = (MapSegment, [i16; 3]);

/// A block, and the number of the frame it was last visible in.
type Sighting = (SavedKey, u32);

/// Watches which blocks the pool holds.
#[derive(Debug, Serialize, Deserialize)]
pub struct BlockHistoryObserver {
    /// By slot.
    sightings: Vec<Option<Sighting>>,
    file: GrowingFile,
}

impl Default for BlockHistoryObserver {
    fn default() -> Self {
        Self { sightings: Vec::new(), file: GrowingFile::new(BLOCKS_TABLE_FILE) }
    }
}

impl Observer for BlockHistoryObserver {
    type Section = ();

    fn files(&mut self) -> Vec<&mut GrowingFile> {
        vec![&mut self.file]
    }

    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        let volume = frame.view.mapper().static_map();
        let mut left = self.note_visible(volume, frame.row.frame as u32);
        let report = &frame.row.report;
        let eviction = &report.allocate.eviction;
        // Looking for absent blocks costs a look-up each: only in frames in which some were freed.
        if report.prune.blocks_freed + eviction.stored + eviction.lost + eviction.empty > 0 {
            left.extend(self.take_absent(volume));
        }
        // Archived blocks were seen under the key they had before.
        let archived = |key: &&BlockKey| key.segment.archived_submap().is_some();
        let archived: HashSet<_> =
            frame.evicted.iter().filter(archived).map(|key| key.coord).collect();
        // A block that eviction did not name was freed by pruning.
        let fate = |saved_key: &SavedKey| {
            let key = key_of(*saved_key);
            if frame.evicted.contains(&key) || archived.contains(&key.coord) {
                BlockFate::Evicted
            } else {
                BlockFate::Pruned
            }
        };
        self.write(run, left.into_iter().map(|(coord, last)| (coord, last, fate(&coord))))
    }

    fn end(
        &mut self,
        run: &ObservedRun<'_>,
        end: &mut EndContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        // First what the last pruning took.
        let pruned = self.take_absent(end.view.mapper().static_map());
        let kept = std::mem::take(&mut self.sightings).into_iter().flatten();
        let rows = pruned.into_iter().map(|(coord, last)| (coord, last, BlockFate::Pruned));
        self.write(run, rows.chain(kept.map(|(coord, last)| (coord, last, BlockFate::Map))))
    }

    fn finish(self, _: &ObservedRun<'_>, _: &Finished) -> Result<(), ObserveError> {
        Ok(())
    }
}

impl BlockHistoryObserver {
    /// Enters the blocks visible in a frame. Returns those whose slot has another one now.
    fn note_visible(&mut self, volume: &Volume<'_>, frame: u32) -> Vec<Sighting> {
        let mut left = Vec::new();
        for &slot in volume.visible().slots() {
            let Some(coord) = volume.blocks().key(slot).map(saved_key) else { continue };
            if self.sightings.len() <= slot.index() {
                self.sightings.resize(slot.index() + 1, None);
            }
            // Another block in the slot: the one before was pruned or evicted.
            let before = self.sightings[slot.index()].replace((coord, frame));
            left.extend(before.filter(|(known, _)| *known != coord));
        }
        left
    }

    /// Takes out the blocks whose slot is free now.
    fn take_absent(&mut self, volume: &Volume<'_>) -> Vec<Sighting> {
        let mut live = volume.pool().live().map(|slot| slot.index()).peekable();
        let mut left = Vec::new();
        for (slot, sighting) in self.sightings.iter_mut().enumerate() {
            // Both lists ascend.
            while live.next_if(|&at| at < slot).is_some() {}
            if live.peek() != Some(&slot) {
                left.extend(sighting.take());
            }
        }
        left
    }

    fn write(
        &mut self,
        run: &ObservedRun<'_>,
        rows: impl Iterator<Item = (SavedKey, u32, BlockFate)>,
    ) -> Result<(), ObserveError> {
        let failed = |source: io::Error| ObserveError::Write {
            path: run.folder.join(BLOCKS_TABLE_FILE),
            source,
        };
        self.file.append(&block_rows(rows, self.file.is_empty()).map_err(failed)?);
        Ok(())
    }
}

fn saved_key(BlockKey { segment, coord }: BlockKey) -> SavedKey {
    (segment, [coord.x, coord.y, coord.z])
}

fn key_of(key: SavedKey) -> BlockKey {
    let (segment, [x, y, z]) = key;
    BlockKey { segment, coord: BlockCoord { x, y, z } }
}
