//! Blocks that leave the slab, in a file.

use super::error::{raise, refuse};
use dynvox::run::store::BlockFile;
use dynvox_core::Config;
use dynvox_core::volume::{BlockStore, EvictedBlock, LoadedBlock};
use pyo3::prelude::*;
use std::fs::File;
use std::io::{Read, Write};
use std::path::PathBuf;
use tempfile::TempPath;

/// Destination of evicted blocks.
#[derive(Clone, Debug)]
pub enum BlocksChoice {
    /// To a temporary file, as in `dynvox run`.
    Temporary,
    /// To a file of the caller's, which stays.
    File(PathBuf),
    /// Nowhere: they are lost, and counted.
    Lost,
}

/// Evicted blocks.
pub enum Blocks {
    Stored { file: BlockFile<File>, path: PathBuf, _temporary: Option<TempPath> },
    Lost,
}

impl Blocks {
    /// An empty store; with `records`, those of a snapshot.
    pub fn begin(choice: &BlocksChoice, config: &Config, records: &[u8]) -> PyResult<Self> {
        let (path, temporary) = match choice {
            BlocksChoice::Lost if records.is_empty() => return Ok(Self::Lost),
            BlocksChoice::Lost => {
                return Err(refuse(
                    "the snapshot has evicted blocks, and this mapper loses them. Make it with \
                     stream=True",
                ));
            }
            BlocksChoice::Temporary => {
                let path = tempfile::NamedTempFile::new().map_err(raise)?.into_temp_path();
                (path.to_path_buf(), Some(path))
            }
            BlocksChoice::File(path) => (path.clone(), None),
        };
        let shown = path.display();
        if temporary.is_none() && records.is_empty() && path.exists() {
            return Err(refuse(format!(
                "{shown} exists. Name another file for evicted blocks, or remove it"
            )));
        }
        if !records.is_empty() {
            let written = File::create(&path).and_then(|mut file| file.write_all(records));
            written.map_err(|error| {
                refuse(format!(
                    "{shown} cannot be written: {error}. Name another file for evicted blocks"
                ))
            })?;
        }
        let (file, _) =
            BlockFile::open(&path, config.volume.voxel_size_m, config.volume.truncation_m)
                .map_err(raise)?;
        Ok(Self::Stored { file, path, _temporary: temporary })
    }

    /// The file, where it has records.
    pub fn file_mut(&mut self) -> Option<&mut BlockFile<File>> {
        match self {
            Self::Stored { file, .. } if file.records() > 0 => Some(file),
            _ => None,
        }
    }

    /// The bytes of the file up to its last whole record; none where it has no record.
    pub fn bytes(&mut self) -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        if let Self::Stored { file, path, .. } = self
            && file.records() > 0
        {
            File::open(path)?.take(file.position()?.bytes).read_to_end(&mut bytes)?;
        }
        Ok(bytes)
    }
}

impl BlockStore for Blocks {
    fn store(&mut self, block: EvictedBlock<'_>) -> bool {
        match self {
            Self::Stored { file, .. } => file.store(block),
            Self::Lost => false,
        }
    }

    fn load(&mut self, block: LoadedBlock<'_>) -> bool {
        match self {
            Self::Stored { file, .. } => file.load(block),
            Self::Lost => false,
        }
    }
}
