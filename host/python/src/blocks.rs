//! Blocks that leave the slab, in a file.

use super::error::{raise, refuse};
use dynvox::run::store::BlockFile;
use dynvox_core::Config;
use dynvox_core::volume::{BlockStore, EvictedBlock, LoadedBlock};
use pyo3::prelude::*;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use tempfile::TempPath;

/// Destination of evicted blocks.
#[derive(Clone, Debug)]
pub enum BlocksChoice {
    /// To a temporary file, as in `dynvox run`.
    Temporary,
    /// To a file that stays. Only a file that this mapper made is ever replaced.
    File {
        /// The file.
        path: PathBuf,
        /// True once this mapper made the block file.
        ours: bool,
    },
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
    pub fn begin(choice: &mut BlocksChoice, config: &Config, records: &[u8]) -> PyResult<Self> {
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
                std::fs::write(&path, records).map_err(|error| not_written(&path, &error))?;
                (path.to_path_buf(), Some(path))
            }
            BlocksChoice::File { path, ours } => {
                write_new(path, ours, records)?;
                (path.clone(), None)
            }
        };
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

/// Makes the file of evicted blocks; what is there is the caller's, unless this mapper made it.
fn write_new(path: &Path, ours: &mut bool, records: &[u8]) -> PyResult<()> {
    if std::mem::take(ours) {
        // Of a link that took its place only the link goes.
        let removed = std::fs::remove_file(path);
        let is_absent = |error: &io::Error| error.kind() == io::ErrorKind::NotFound;
        removed.or_else(
            |error| if is_absent(&error) { Ok(()) } else { Err(not_written(path, &error)) },
        )?;
    }
    let made = OpenOptions::new().write(true).create_new(true).open(path);
    let mut file = made.map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists => refuse(format!(
            "{} exists. Name another file for evicted blocks, or remove it",
            path.display()
        )),
        _ => not_written(path, &error),
    })?;
    *ours = true;
    file.write_all(records).map_err(|error| not_written(path, &error))
}

fn not_written(path: &Path, error: &io::Error) -> PyErr {
    refuse(format!(
        "{} cannot be written: {error}. Name another file for evicted blocks",
        path.display()
    ))
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
