//! An append-only file of blocks with an index in memory.
//!
//! A block kept again gets a new record; the newest counts. A file left behind by a crash is read through once: every whole record is
//! taken, and what follows the last whole one is cut off and reported. A write that fails (a full disk) ends the keeping, not the run.
//!
//! Memory: 24 bytes or so per block kept, for the index, and two buffers of a record.

use super::record::{self, HEADER, Header, LONGEST};
use dynvox_core::volume::{BlockCoord, BlockStore, LeavingBlock, ReturningBlock};
use hashbrown::HashMap;
use std::{
    fs::{File, OpenOptions},
    io::{self, BufReader, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// First bytes of a store; the last digit is the version.
const MAGIC: [u8; 8] = *b"dynvoxB1";
/// Magic, then voxel size and truncation (`f32`, little endian).
const PREAMBLE: usize = 16;

/// Why a store cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file system said no.
    #[error("{path}: {source}")]
    Io {
        /// The store.
        path: PathBuf,
        /// What it said.
        source: io::Error,
    },
    /// Something else is at that path.
    #[error("{path} is not a block store; name another file, or remove it")]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// The store was written with other voxels.
    #[error(
        "{path} holds blocks of {found_voxel_m} m voxels with {found_truncation_m} m truncation, not {voxel_m} m with {truncation_m} m; \
         run with those settings, or name another file"
    )]
    Otherwise {
        /// The store.
        path: PathBuf,
        /// Its voxel size, m.
        found_voxel_m: f32,
        /// Its truncation, m.
        found_truncation_m: f32,
        /// The run's voxel size, m.
        voxel_m: f32,
        /// The run's truncation, m.
        truncation_m: f32,
    },
}

/// What was found in a store.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Opened {
    /// Blocks in it.
    pub blocks: usize,
    /// Bytes of a torn or damaged tail that were cut off.
    pub cut_bytes: u64,
}

/// A store over a file, or over anything that reads, writes and seeks.
#[derive(Debug)]
pub struct BlockFile<F> {
    file: F,
    /// Where the record of each block begins.
    index: HashMap<BlockCoord, u64>,
    end: u64,
    /// Why keeping ended.
    failure: Option<io::Error>,
    /// Records that were kept and cannot be read back.
    unreadable: u64,
    record: Vec<u8>,
    scratch: Vec<u8>,
}

impl BlockFile<File> {
    /// Opens the store at `path`, or makes one, for maps of that voxel size and truncation.
    pub fn open(path: &Path, voxel_m: f32, truncation_m: f32) -> Result<(Self, Opened), StoreError> {
        let at = |source| StoreError::Io { path: path.to_owned(), source };
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).map_err(at)?;
        let len = file.metadata().map_err(at)?.len();
        let mut preamble = [0; PREAMBLE];
        preamble[..8].copy_from_slice(&MAGIC);
        preamble[8..12].copy_from_slice(&voxel_m.to_le_bytes());
        preamble[12..].copy_from_slice(&truncation_m.to_le_bytes());
        let mut store = Self::over(file);
        if len < PREAMBLE as u64 {
            // New, or torn within its first bytes: nothing can have been kept in it.
            if !MAGIC.starts_with(&store.head(len.min(8)).map_err(at)?) {
                return Err(StoreError::Foreign { path: path.to_owned() });
            }
            store.file.set_len(0).map_err(at)?;
            store.file.seek(SeekFrom::Start(0)).and_then(|_| store.file.write_all(&preamble)).map_err(at)?;
            return Ok((store, Opened { blocks: 0, cut_bytes: len }));
        }
        let found = store.head(PREAMBLE as u64).map_err(at)?;
        if found[..8] != MAGIC {
            return Err(StoreError::Foreign { path: path.to_owned() });
        }
        if found != preamble {
            let float = |at: usize| f32::from_le_bytes([found[at], found[at + 1], found[at + 2], found[at + 3]]);
            return Err(StoreError::Otherwise {
                path: path.to_owned(),
                found_voxel_m: float(8),
                found_truncation_m: float(12),
                voxel_m,
                truncation_m,
            });
        }
        store.scan().map_err(at)?;
        store.file.set_len(store.end).map_err(at)?;
        let opened = Opened { blocks: store.index.len(), cut_bytes: len - store.end };
        Ok((store, opened))
    }
}

