//! Checkpoints: every so many frames the state of a run is written into its folder, so that an
//! interrupted run can be resumed.
//!
//! | bytes | what |
//! |---|---|
//! | 8 | `DVXSNAP\0` |
//! | 4 | [`VERSION`], little-endian as all numbers here |
//! | 8 | length of the host's part |
//! | | the host's part, CBOR: manifest, end of the file of blocks, state |
//! | | the mapper's: [`dynvox_core::mapper::snapshot`] |
//! | 4 | CRC-32 of all bytes before |
//!
//! The checkpoint before the last one stays: where the last is damaged, the run is resumed from
//! that one.
//!
//! Evicted blocks and rows are not copied: their files only ever grow, so the length and a checksum
//! of each describe it.
//!
//! Memory: the host's part, while it is written or read. It grows with the tracks and objects seen,
//! and with what is compared with ground truth.

mod error;
mod manifest;
#[cfg(test)]
mod tests;

pub use error::ResumeError;
pub use manifest::{RunManifest, fingerprint};

use super::state::RunState;
use super::{FolderError, PREVIOUS_SNAPSHOT_FILE, RunFolder, write_whole};
use crate::formats::bounds::{MAX_SNAPSHOT_BYTES, MAX_SNAPSHOT_PART_BYTES, check_bytes};
use crate::formats::checksum_of;
use crate::owned::rename_file;
use crate::request::Plan;
use crate::run::store::Position;
use dynvox_core::Mapper;
use dynvox_core::RestoreError;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom, Take, Write};
use std::path::{Path, PathBuf};

const MAGIC: [u8; 8] = *b"DVXSNAP\0";
/// Version of the layout and of the host's state. Another one is refused: there is no conversion.
const VERSION: u32 = 9;
/// Magic, version, length.
const HEAD: usize = 20;
/// Checksum.
const TAIL: usize = 4;

/// The host's part; borrowed to be written, owned when read.
#[derive(Serialize, Deserialize)]
struct Part<B, G> {
    manifest: B,
    blocks: Option<Position>,
    state: G,
}

/// Writes the checkpoint of a run into its folder; the last one becomes the one before.
pub(super) fn write(
    folder: &RunFolder,
    manifest: &RunManifest,
    blocks: Option<Position>,
    state: &RunState,
    mapper: &mut Mapper<'_>,
) -> Result<(), FolderError> {
    let last = folder.snapshot();
    write_whole(&last, |file| {
        let mut part = Vec::new();
        ciborium::into_writer(&Part { manifest, blocks, state }, &mut part)
            .map_err(io::Error::other)?;
        let mut checksum = crc32fast::Hasher::new();
        let mut write = |bytes: &[u8]| {
            checksum.update(bytes);
            file.write_all(bytes)
        };
        write(&head(part.len() as u64))?;
        write(&part)?;
        mapper.save(&mut write)?;
        file.write_all(&checksum.finalize().to_le_bytes())?;
        if last.is_file() {
            rename_file(&last, &folder.file(PREVIOUS_SNAPSHOT_FILE))
        } else {
            Ok(())
        }
    })
}

fn head(len: u64) -> [u8; HEAD] {
    let mut head = [0; HEAD];
    head[..8].copy_from_slice(&MAGIC);
    head[8..12].copy_from_slice(&VERSION.to_le_bytes());
    head[12..].copy_from_slice(&len.to_le_bytes());
    head
}

/// Opens a checkpoint of this version with no byte changed: the file behind its head, and the
/// lengths of its two parts.
fn open(path: &Path) -> Result<(BufReader<File>, [u64; 2]), ResumeError> {
    let failed = |source| ResumeError::Read { path: path.to_path_buf(), source };
    let damaged = || ResumeError::Damaged { path: path.to_path_buf() };
    let mut file = File::open(path).map_err(failed)?;
    let len = file.metadata().map_err(failed)?.len();
    let bounded = |what: &str, len: u64, most: u64| {
        let otherwise = |reason| ResumeError::Otherwise { path: path.to_path_buf(), reason };
        check_bytes(what, len, most).map_err(otherwise)
    };
    bounded("a snapshot", len, MAX_SNAPSHOT_BYTES)?;
    let mut head = [0; HEAD];
    file.read_exact(&mut head[..8])
        .map_err(|_| ResumeError::Foreign { path: path.to_path_buf() })?;
    if head[..8] != MAGIC {
        return Err(ResumeError::Foreign { path: path.to_path_buf() });
    }
    file.read_exact(&mut head[8..]).map_err(|_| damaged())?;
    let found = u32::from_le_bytes([head[8], head[9], head[10], head[11]]);
    if found != VERSION {
        return Err(ResumeError::Version { path: path.to_path_buf(), found, taken: VERSION });
    }
    let part_len = head[12..].iter().rev().fold(0, |len, byte| len << 8 | u64::from(*byte));
    let content_len = len.checked_sub((HEAD + TAIL) as u64).ok_or_else(damaged)?;
    let mapper_len = content_len.checked_sub(part_len).ok_or_else(damaged)?;
    // The part is held in memory; the mapper's goes to its slab.
    bounded("a snapshot's part about the run", part_len, MAX_SNAPSHOT_PART_BYTES)?;
    file.rewind().map_err(failed)?;
    let checksum = checksum_of(&file, HEAD as u64 + content_len).map_err(failed)?;
    let mut tail = [0; TAIL];
    file.read_exact(&mut tail).map_err(failed)?;
    if checksum != Some(u32::from_le_bytes(tail)) {
        return Err(damaged());
    }
    file.seek(SeekFrom::Start(HEAD as u64)).map_err(failed)?;
    Ok((BufReader::new(file), [part_len, mapper_len]))
}

