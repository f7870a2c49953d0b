//! Where blocks go that leave the pool during a run, and how pool and file become one mesh.

use super::store::{self, BlockFile, Position, StoreError};
use super::{FolderError, RunFolder};
use crate::formats::{Mesh, PlyWriter};
use dynvox_core::view::Triangle;
use dynvox_core::volume::{BlockCoord, BlockStore, EvictionReport, LeavingBlock, ReturningBlock};
use dynvox_core::{Capacity, Config, Mapper};
use hashbrown::HashSet;
use std::fs::File;

/// Name of the file in the run folder.
pub const FILE: &str = "map.blocks";

/// How blocks that leave the pool are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Streaming {
    /// Bytes the file may grow to; as far as the disk goes when absent.
    pub most_bytes: Option<u64>,
    /// Whether the file stays when the mesh is written.
    pub keep_file: bool,
}

/// What a shelf held in the end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShelfUse {
    /// Records written, those that later ones replace included.
    pub records: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// Records that could not be read back.
    pub unreadable: u64,
    /// Blocks that left at the end of the run.
    pub end: EvictionReport,
}

/// A file of blocks, or nothing.
#[derive(Debug)]
pub struct Shelf(Option<BlockFile<File>>);

impl BlockStore for Shelf {
    fn keep(&mut self, block: LeavingBlock<'_>) -> bool {
        self.0.as_mut().is_some_and(|file| file.keep(block))
    }

    fn bring_back(&mut self, block: ReturningBlock<'_>) -> bool {
        self.0.as_mut().is_some_and(|file| file.bring_back(block))
    }
}

impl Shelf {
    /// Opens the file in the run folder if blocks are to be kept.
    pub fn begin(streaming: Option<Streaming>, folder: &RunFolder, config: &Config) -> Result<Self, StoreError> {
        let Some(streaming) = streaming else { return Ok(Self(None)) };
        let (mut file, _) = BlockFile::open(&folder.file(FILE), config.volume.voxel_size_m, config.volume.truncation_m)?;
        file.limit(streaming.most_bytes.unwrap_or(u64::MAX));
        Ok(Self(Some(file)))
    }

    /// Opens the file of a run that goes on, as it was when it stopped.
    pub fn resume(streaming: Option<Streaming>, folder: &RunFolder, config: &Config, at: Option<&Position>) -> Result<Self, StoreError> {
        let (Some(streaming), Some(at)) = (streaming, at) else { return Ok(Self(None)) };
        let mut file = BlockFile::reopen(&folder.file(FILE), config.volume.voxel_size_m, config.volume.truncation_m, at)?;
        file.limit(streaming.most_bytes.unwrap_or(u64::MAX));
        Ok(Self(Some(file)))
    }

    /// How far the file has come, if there is one; it is on the disk as far as that.
    pub fn mark(&self) -> std::io::Result<Option<Position>> {
        self.0.as_ref().map(BlockFile::mark).transpose()
    }

    /// Why blocks are kept no longer, if so.
    pub fn failure(&self) -> Option<String> {
        self.0.as_ref().and_then(BlockFile::failure).map(ToString::to_string)
    }
}

/// A mesh on its way to disk.
pub struct MeshOutput {
    ply: PlyWriter,
    shelf: Shelf,
    /// Blocks that the pool's own mesh held already.
    drawn: HashSet<BlockCoord>,
    report: EvictionReport,
}

impl MeshOutput {
    /// Begins `map.ply`. Takes the pool's blocks: as triangles when nothing left it, or when nothing more can be kept; else onto the shelf.
    pub fn begin(mapper: &mut Mapper<'_>, mut shelf: Shelf, folder: &RunFolder) -> Result<Self, FolderError> {
        let path = folder.file("map.ply");
        let mut ply = PlyWriter::begin(&path).map_err(|source| FolderError::Write { path, source })?;
        let mut report = EvictionReport::default();
        let mut drawn = HashSet::new();
        if shelf.0.as_ref().is_none_or(|file| file.records() == 0 || file.failure().is_some()) {
            mapper.triangles(&mut |triangle| add(&mut ply, triangle));
            let volume = mapper.background();
            drawn.extend(volume.pool().live().filter_map(|slot| volume.blocks().coord(slot)));
        } else {
            report = mapper.stream_out(&mut shelf);
        }
        Ok(Self { ply, shelf, drawn, report })
    }

    /// Why the shelf takes no more, if it does not.
    pub fn failure(&self) -> Option<String> {
        self.shelf.failure()
    }

    /// Adds what is on the shelf, reading it piece by piece into `slab`, and ends the file.
    pub fn finish(
        mut self,
        slab: &mut [u8],
        (capacity, config): (&Capacity, &Config),
        folder: &RunFolder,
    ) -> Result<(Mesh, ShelfUse), FolderError> {
        let mut shelf_use = ShelfUse { end: self.report, ..ShelfUse::default() };
        let written = (|| {
            if let Some(file) = self.shelf.0.as_mut() {
                let ply = &mut self.ply;
                let (how, place) = ((&config.volume, &config.mesh), (slab, capacity.colour));
                store::mesh::triangles(file, how, place, &self.drawn, &mut |triangle| add(ply, triangle))
                    .map_err(|error| std::io::Error::other(format!("the slab has no room for a piece of the map: {error:?}")))?;
                shelf_use = ShelfUse {
                    records: file.records(),
                    bytes: file.bytes(),
                    unreadable: file.unreadable(),
                    ..shelf_use
                };
            }
            self.ply.finish()
        })();
        let mesh = written.map_err(|source| FolderError::Write { path: folder.file("map.ply"), source })?;
        Ok((mesh, shelf_use))
    }
}

fn add(ply: &mut PlyWriter, Triangle { vertices }: Triangle) {
    ply.triangle(vertices.map(|vertex| (vertex.position_m, vertex.colour)));
}
