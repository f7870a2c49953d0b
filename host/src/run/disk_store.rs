//! The store of evicted blocks during a run, and the mesh made of pool and store.

use super::map_objects::{MapObjects, add_objects};
use super::store::{self, BlockFile, Position, StoreError};
use super::{FolderError, RunFolder};
use crate::formats::{Axes, MAP_FILE, Mesh, MeshVertex, PlyWriter};
use crate::observe::{StoreStats, weighed_triangles};
use dynvox_core::volume::{BlockCoord, BlockStore, EvictedBlock, EvictionReport, LoadedBlock};
use dynvox_core::{Capacity, Config, Mapper};
use hashbrown::HashSet;
use std::fs::File;

/// Name of the file in the run folder.
pub const BLOCKS_FILE: &str = "map.blocks";

/// How evicted blocks are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Streaming {
    /// Bytes the file may grow to; limited by the disk when absent.
    pub most_bytes: Option<u64>,
    /// Whether the file is a part of the result.
    pub keep_file: bool,
}

/// A file of blocks, or none.
#[derive(Debug)]
pub struct DiskStore {
    file: Option<BlockFile<File>>,
    /// Blocks evicted since they were last taken.
    evicted: HashSet<BlockCoord>,
}

impl BlockStore for DiskStore {
    fn store(&mut self, block: EvictedBlock<'_>) -> bool {
        self.evicted.insert(block.coord);
        self.file.as_mut().is_some_and(|file| file.store(block))
    }

    fn load(&mut self, block: LoadedBlock<'_>) -> bool {
        self.file.as_mut().is_some_and(|file| file.load(block))
    }
}

impl DiskStore {
    fn of(file: Option<BlockFile<File>>) -> Self {
        Self { file, evicted: HashSet::new() }
    }

    /// The blocks that were evicted since this was last asked, stored or lost.
    pub fn take_evicted(&mut self) -> HashSet<BlockCoord> {
        std::mem::take(&mut self.evicted)
    }

    /// Opens the file in the run folder if blocks are to be stored.
    pub fn begin(streaming: Option<Streaming>, folder: &RunFolder, config: &Config) -> Result<Self, StoreError> {
        let Some(streaming) = streaming else { return Ok(Self::of(None)) };
        let (mut file, _) = BlockFile::open(&folder.file(BLOCKS_FILE), config.volume.voxel_size_m, config.volume.truncation_m)?;
        file.limit(streaming.most_bytes.unwrap_or(u64::MAX));
        Ok(Self::of(Some(file)))
    }

    /// Opens the file of a resumed run, as it was at the checkpoint.
    pub fn resume(streaming: Option<Streaming>, folder: &RunFolder, config: &Config, at: Option<&Position>) -> Result<Self, StoreError> {
        let (Some(streaming), Some(at)) = (streaming, at) else { return Ok(Self::of(None)) };
        let mut file = BlockFile::reopen(&folder.file(BLOCKS_FILE), config.volume.voxel_size_m, config.volume.truncation_m, at)?;
        file.limit(streaming.most_bytes.unwrap_or(u64::MAX));
        Ok(Self::of(Some(file)))
    }

    /// The end of the file, if there is one; synced to the disk up to there.
    pub fn position(&self) -> std::io::Result<Option<Position>> {
        self.file.as_ref().map(BlockFile::position).transpose()
    }

    /// Whether the disk refused, and not the limit that was asked for.
    pub fn disk_failed(&self) -> bool {
        self.file.as_ref().is_some_and(BlockFile::disk_failed)
    }

    /// Why blocks are no longer stored, if so.
    pub fn failure(&self) -> Option<String> {
        self.file.as_ref().and_then(BlockFile::failure).map(ToString::to_string)
    }
}

/// A mesh on its way to disk.
pub struct MeshOutput {
    /// Or why there is no file.
    ply: std::io::Result<PlyWriter>,
    store: DiskStore,
    /// Blocks that are in the mesh already.
    meshed: HashSet<BlockCoord>,
    report: EvictionReport,
}

impl MeshOutput {
    /// Begins `map.ply`. Meshes the pool's blocks when none was evicted and the file is not kept, or when nothing more can be stored; otherwise evicts
    /// them to the store.
    pub fn begin(mapper: &mut Mapper<'_>, (mut store, streaming): (DiskStore, Option<Streaming>), folder: &RunFolder, axes: Axes) -> Self {
        let mut ply = PlyWriter::begin_in(&folder.file(MAP_FILE), "the first camera", axes);
        let mut report = EvictionReport::default();
        let mut meshed = HashSet::new();
        let keeps_file = streaming.is_some_and(|streaming| streaming.keep_file);
        if store.file.as_ref().is_none_or(|file| file.records() == 0 && !keeps_file || file.failure().is_some()) {
            let volume = mapper.background();
            weighed_triangles(volume, &mapper.config().mesh, |_| true, &mut |corners| add(&mut ply, corners));
            meshed.extend(volume.pool().live().filter_map(|slot| volume.blocks().coord(slot)));
        } else {
            report = mapper.stream_out(&mut store);
        }
        Self { ply, store, meshed, report }
    }

    /// Adds the stored blocks, reading them piece by piece into `slab`, and the objects, and ends the file. What cannot be written leaves no file, and the reason.
    pub fn finish(
        mut self,
        slab: &mut [u8],
        (capacity, config): (&Capacity, &Config),
        (folder, objects): (&RunFolder, MapObjects),
    ) -> (Result<Mesh, FolderError>, StoreStats) {
        let mut stats = StoreStats { end: self.report, failure: self.store.failure(), ..StoreStats::default() };
        let mut failed = None;
        if let Some(file) = self.store.file.as_mut() {
            let ply = &mut self.ply;
            let (how, memory) = ((&config.volume, &config.mesh), (slab, capacity.colour));
            let meshed = store::mesh::triangles(file, how, memory, &self.meshed, &mut |corners| add(ply, corners));
            failed = meshed.err().map(|error| std::io::Error::other(format!("the slab is too small for a piece of the map: {error:?}")));
            (stats.records, stats.bytes, stats.unreadable) = (file.records(), file.bytes(), file.unreadable());
        }
        let written = failed.map_or(Ok(()), Err).and_then(|()| {
            let mut ply = self.ply?;
            add_objects(&mut ply, folder.path(), objects)?;
            ply.finish()
        });
        let path = folder.file(MAP_FILE);
        let written = written.map_err(|source| {
            // It may not exist.
            let _ = std::fs::remove_file(&path);
            FolderError::Write { path, source }
        });
        (written, stats)
    }
}

fn add(ply: &mut std::io::Result<PlyWriter>, corners: [MeshVertex; 3]) {
    let Ok(ply) = ply else { return };
    ply.triangle(corners);
}
