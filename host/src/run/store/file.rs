//! An append-only file of blocks.
//!
//! A block stored again gets a new record; the newest counts, the older ones stay: a camera that
//! goes to and fro writes a record for each eviction. The file of a crashed run is scanned once:
//! every complete record is taken, the rest is truncated and reported. A write that fails (a full
//! disk) ends the storing, not the run.
//!
//! Memory: that of [`super::block_index`], two buffers of a record and a window of [`WINDOW`]
//! bytes.

use super::block_index::{BlockIndexOnDisk, Tile, tile_of};
use super::record::{self, HEADER, Header, LONGEST};
use crate::owned;
use dynvox_core::volume::{BlockKey, BlockStore, EvictedBlock, LoadedBlock};
use hashbrown::HashMap;
use serde::{Deserialize, Serialize};
use std::{
    fs::{File, OpenOptions},
    io::{self, BufReader, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// First bytes of a store, without its version, which is a digit.
const NAME: &[u8; 7] = b"dynvoxB";
/// First bytes of a store; the last digit is the version.
const MAGIC: [u8; 8] = *b"dynvoxB3";
/// Magic, then voxel size and truncation (`f32`, little endian).
const PREAMBLE: usize = 16;
/// Bytes read at once while following a tile's records backwards.
const WINDOW: usize = 1 << 16;
/// Reason why storing ends at the limit that was asked for.
const LIMIT_REACHED: &str = "it has reached its size limit";

/// Reason why a store cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file system refuses.
    #[error("{path}: {source}")]
    Io {
        /// The store.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file is not a store.
    #[error("{path} is not a block store; name another file, or remove it")]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// The file is a store of another version.
    #[error(
        "{path} is a block store of version {found}, this release reads version {reads}. Map the \
         recording again, or go on with the release that wrote the file"
    )]
    OtherVersion {
        /// The file.
        path: PathBuf,
        /// Version of the file.
        found: char,
        /// Version that can be read.
        reads: char,
    },
    /// It existed at the checkpoint.
    #[error(
        "{path} is missing: it has the evicted blocks of the run. Restore it, or start the run \
         again with --overwrite"
    )]
    Missing {
        /// The store.
        path: PathBuf,
    },
    /// It was changed after the checkpoint.
    #[error(
        "{path} is not as the run left it: its first {bytes} bytes are truncated or changed. Start \
         the run again with --overwrite"
    )]
    Changed {
        /// The store.
        path: PathBuf,
        /// Length of the file at the checkpoint, bytes.
        bytes: u64,
    },
    /// The store was written with other voxels.
    #[error(
        "{path} holds blocks of {found_voxel_m} m voxels with {found_truncation_m} m truncation, not {voxel_m} m with {truncation_m} m; \
         run with those settings, or name another file"
    )]
    OtherVoxels {
        /// The store.
        path: PathBuf,
        /// Voxel size in the file, m.
        found_voxel_m: f32,
        /// Truncation in the file, m.
        found_truncation_m: f32,
        /// The run's voxel size, m.
        voxel_m: f32,
        /// The run's truncation, m.
        truncation_m: f32,
    },
}

/// An opened store's content.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Opened {
    /// Records in it, superseded ones included.
    pub records: u64,
    /// Bytes of an incomplete or damaged tail that were truncated.
    pub cut_bytes: u64,
}

/// The end of a store at a checkpoint. Records are only ever appended, so everything before it
/// stays as it was.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Position {
    /// Bytes of the file.
    pub bytes: u64,
    records: u64,
    /// CRC-32 of all records.
    checksum: u32,
    unreadable: u64,
    /// Reason why storing had ended, if it had.
    failure: Option<String>,
}

/// A store over a file, or over anything that reads, writes and seeks.
#[derive(Debug)]
pub struct BlockFile<F> {
    file: F,
    index: BlockIndexOnDisk,
    records: u64,
    end: u64,
    /// Checksum of all records.
    checksum: crc32fast::Hasher,
    /// Bytes the file may grow to.
    most: u64,
    /// Error that ended storing.
    failure: Option<io::Error>,
    /// Records that cannot be read back.
    unreadable: u64,
    record: Vec<u8>,
    scratch: Vec<u8>,
}

