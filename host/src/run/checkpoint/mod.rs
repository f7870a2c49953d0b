//! Checkpoints: every so many frames the state of a run is written into its folder, so that an interrupted run can be resumed.
//!
//! | bytes | what |
//! |---|---|
//! | 8 | `DVXDRIVE` |
//! | 4 | [`VERSION`], little-endian as all numbers here |
//! | 8 | length of the host's part |
//! | 4 | CRC-32 of the 20 bytes before and of the host's part |
//! | | the host's part, CBOR: manifest, end of the file of blocks, state |
//! | | the mapper's, to the end: [`dynvox_core::mapper::snapshot`] |
//!
//! Evicted blocks and rows are not copied: their files only ever grow, so the length and a checksum of each describe it.
//!
//! Memory: the host's part, while it is written or read. It grows with the tracks and objects seen, and with what is compared with ground truth.

mod error;
mod manifest;
#[cfg(test)]
mod tests;

pub use error::ResumeError;
pub use manifest::RunManifest;

use super::Plan;
use super::state::RunState;
use super::{FolderError, RunFolder, write_whole};
use crate::run::store::Position;
use dynvox_core::Mapper;
use dynvox_core::RestoreError;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::path::PathBuf;

const MAGIC: [u8; 8] = *b"DVXDRIVE";
/// Version of the layout and of the host's state. Another one is refused: there is no conversion.
const VERSION: u32 = 4;
/// Magic, version, length.
const HEAD: usize = 20;

/// When a run writes checkpoints.
#[derive(Clone, Debug)]
pub struct CheckpointPlan {
    /// Frames from one to the next.
    pub every: usize,
    /// How the run was started.
    pub manifest: RunManifest,
}

/// The host's part; borrowed to be written, owned when read.
#[derive(Serialize, Deserialize)]
struct Part<B, G> {
    manifest: B,
    blocks: Option<Position>,
    state: G,
}

/// Writes the checkpoint of a run into its folder, in place of the one before.
pub(super) fn write(
    folder: &RunFolder,
    manifest: &RunManifest,
    blocks: Option<Position>,
    state: &RunState,
    mapper: &mut Mapper<'_>,
) -> Result<(), FolderError> {
    write_whole(&folder.snapshot(), |file| {
        let mut part = Vec::new();
        ciborium::into_writer(&Part { manifest, blocks, state }, &mut part).map_err(io::Error::other)?;
        let head = head(part.len() as u64);
        file.write_all(&head)?;
        file.write_all(&checksum(&head, &part).to_le_bytes())?;
        file.write_all(&part)?;
        mapper.save(&mut |bytes: &[u8]| file.write_all(bytes))
    })
}

fn head(len: u64) -> [u8; HEAD] {
    let mut head = [0; HEAD];
    head[..8].copy_from_slice(&MAGIC);
    head[8..12].copy_from_slice(&VERSION.to_le_bytes());
    head[12..].copy_from_slice(&len.to_le_bytes());
    head
}

fn checksum(head: &[u8; HEAD], part: &[u8]) -> u32 {
    let mut crc = crc32fast::Hasher::new();
    crc.update(head);
    crc.update(part);
    crc.finalize()
}

/// The last checkpoint of an interrupted run.
pub struct Checkpoint {
    path: PathBuf,
    manifest: RunManifest,
    pub(super) blocks: Option<Position>,
    pub(super) state: RunState,
    /// The mapper's part of the file.
    rest: BufReader<File>,
}

impl Checkpoint {
    /// Reads the checkpoint in a run's folder, but for the mapper's part.
    ///
    /// # Errors
    /// The checkpoint is missing, of another version, or damaged.
    pub fn read(folder: &RunFolder) -> Result<Self, ResumeError> {
        let path = folder.snapshot();
        let failed = |source| ResumeError::Read { path: path.clone(), source };
        let file = File::open(&path).map_err(failed)?;
        let len = file.metadata().map_err(failed)?.len();
        let mut rest = BufReader::new(file);
        let damaged = || ResumeError::Damaged { path: path.clone() };
        let mut whole = |bytes: &mut [u8]| rest.read_exact(bytes).map_err(|_| damaged());
        let (mut head, mut sum) = ([0; HEAD], [0; 4]);
        whole(&mut head[..8]).map_err(|_| ResumeError::Foreign { path: path.clone() })?;
        if head[..8] != MAGIC {
            return Err(ResumeError::Foreign { path });
        }
        whole(&mut head[8..])?;
        let (version, part_len) = (u32::from_le_bytes([head[8], head[9], head[10], head[11]]), &head[12..]);
        if version != VERSION {
            return Err(ResumeError::Version { path, found: version, taken: VERSION });
        }
        let part_len = part_len.iter().rev().fold(0, |len, byte| len << 8 | u64::from(*byte));
        if part_len > len {
            return Err(damaged());
        }
        whole(&mut sum)?;
        let mut part = vec![0; part_len as usize];
        whole(&mut part)?;
        if checksum(&head, &part) != u32::from_le_bytes(sum) {
            return Err(damaged());
        }
        let part: Part<RunManifest, RunState> =
            ciborium::from_reader(&part[..]).map_err(|error| ResumeError::Otherwise { path: path.clone(), reason: error.to_string() })?;
        let Part { manifest, blocks, state } = part;
        Ok(Self { path, manifest, blocks, state, rest })
    }

    /// How the run was started.
    pub fn manifest(&self) -> &RunManifest {
        &self.manifest
    }

    /// Frames mapped.
    pub fn frames(&self) -> usize {
        self.state.frames.len()
    }

    /// Restores the mapper in `slab`.
    pub(super) fn mapper<'s>(&mut self, plan: &Plan, slab: &'s mut [u8]) -> Result<Mapper<'s>, ResumeError> {
        let (path, rest) = (&self.path, &mut self.rest);
        let restored = Mapper::restore(&plan.capacity, &plan.config, slab, &mut |bytes: &mut [u8]| rest.read_exact(bytes));
        let otherwise = |reason: String| ResumeError::Otherwise { path: path.clone(), reason };
        let mapper = restored.map_err(|error| match error {
            RestoreError::Foreign | RestoreError::Damaged => ResumeError::Damaged { path: path.clone() },
            RestoreError::Source(source) if source.kind() == io::ErrorKind::UnexpectedEof => ResumeError::Damaged { path: path.clone() },
            RestoreError::Source(source) => ResumeError::Read { path: path.clone(), source },
            RestoreError::Version(found) => otherwise(format!("its mapper snapshot has version {found}")),
            RestoreError::Capacity => otherwise(format!("profile {} has other capacities", plan.profile)),
            RestoreError::Config => otherwise("its mapper has other settings".to_owned()),
            RestoreError::New(error) => otherwise(format!("the core refuses its settings: {error}")),
            other => otherwise(other.to_string()),
        })?;
        match rest.read(&mut [0]) {
            Ok(0) => Ok(mapper),
            Ok(_) => Err(ResumeError::Damaged { path: path.clone() }),
            Err(source) => Err(ResumeError::Read { path: path.clone(), source }),
        }
    }
}
