//! The store of evicted blocks during a run, and the mesh made of pool and store.

use super::map_objects::add_objects;
use super::store::{self, BehindFile, BlockFile, PoolAndFile, Position, StoreError};
use super::{FolderError, RunFolder};
use crate::formats::{MAP_FILE, Mesh, MeshAxes, PlyWriter, ShownSegment};
use crate::observe::StoreStats;
use crate::owned;
use crate::request::{MapObjects, Streaming};
use crate::slab::HostSlab;
use dynvox_core::memory::SlabError;
use dynvox_core::volume::{BlockKey, BlockStore, EvictedBlock, EvictionReport, LoadedBlock};
use dynvox_core::{Capacity, Config, Mapper};
use hashbrown::HashSet;
use std::collections::BTreeSet;
use std::fs::File;

/// Name of the file in the run folder.
pub const BLOCKS_FILE: &str = "map.blocks";

/// A file of blocks, or none.
#[derive(Debug)]
pub struct DiskStore {
    file: Option<BehindFile<File>>,
    /// Blocks evicted since they were last taken.
    evicted: HashSet<BlockKey>,
}

impl BlockStore for DiskStore {
    fn store(&mut self, block: EvictedBlock<'_>) -> bool {
        self.evicted.insert(block.key);
        self.file.as_mut().is_some_and(|file| file.store(block))
    }

    fn load(&mut self, block: LoadedBlock<'_>) -> bool {
        self.file.as_mut().is_some_and(|file| file.load(block))
    }
}

impl DiskStore {
    fn of(file: Option<BlockFile<File>>) -> Self {
        Self { file: file.map(BehindFile::new), evicted: HashSet::new() }
    }

    /// The blocks that were evicted since this was last asked, stored or lost.
    pub fn take_evicted(&mut self) -> HashSet<BlockKey> {
        std::mem::take(&mut self.evicted)
    }

    /// Opens the file in the run folder if blocks are to be stored.
    pub fn begin(
        streaming: Option<Streaming>,
        folder: &RunFolder,
        config: &Config,
    ) -> Result<Self, StoreError> {
        let Some(streaming) = streaming else { return Ok(Self::of(None)) };
        let (mut file, _) = BlockFile::open(
            &folder.file(BLOCKS_FILE),
            config.volume.voxel_size_m,
            config.volume.truncation_m,
        )?;
        file.limit(streaming.max_bytes.unwrap_or(u64::MAX));
        Ok(Self::of(Some(file)))
    }

    /// Opens the file of a resumed run, as it was at the checkpoint.
    pub fn resume(
        streaming: Option<Streaming>,
        folder: &RunFolder,
        config: &Config,
        at: Option<&Position>,
    ) -> Result<Self, StoreError> {
        let (Some(streaming), Some(at)) = (streaming, at) else { return Ok(Self::of(None)) };
        let mut file = BlockFile::reopen(
            &folder.file(BLOCKS_FILE),
            config.volume.voxel_size_m,
            config.volume.truncation_m,
            at,
        )?;
        file.limit(streaming.max_bytes.unwrap_or(u64::MAX));
        Ok(Self::of(Some(file)))
    }

    /// Ends a step: what it evicted is written from here on, while the next frame is read. Returns
    /// the number of blocks of earlier steps that a failing disk did not take.
    pub fn end_step(&mut self) -> u32 {
        self.file.as_mut().map_or(0, BehindFile::hand_over)
    }

    /// The end of the file, if there is one; synced to the disk up to there.
    pub fn position(&self) -> std::io::Result<Option<Position>> {
        self.file.as_ref().map(|file| file.with_file(BlockFile::position)).transpose()
    }

    /// Returns true if the disk refused, rather than the limit that was asked for.
    pub fn disk_failed(&self) -> bool {
        self.file.as_ref().is_some_and(|file| file.with_file(BlockFile::disk_failed))
    }

    /// Returns the reason why blocks are no longer stored, if so.
    pub fn failure(&self) -> Option<String> {
        let failure = |file: &BlockFile<File>| file.failure().map(ToString::to_string);
        self.file.as_ref().and_then(|file| file.with_file(failure))
    }
}

/// A mesh on its way to disk.
pub struct MeshOutput {
    /// Or why there is no file.
    ply: std::io::Result<PlyWriter>,
    file: Option<BlockFile<File>>,
    /// True if blocks of the file are not in the mesh yet.
    file_is_due: bool,
    /// Blocks that are in the mesh already.
    meshed: HashSet<BlockKey>,
    failed: Option<std::io::Error>,
    report: EvictionReport,
}