impl BlockFile<File> {
    /// Opens the store at `path`, or makes one, for maps of that voxel size and truncation.
    pub fn open(
        path: &Path,
        voxel_m: f32,
        truncation_m: f32,
    ) -> Result<(Self, Opened), StoreError> {
        let at = |source| StoreError::Io { path: path.to_owned(), source };
        let file = match path.symlink_metadata() {
            Ok(found) if found.is_file() => OpenOptions::new().read(true).write(true).open(path),
            // A link is refused: its target belongs to someone else.
            _ => owned::create_file(path),
        };
        let file = file.map_err(at)?;
        let len = file.metadata().map_err(at)?.len();
        let mut store = Self::over(file);
        if len < PREAMBLE as u64 {
            // New, or incomplete within its first bytes: it has no record.
            let head = store.head(len.min(8)).map_err(at)?;
            if !MAGIC.starts_with(&head) {
                return Err(not_of_this_version(path, &head));
            }
            store.file.set_len(0).map_err(at)?;
            let preamble = preamble(voxel_m, truncation_m);
            store
                .file
                .seek(SeekFrom::Start(0))
                .and_then(|_| store.file.write_all(&preamble))
                .map_err(at)?;
            return Ok((store, Opened { records: 0, cut_bytes: len }));
        }
        store.require(path, voxel_m, truncation_m)?;
        store.scan(u64::MAX).map_err(at)?;
        store.file.set_len(store.end).map_err(at)?;
        let opened = Opened { records: store.records, cut_bytes: len - store.end };
        Ok((store, opened))
    }

    /// Opens the store of a resumed run, as it was at `position`; records stored since are
    /// truncated.
    pub fn reopen(
        path: &Path,
        voxel_m: f32,
        truncation_m: f32,
        position: &Position,
    ) -> Result<Self, StoreError> {
        let at = |source| StoreError::Io { path: path.to_owned(), source };
        let file =
            OpenOptions::new().read(true).write(true).open(path).map_err(|source| match source
                .kind()
            {
                io::ErrorKind::NotFound => StoreError::Missing { path: path.to_owned() },
                _ => at(source),
            })?;
        let mut store = Self::over(file);
        let parted = || StoreError::Changed { path: path.to_owned(), bytes: position.bytes };
        if store.file.metadata().map_err(at)?.len() < PREAMBLE as u64 {
            return Err(parted());
        }
        store.require(path, voxel_m, truncation_m)?;
        store.scan(position.bytes).map_err(at)?;
        let checksum = store.checksum.clone().finalize();
        if (store.end, store.records, checksum)
            != (position.bytes, position.records, position.checksum)
        {
            return Err(parted());
        }
        store.file.set_len(store.end).map_err(at)?;
        store.unreadable = position.unreadable;
        store.failure = position.failure.clone().map(io::Error::other);
        Ok(store)
    }

    /// Syncs the file to the disk and returns its end.
    pub fn position(&self) -> io::Result<Position> {
        self.file.sync_data()?;
        Ok(Position {
            bytes: self.end,
            records: self.records,
            checksum: self.checksum.clone().finalize(),
            unreadable: self.unreadable,
            failure: self.failure.as_ref().map(ToString::to_string),
        })
    }

    /// Refuses a file that is not a store, or one of other voxels.
    fn require(&mut self, path: &Path, voxel_m: f32, truncation_m: f32) -> Result<(), StoreError> {
        let found = self
            .head(PREAMBLE as u64)
            .map_err(|source| StoreError::Io { path: path.to_owned(), source })?;
        if found[..8] != MAGIC {
            return Err(not_of_this_version(path, &found));
        }
        if found != preamble(voxel_m, truncation_m) {
            let float = |at: usize| {
                f32::from_le_bytes([found[at], found[at + 1], found[at + 2], found[at + 3]])
            };
            return Err(StoreError::OtherVoxels {
                path: path.to_owned(),
                found_voxel_m: float(8),
                found_truncation_m: float(12),
                voxel_m,
                truncation_m,
            });
        }
        Ok(())
    }
}