/// The last checkpoint of an interrupted run.
pub struct Checkpoint {
    path: PathBuf,
    manifest: RunManifest,
    pub(super) blocks: Option<Position>,
    pub(super) state: RunState,
    /// The mapper's part of the file.
    rest: Take<BufReader<File>>,
}

impl Checkpoint {
    /// Reads the last checkpoint in a run's folder that is whole, but for the mapper's part. With
    /// it comes what is wrong with a later one.
    ///
    /// # Errors
    /// The last checkpoint is missing, of another version, or damaged, and so is the one before it.
    pub fn read(folder: &RunFolder) -> Result<(Self, Option<ResumeError>), ResumeError> {
        let last = Self::of_file(folder.snapshot());
        let error = match last {
            Ok(checkpoint) => return Ok((checkpoint, None)),
            Err(error) => error,
        };
        match Self::of_file(folder.file(PREVIOUS_SNAPSHOT_FILE)) {
            Ok(checkpoint) => Ok((checkpoint, Some(error))),
            Err(_) => Err(error),
        }
    }

    fn of_file(path: PathBuf) -> Result<Self, ResumeError> {
        let (mut file, [part_len, mapper_len]) = open(&path)?;
        let mut part = vec![0; part_len as usize];
        file.read_exact(&mut part)
            .map_err(|source| ResumeError::Read { path: path.clone(), source })?;
        let part: Part<RunManifest, RunState> =
            ciborium::from_reader(&part[..]).map_err(|error| ResumeError::Otherwise {
                path: path.clone(),
                reason: error.to_string(),
            })?;
        let Part { manifest, blocks, state } = part;
        Ok(Self { path, manifest, blocks, state, rest: file.take(mapper_len) })
    }

    /// Returns the manifest of the run.
    pub fn manifest(&self) -> &RunManifest {
        &self.manifest
    }

    /// Frames mapped.
    pub fn frames(&self) -> usize {
        self.state.frames.len()
    }

    /// Restores the mapper in `slab`.
    pub(super) fn mapper<'s>(
        &mut self,
        plan: &Plan,
        slab: &'s mut [u8],
    ) -> Result<Mapper<'s>, ResumeError> {
        let (path, rest) = (&self.path, &mut self.rest);
        let restored =
            Mapper::restore(&plan.capacity, &plan.config, slab, &mut |bytes: &mut [u8]| {
                rest.read_exact(bytes)
            });
        let otherwise = |reason: String| ResumeError::Otherwise { path: path.clone(), reason };
        let mapper = restored.map_err(|error| match error {
            RestoreError::Foreign | RestoreError::Damaged => {
                ResumeError::Damaged { path: path.clone() }
            }
            RestoreError::Source(source) if source.kind() == io::ErrorKind::UnexpectedEof => {
                ResumeError::Damaged { path: path.clone() }
            }
            RestoreError::Source(source) => ResumeError::Read { path: path.clone(), source },
            RestoreError::Version(found) => {
                otherwise(format!("its mapper snapshot has version {found}"))
            }
            RestoreError::Capacity => {
                otherwise(format!("profile {} has other capacities", plan.profile))
            }
            RestoreError::Config => otherwise("its mapper has other settings".to_owned()),
            RestoreError::New(error) => {
                otherwise(format!("the core refuses its settings: {error}"))
            }
            other => otherwise(other.to_string()),
        })?;
        match rest.read(&mut [0]) {
            Ok(0) => Ok(mapper),
            Ok(_) => Err(ResumeError::Damaged { path: path.clone() }),
            Err(source) => Err(ResumeError::Read { path: path.clone(), source }),
        }
    }
}