impl MeshOutput {
    /// Begins `map.ply`. Where the file of blocks is kept, the pool's blocks are evicted to it;
    /// otherwise they are meshed where they are, with those of the file around them.
    pub fn begin(
        mapper: &mut Mapper<'_>,
        (store, streaming): (DiskStore, Option<Streaming>),
        folder: &RunFolder,
        (axes, colour): (MeshAxes, bool),
    ) -> Self {
        let begin =
            || PlyWriter::begin_with(&folder.file(MAP_FILE), "the first camera", axes, colour);
        // A disk without a free entry has those of the reserve.
        let mut ply = begin().or_else(|_| {
            folder.release_reserve();
            begin()
        });
        let (mut report, mut meshed, mut failed) =
            (EvictionReport::default(), HashSet::new(), None);
        let mut file = store.file.and_then(BehindFile::into_file);
        let keeps_file = streaming.is_some_and(|streaming| streaming.keep_file);
        let mut file_is_due = true;
        match file
            .as_mut()
            .filter(|file| (file.records() > 0 || keeps_file) && file.failure().is_none())
        {
            None => {
                let volume = mapper.static_map();
                let keys = volume.pool().live().filter_map(|slot| volume.blocks().key(slot));
                meshed.extend(keys);
                let segments: BTreeSet<_> =
                    meshed.iter().map(|key: &BlockKey| key.segment).collect();
                if let Ok(ply) = &mut ply {
                    for segment in segments {
                        let of_segment = |key: BlockKey| key.segment == segment;
                        let mut shown = ShownSegment::new(volume.driven_segment(segment), ply);
                        volume.mesh(&mapper.config().mesh, of_segment, &mut shown);
                    }
                }
            }
            Some(file) if !keeps_file => {
                if let Ok(ply) = &mut ply {
                    failed = pool_and_file(mapper, (file, colour), ply).err();
                }
                file_is_due = false;
            }
            Some(file) => report = mapper.stream_out(file),
        }
        Self { ply, file, file_is_due, meshed, failed, report }
    }

    /// Adds the stored blocks, reading them piece by piece into `slab`, and the objects, and ends
    /// the file. What cannot be written leaves no file, and the reason.
    pub fn finish(
        mut self,
        slab: &mut [u8],
        (capacity, config): (&Capacity, &Config),
        (folder, objects): (&RunFolder, MapObjects),
    ) -> (Result<Mesh, FolderError>, StoreStats) {
        let failure = self.file.as_ref().and_then(BlockFile::failure).map(ToString::to_string);
        let mut stats = StoreStats { end: self.report, failure, ..StoreStats::default() };
        let mut failed = self.failed;
        if let Some(file) = self.file.as_mut() {
            if self.file_is_due
                && let Ok(ply) = &mut self.ply
            {
                let (how, memory) = ((&config.volume, &config.mesh), (slab, capacity.colour));
                failed = store::mesh::triangles(file, how, memory, &self.meshed, ply)
                    .err()
                    .map(too_small);
            }
            (stats.records, stats.bytes, stats.unreadable) =
                (file.records(), file.bytes(), file.unreadable());
        }
        let written = failed.map_or(Ok(()), Err).and_then(|()| {
            let mut ply = self.ply?;
            add_objects(&mut ply, folder.path(), objects)?;
            ply.finish()
        });
        let path = folder.file(MAP_FILE);
        let written = written.map_err(|source| {
            // It may not exist.
            let _ = owned::remove_file(&path);
            FolderError::Write { path, source }
        });
        (written, stats)
    }
}

/// Adds the mesh of a mapper's pool and of the blocks that were evicted from it.
fn pool_and_file(
    mapper: &Mapper<'_>,
    (file, colour): (&mut BlockFile<File>, bool),
    ply: &mut PlyWriter,
) -> std::io::Result<()> {
    let mut slab =
        HostSlab::map(store::mesh::slab_bytes(colour)).ok_or(std::io::ErrorKind::OutOfMemory)?;
    let (how, memory) =
        ((&mapper.config().volume, &mapper.config().mesh), (slab.bytes_mut(), colour));
    let mut source = PoolAndFile::new(mapper.static_map(), file);
    store::mesh::triangles(&mut source, how, memory, &HashSet::new(), ply)
        .map(drop)
        .map_err(too_small)
}

fn too_small(error: SlabError) -> std::io::Error {
    std::io::Error::other(format!("the slab is too small for a piece of the map: {error:?}"))
}