impl<F: Read + Write + Seek> BlockFile<F> {
    /// An empty store that appends behind the preamble.
    pub(super) fn over(file: F) -> Self {
        let (record, scratch) = (Vec::with_capacity(HEADER + LONGEST), Vec::with_capacity(LONGEST));
        Self {
            file,
            index: HashMap::new(),
            end: PREAMBLE as u64,
            failure: None,
            unreadable: 0,
            record,
            scratch,
        }
    }

    /// Blocks in the store.
    pub fn len(&self) -> usize {
        self.index.len()
    }

    /// Whether nothing is kept.
    pub fn is_empty(&self) -> bool {
        self.index.is_empty()
    }

    /// Bytes of the file, superseded records included.
    pub fn bytes(&self) -> u64 {
        self.end
    }

    /// Why keeping ended, if it did.
    pub fn failure(&self) -> Option<&io::Error> {
        self.failure.as_ref()
    }

    /// Blocks that were kept and could not be read back.
    pub fn unreadable(&self) -> u64 {
        self.unreadable
    }

    /// Whether a block is kept.
    pub fn holds(&self, coord: BlockCoord) -> bool {
        self.index.contains_key(&coord)
    }

    /// The places of all blocks kept, ascending.
    pub fn coords(&self) -> Vec<BlockCoord> {
        let mut coords: Vec<_> = self.index.keys().copied().collect();
        coords.sort_unstable();
        coords
    }

    /// The first `len` bytes.
    fn head(&mut self, len: u64) -> io::Result<Vec<u8>> {
        let mut bytes = vec![0; len as usize];
        self.file.seek(SeekFrom::Start(0))?;
        self.file.read_exact(&mut bytes)?;
        Ok(bytes)
    }

    /// Indexes every whole record; `end` is behind the last one.
    fn scan(&mut self) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(PREAMBLE as u64))?;
        let mut reader = BufReader::with_capacity(1 << 20, &mut self.file);
        let (mut header, mut payload) = ([0; HEADER], Vec::with_capacity(LONGEST));
        loop {
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
            self.index.insert(read.coord, self.end);
            self.end += (HEADER + read.len) as u64;
        }
    }

    /// The payload of the record at `at`, into `record`.
    fn fetch(&mut self, coord: BlockCoord, at: u64) -> io::Result<bool> {
        let mut header = [0; HEADER];
        self.file.seek(SeekFrom::Start(at))?;
        self.file.read_exact(&mut header)?;
        let Some(read) = Header::read(&header).filter(|read| read.coord == coord) else { return Ok(false) };
        self.record.resize(read.len, 0);
        self.file.read_exact(&mut self.record)?;
        Ok(read.fits(&header, &self.record))
    }

    fn append(&mut self) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(self.end))?;
        self.file.write_all(&self.record)
    }
}

impl<F: Read + Write + Seek> BlockStore for BlockFile<F> {
    fn keep(&mut self, block: LeavingBlock<'_>) -> bool {
        if self.failure.is_some() {
            return false;
        }
        record::write(&block, &mut self.scratch, &mut self.record);
        match self.append() {
            Ok(()) => {
                self.index.insert(block.coord, self.end);
                self.end += self.record.len() as u64;
                true
            }
            Err(error) => {
                self.failure = Some(error);
                false
            }
        }
    }

    fn bring_back(&mut self, block: ReturningBlock<'_>) -> bool {
        // The record stays: should the run end before the block leaves again, what was kept is still there.
        let Some(at) = self.index.get(&block.coord).copied() else { return false };
        let came = self.fetch(block.coord, at).unwrap_or(false) && record::read(&self.record, block, &mut self.scratch);
        self.unreadable += u64::from(!came);
        came
    }
}
