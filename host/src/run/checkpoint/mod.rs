//! A run that can be stopped and goes on: every so many frames all it holds is written into its folder, in the place of what was written before.
//!
//! | bytes | what |
//! |---|---|
//! | 8 | `DVXDRIVE` |
//! | 4 | [`VERSION`], little-endian as all numbers here |
//! | 8 | length of the host's part |
//! | 4 | CRC-32 of the 20 bytes before and of the host's part |
//! | | the host's part, CBOR: how the run was begun, how far the file of blocks had come, what was gathered |
//! | | the mapper's, to the end: [`dynvox_core::mapper::snapshot`] |
//!
//! The blocks that left the pool are not copied: their file only ever grows, so its length and a checksum say what it held.
//!
//! Memory: the host's part, some 4 KiB a frame, while it is written or read.

mod begun;
mod error;
#[cfg(test)]
mod tests;

pub use begun::Begun;
pub use error::ResumeError;

use super::Plan;
use super::state::Gathered;
use super::{FolderError, RunFolder, write_whole};
use crate::run::store::Position;
use dynvox_core::Mapper;
use dynvox_core::RestoreError;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::path::PathBuf;

const MAGIC: [u8; 8] = *b"DVXDRIVE";
/// Version of the layout, and of what the host gathers. Another one is refused: there is no conversion.
const VERSION: u32 = 1;
/// Magic, version, length.
const HEAD: usize = 20;

/// When a run writes snapshots.
#[derive(Clone, Debug)]
pub struct Snapshots {
    /// Frames from one to the next.
    pub every: usize,
    /// How the run was begun.
    pub begun: Begun,
}

/// The host's part; borrowed to be written, owned when read.
#[derive(Serialize, Deserialize)]
struct Part<B, G> {
    begun: B,
    blocks: Option<Position>,
    gathered: G,
}

/// Writes the snapshot of a run into its folder.
pub(super) fn write(
    folder: &RunFolder,
    begun: &Begun,
    blocks: Option<Position>,
    gathered: &Gathered,
    mapper: &mut Mapper<'_>,
) -> Result<(), FolderError> {
    write_whole(&folder.snapshot(), |file| {
        let mut part = Vec::new();
        ciborium::into_writer(&Part { begun, blocks, gathered }, &mut part).map_err(io::Error::other)?;
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

/// A run that was stopped, as its last snapshot tells it.
pub struct Stopped {
    path: PathBuf,
    begun: Begun,
    pub(super) blocks: Option<Position>,
    pub(super) gathered: Gathered,
    /// What of the file is the mapper's.
    rest: BufReader<File>,
}

impl Stopped {
    /// Reads the snapshot in a run's folder, but for the mapper's part.
    ///
    /// # Errors
    /// It is none, of another version, or damaged.
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
        let part: Part<Begun, Gathered> =
            ciborium::from_reader(&part[..]).map_err(|error| ResumeError::Otherwise { path: path.clone(), reason: error.to_string() })?;
        let Part { begun, blocks, gathered } = part;
        Ok(Self { path, begun, blocks, gathered, rest })
    }

    /// How the run was begun.
    pub fn begun(&self) -> &Begun {
        &self.begun
    }

    /// Frames mapped.
    pub fn frames(&self) -> usize {
        self.gathered.rows.len()
    }

    /// Brings a mapper in `slab` to where it was.
    pub(super) fn mapper<'s>(&mut self, plan: &Plan, slab: &'s mut [u8]) -> Result<Mapper<'s>, ResumeError> {
        let (path, rest) = (&self.path, &mut self.rest);
        let restored = Mapper::restore(&plan.capacity, &plan.config, slab, &mut |bytes: &mut [u8]| rest.read_exact(bytes));
        let otherwise = |reason: String| ResumeError::Otherwise { path: path.clone(), reason };
        let mapper = restored.map_err(|error| match error {
            RestoreError::Foreign | RestoreError::Damaged => ResumeError::Damaged { path: path.clone() },
            RestoreError::Source(source) if source.kind() == io::ErrorKind::UnexpectedEof => ResumeError::Damaged { path: path.clone() },
            RestoreError::Source(source) => ResumeError::Read { path: path.clone(), source },
            RestoreError::Version(found) => otherwise(format!("its mapper is of version {found}")),
            RestoreError::Capacity => otherwise(format!("profile {} had other bounds", plan.profile)),
            RestoreError::Config => otherwise("its mapper knew other settings".to_owned()),
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