/// Refusal of a file that begins otherwise than a store of this version.
fn not_of_this_version(path: &Path, head: &[u8]) -> StoreError {
    let path = path.to_owned();
    match head.strip_prefix(NAME).and_then(<[u8]>::first) {
        Some(version @ b'0'..=b'9') => StoreError::OtherVersion {
            path,
            found: char::from(*version),
            reads: char::from(MAGIC[7]),
        },
        _ => StoreError::Foreign { path },
    }
}

fn preamble(voxel_m: f32, truncation_m: f32) -> [u8; PREAMBLE] {
    let mut preamble = [0; PREAMBLE];
    preamble[..8].copy_from_slice(&MAGIC);
    preamble[8..12].copy_from_slice(&voxel_m.to_le_bytes());
    preamble[12..].copy_from_slice(&truncation_m.to_le_bytes());
    preamble
}

impl<F: Read + Write + Seek> BlockFile<F> {
    /// An empty store that appends after the preamble.
    pub(super) fn over(file: F) -> Self {
        let (record, scratch) = (Vec::with_capacity(HEADER + LONGEST), Vec::with_capacity(LONGEST));
        Self {
            file,
            index: BlockIndexOnDisk::default(),
            records: 0,
            end: PREAMBLE as u64,
            checksum: crc32fast::Hasher::new(),
            most: u64::MAX,
            failure: None,
            unreadable: 0,
            record,
            scratch,
        }
    }

    /// Lets the file grow to `most` bytes and no further, as if the disk were full then.
    pub fn limit(&mut self, most: u64) {
        self.most = most;
    }

    /// Returns the file or memory that the store writes to.
    #[cfg(test)]
    pub(super) fn into_inner(self) -> F {
        self.file
    }

    /// Bytes that the file may still grow by; 0 once storing has ended.
    pub(super) fn free_bytes(&self) -> u64 {
        if self.failure.is_some() { 0 } else { self.most.saturating_sub(self.end) }
    }

    /// Records in the store, superseded ones included.
    pub fn records(&self) -> u64 {
        self.records
    }

    /// Bytes of the file, superseded records included.
    pub fn bytes(&self) -> u64 {
        self.end
    }

    /// Returns the error that ended storing, if one did.
    pub fn failure(&self) -> Option<&io::Error> {
        self.failure.as_ref()
    }

    /// Returns true if the disk refused, rather than the limit that was asked for.
    pub fn disk_failed(&self) -> bool {
        self.failure.as_ref().is_some_and(|error| error.to_string() != LIMIT_REACHED)
    }

    /// Blocks that were stored and could not be read back.
    pub fn unreadable(&self) -> u64 {
        self.unreadable
    }

    /// Returns true if a block is stored.
    pub fn holds(&mut self, key: BlockKey) -> bool {
        self.newest_record(key).is_some()
    }

    /// The tiles in which blocks are stored, ascending: segment by segment.
    pub fn tiles(&self) -> Vec<Tile> {
        self.index.tiles()
    }

    /// The blocks stored in a tile, ascending.
    pub fn blocks_of(&mut self, tile: Tile) -> Vec<BlockKey> {
        self.load_index(tile);
        let mut keys: Vec<_> =
            self.index.records(tile).into_iter().flatten().map(|(key, _)| *key).collect();
        keys.sort_unstable();
        keys
    }

    /// Returns the offset of a block's newest record.
    fn newest_record(&mut self, key: BlockKey) -> Option<u64> {
        let tile = tile_of(key);
        self.load_index(tile);
        self.index.records(tile)?.get(&key).copied()
    }

    /// Reads the positions of a tile's records, unless they are known or the tile has no records.
    fn load_index(&mut self, tile: Tile) {
        let Some(newest) = self.index.newest(tile) else { return };
        if self.index.records(tile).is_some() {
            return;
        }
        let mut records = HashMap::new();
        // Records before one that cannot be read are unreachable.
        self.unreadable += u64::from(self.walk(tile, newest, &mut records).is_err());
        self.index.open(tile, records);
    }

