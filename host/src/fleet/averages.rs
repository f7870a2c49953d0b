//! A merged map as averages on disk, as a run's blocks are kept.

use super::resolve::{BlockChange, resolve};
use super::submap::not_stored;
use super::tile_file::{Lattice, TileReader};
use super::tile_folder::tiles;
use super::{Change, FleetError, changes};
use crate::formats::DraftFolder;
use crate::run::BLOCKS_FILE;
use crate::run::store::BlockFile;
use dynvox_core::volume::{BlockStore, EvictedBlock};
use std::fs::File;
use std::path::Path;

/// Averages of a map's voxels, in a folder that goes when this is dropped.
pub struct Averages {
    /// The blocks that have a surface.
    pub store: BlockFile<File>,
    /// Their voxels.
    pub lattice: Lattice,
    /// Their number.
    pub blocks: u64,
    /// Blocks that are known to be free.
    pub free_blocks: u64,
    /// Voxels that were seen too often for their sums.
    pub overflowed: u64,
    /// What has changed between epochs, the largest first.
    pub changes: Vec<Change>,
    _folder: DraftFolder,
}

impl Averages {
    /// Of the map in `folder`, in a file beside `out` meanwhile; changes below `least_change_m3` are not listed.
    ///
    /// # Errors
    /// The folder has no tile, a tile is damaged or of other voxels, or the disk refuses.
    pub fn of(folder: &Path, out: &Path, least_change_m3: f64) -> Result<Self, FleetError> {
        let lattice = match tiles(folder)?.values().next() {
            Some(first) => TileReader::open(first)?.lattice(),
            None => return Err(FleetError::content(folder, "has no tile: nothing was mapped")),
        };
        let scratch = DraftFolder::of(&out.with_extension("blocks"));
        std::fs::create_dir_all(scratch.path()).map_err(FleetError::io(scratch.path()))?;
        let path = scratch.path().join(BLOCKS_FILE);
        let (mut store, _) = BlockFile::open(&path, lattice.voxel_size_m, lattice.truncation_m)?;
        let (mut blocks, mut free_blocks, mut overflowed) = (0, 0, 0);
        let mut changed: Vec<BlockChange> = Vec::new();
        resolve(folder, |resolved, changes| {
            changed.extend_from_slice(changes);
            overflowed += resolved.average.overflowed;
            if !resolved.has_surface {
                free_blocks += 1;
                return Ok(());
            }
            blocks += 1;
            let average = &resolved.average;
            let block = EvictedBlock {
                coord: resolved.coord,
                sdf: &average.sdf,
                weight: &average.weight,
                colour: average.colour.as_deref(),
            };
            if store.store(block) { Ok(()) } else { Err(not_stored(&store, &path)) }
        })?;
        let changes = changes(&changed, &lattice, least_change_m3);
        Ok(Self { store, lattice, blocks, free_blocks, overflowed, changes, _folder: scratch })
    }
}
