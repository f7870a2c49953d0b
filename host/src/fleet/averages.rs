//! A merged map as averages on disk, as a run's blocks are kept.

use super::FleetError;
use super::resolve::resolve;
use super::submap::not_stored;
use super::tile_file::{Lattice, TileReader};
use super::tile_folder::tiles;
use crate::owned::DraftFolder;
use crate::run::BLOCKS_FILE;
use crate::run::store::BlockFile;
use dynvox_core::volume::{BlockKey, BlockStore, EvictedBlock};
use std::fs::File;
use std::path::Path;

/// Averages of a map's voxels, in a folder that goes when this is dropped.
pub struct Averages {
    /// The blocks that have a surface.
    pub store: BlockFile<File>,
    /// Lattice of the voxels.
    pub lattice: Lattice,
    /// Number of blocks.
    pub blocks: u64,
    /// Voxels that were seen too often for their sums.
    pub overflowed: u64,
    _folder: DraftFolder,
}

impl Averages {
    /// Averages the map in `folder` into a temporary file next to `out`.
    ///
    /// # Errors
    /// The folder has no tile, a tile is damaged or of other voxels, or the disk refuses.
    pub fn of(folder: &Path, out: &Path) -> Result<Self, FleetError> {
        // All tiles have one lattice; the first says which.
        let lattice = match tiles(folder)?.values().next() {
            Some(first) => TileReader::open(first)?.lattice(),
            None => return Err(FleetError::content(folder, "has no tile: nothing was mapped")),
        };
        // The averages may be larger than memory: they go to a file next to the result.
        let scratch = DraftFolder::begin(&out.with_extension("blocks"));
        let scratch = scratch.map_err(FleetError::io(out))?;
        let path = scratch.path().join(BLOCKS_FILE);
        let (mut store, _) = BlockFile::open(&path, lattice.voxel_size_m, lattice.truncation_m)?;
        let resolved = resolve(folder, |resolved| {
            let average = &resolved.average;
            let block = EvictedBlock {
                key: BlockKey::in_first(resolved.coord),
                sdf: &average.sdf,
                weight: &average.weight,
                colour: average.colour.as_deref(),
            };
            // Free blocks have no surface to draw.
            if !resolved.has_surface || store.store(block) {
                Ok(())
            } else {
                Err(not_stored(&store, &path))
            }
        })?;
        Ok(Self {
            store,
            lattice,
            blocks: resolved.blocks,
            overflowed: resolved.overflowed,
            _folder: scratch,
        })
    }
}