    /// Follows a tile's records from the newest back.
    fn walk(
        &mut self,
        tile: Tile,
        newest: u64,
        records: &mut HashMap<BlockKey, u64>,
    ) -> io::Result<()> {
        let (mut window, mut first) = (Vec::new(), 0);
        let mut at = newest;
        while at != 0 {
            let end = at + HEADER as u64;
            if at < first || end > first + window.len() as u64 {
                first = end.saturating_sub(WINDOW as u64);
                window.resize((end - first) as usize, 0);
                self.file.seek(SeekFrom::Start(first))?;
                self.file.read_exact(&mut window)?;
            }
            let header = window
                .get((at - first) as usize..)
                .and_then(|bytes| bytes.first_chunk())
                .and_then(Header::read);
            // Each record lies before the one that names it, so the walk ends.
            let header =
                header.filter(|header| tile_of(header.key) == tile && header.previous < at);
            let header = header.ok_or(io::ErrorKind::InvalidData)?;
            records.entry(header.key).or_insert(at);
            at = header.previous;
        }
        Ok(())
    }

    /// The first `len` bytes.
    fn head(&mut self, len: u64) -> io::Result<Vec<u8>> {
        let mut bytes = vec![0; len as usize];
        self.file.seek(SeekFrom::Start(0))?;
        self.file.read_exact(&mut bytes)?;
        Ok(bytes)
    }

    /// Indexes every whole record that begins before `until`; `end` is after the last one.
    fn scan(&mut self, until: u64) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(PREAMBLE as u64))?;
        let mut reader = BufReader::with_capacity(1 << 20, &mut self.file);
        let (mut header, mut payload) = ([0; HEADER], Vec::with_capacity(LONGEST));
        while self.end < until {
            match reader.read_exact(&mut header) {
                Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(()),
                read => read?,
            }
            let Some(read) = Header::read(&header) else { return Ok(()) };
            payload.clear();
            reader.by_ref().take(read.len as u64).read_to_end(&mut payload)?;
            if payload.len() < read.len || !read.fits(&header, &payload) {
                return Ok(());
            }
            self.index.enter(read.key, self.end);
            self.checksum.update(&header);
            self.checksum.update(&payload);
            self.records += 1;
            self.end += (HEADER + read.len) as u64;
        }
        Ok(())
    }

    /// The payload of the record at `at`, into `record`.
    fn fetch(&mut self, key: BlockKey, at: u64) -> io::Result<bool> {
        let mut header = [0; HEADER];
        self.file.seek(SeekFrom::Start(at))?;
        self.file.read_exact(&mut header)?;
        let Some(read) = Header::read(&header).filter(|read| read.key == key) else {
            return Ok(false);
        };
        self.record.resize(read.len, 0);
        self.file.read_exact(&mut self.record)?;
        Ok(read.fits(&header, &self.record))
    }

    fn append(&mut self) -> io::Result<()> {
        if self.end + self.record.len() as u64 > self.most {
            return Err(io::Error::other(LIMIT_REACHED));
        }
        self.file.seek(SeekFrom::Start(self.end))?;
        self.file.write_all(&self.record)
    }
}

impl<F: Read + Write + Seek> BlockStore for BlockFile<F> {
    fn store(&mut self, block: EvictedBlock<'_>) -> bool {
        if self.failure.is_some() {
            return false;
        }
        let previous = self.index.newest(tile_of(block.key)).unwrap_or(0);
        record::write(&block, previous, &mut self.scratch, &mut self.record);
        match self.append() {
            Ok(()) => {
                self.index.enter(block.key, self.end);
                self.checksum.update(&self.record);
                self.records += 1;
                self.end += self.record.len() as u64;
                true
            }
            Err(error) => {
                self.failure = Some(error);
                false
            }
        }
    }

    fn load(&mut self, block: LoadedBlock<'_>) -> bool {
        // The record stays: should the run end before the block is evicted again, it is still
        // stored.
        let Some(at) = self.newest_record(block.key) else { return false };
        let came = self.fetch(block.key, at).unwrap_or(false)
            && record::read(&self.record, block, &mut self.scratch);
        self.unreadable += u64::from(!came);
        came
    }
}
