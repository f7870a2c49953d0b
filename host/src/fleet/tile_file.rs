//! One tile of the world as a file: the sums of its blocks, by ascending coordinates.
//!
//! | bytes | what |
//! |---|---|
//! | 8 | `dynvoxA1` |
//! | 4, 4 | voxel size and truncation, m, `f32`; little-endian as all numbers here |
//! | 4 | 1 with colour, 0 without |
//! | 4 | number of blocks |
//! | 4 | CRC-32 of the bytes before |
//! | | the blocks, one after the other |
//!
//! A block:
//!
//! | bytes | what |
//! |---|---|
//! | 2, 2, 2, 2 | coordinates x, y, z (`i16`), and 0 |
//! | 4 | length of its sums, `u32` |
//! | 4 | CRC-32 of these 12 bytes and the sums |
//! | | the sums as LZ4 |

use super::FleetError;
use super::block_sums::BlockSums;
use crate::run::write_whole;
use dynvox_core::volume::BlockCoord;
use std::fmt;
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Version of the format: the last figure of what a tile begins with.
pub const VERSION: u32 = (MAGIC[7] - b'0') as u32;
const MAGIC: [u8; 8] = *b"dynvoxA1";
const HEAD: usize = 28;
/// Bytes of it that its checksum covers.
const HEAD_CHECKED: usize = 24;
const BLOCK_HEAD: usize = 16;

/// Properties that maps must share to be added.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Side of a voxel, m.
    pub voxel_size_m: f32,
    /// Truncation, m.
    pub truncation_m: f32,
    /// True if voxels have colour.
    pub colour: bool,
}

impl fmt::Display for Lattice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { voxel_size_m, truncation_m, colour } = self;
        write!(
            f,
            "voxels of {voxel_size_m} m with {truncation_m} m truncation and {}",
            if *colour { "colour" } else { "no colour" }
        )
    }
}

/// Writes the sums of ascending blocks; empty ones are left out. Returns how many blocks there are.
/// Nothing half-written stays behind.
///
/// # Errors
/// The disk refuses, or the source of the blocks fails.
pub fn write(
    path: &Path,
    lattice: &Lattice,
    mut next: impl FnMut() -> Result<Option<(BlockCoord, BlockSums)>, FleetError>,
) -> Result<u32, FleetError> {
    let (mut count, mut failed) = (0, None);
    let written = write_whole(path, |file| {
        // The number of blocks is known only at the end: the head is written again then.
        file.write_all(&head(lattice, 0))?;
        let mut record = Record::default();
        loop {
            match next() {
                Ok(None) => break,
                Ok(Some((_, sums))) if sums.is_empty() => {}
                Ok(Some((coord, sums))) => {
                    record.write(file, coord, &sums)?;
                    count += 1;
                }
                Err(error) => {
                    failed = Some(error);
                    return Err(std::io::ErrorKind::Other.into());
                }
            }
        }
        file.seek(SeekFrom::Start(0))?;
        file.write_all(&head(lattice, count))
    });
    // An error of the source is the reason, not the interrupted writing.
    match (failed, written) {
        (Some(error), _) => Err(error),
        (None, Ok(())) => Ok(count),
        (None, Err(error)) => Err(FleetError::content(path, error.to_string())),
    }
}

fn head(lattice: &Lattice, count: u32) -> [u8; HEAD] {
    let mut head = [0; HEAD];
    head[..8].copy_from_slice(&MAGIC);
    head[8..12].copy_from_slice(&lattice.voxel_size_m.to_le_bytes());
    head[12..16].copy_from_slice(&lattice.truncation_m.to_le_bytes());
    head[16..20].copy_from_slice(&u32::from(lattice.colour).to_le_bytes());
    head[20..HEAD_CHECKED].copy_from_slice(&count.to_le_bytes());
    // The head has a sum of its own, so that the count can be trusted before blocks are read.
    let sum = crc32fast::hash(&head[..HEAD_CHECKED]);
    head[HEAD_CHECKED..].copy_from_slice(&sum.to_le_bytes());
    head
}

/// Buffers of one record.
#[derive(Default)]
struct Record {
    plain: Vec<u8>,
    packed: Vec<u8>,
}

impl Record {
    fn write(
        &mut self,
        file: &mut BufWriter<File>,
        coord: BlockCoord,
        sums: &BlockSums,
    ) -> std::io::Result<()> {
        sums.write(&mut self.plain);
        // The checksum covers coordinates, length and data.
        self.packed.resize(lz4_flex::block::get_maximum_output_size(self.plain.len()), 0);
        let len = lz4_flex::block::compress_into(&self.plain, &mut self.packed)
            .map_err(std::io::Error::other)?;
        let packed = &self.packed[..len];
        let mut head = [0; BLOCK_HEAD];
        for (at, value) in [coord.x, coord.y, coord.z].into_iter().enumerate() {
            head[2 * at..][..2].copy_from_slice(&value.to_le_bytes());
        }
        head[8..12].copy_from_slice(&(len as u32).to_le_bytes());
        let sum = checksum(&head, packed);
        head[12..].copy_from_slice(&sum.to_le_bytes());
        file.write_all(&head)?;
        file.write_all(packed)
    }
}

fn checksum(head: &[u8; BLOCK_HEAD], packed: &[u8]) -> u32 {
    let mut crc = crc32fast::Hasher::new();
    crc.update(&head[..12]);
    crc.update(packed);
    crc.finalize()
}

/// A tile that is read block by block.
pub struct TileReader {
    path: PathBuf,
    file: BufReader<File>,
    lattice: Lattice,
    left: u32,
    last: Option<BlockCoord>,
}

impl TileReader {
    /// Opens a tile.
    ///
    /// # Errors
    /// The file cannot be read, or is no tile.
    pub fn open(path: &Path) -> Result<Self, FleetError> {
        let mut file = BufReader::new(File::open(path).map_err(FleetError::io(path))?);
        let mut head = [0; HEAD];
        // Head and version are checked before any number is believed.
        let is_whole = file.read_exact(&mut head).is_ok()
            && head[HEAD_CHECKED..] == crc32fast::hash(&head[..HEAD_CHECKED]).to_le_bytes();
        if !is_whole || head[..8] != MAGIC {
            return Err(FleetError::content(
                path,
                "is not a tile of this version. Remove the folder and make it again",
            ));
        }
        let word = |at: usize| [head[at], head[at + 1], head[at + 2], head[at + 3]];
        let lattice = Lattice {
            voxel_size_m: f32::from_le_bytes(word(8)),
            truncation_m: f32::from_le_bytes(word(12)),
            colour: u32::from_le_bytes(word(16)) == 1,
        };
        Ok(Self {
            path: path.to_path_buf(),
            file,
            lattice,
            left: u32::from_le_bytes(word(20)),
            last: None,
        })
    }

    /// Returns the lattice of the tile.
    pub fn lattice(&self) -> Lattice {
        self.lattice
    }

    /// The next block, if there is one.
    ///
    /// # Errors
    /// A byte of it has changed, or the file ends early.
    pub fn next(&mut self) -> Result<Option<(BlockCoord, BlockSums)>, FleetError> {
        let damaged =
            || FleetError::content(&self.path, "is damaged. Remove the folder and make it again");
        if self.left == 0 {
            // Bytes after the last block are damage, too.
            let ends = self.file.read(&mut [0]).is_ok_and(|read| read == 0);
            return if ends { Ok(None) } else { Err(damaged()) };
        }
        let mut head = [0; BLOCK_HEAD];
        self.file.read_exact(&mut head).map_err(|_| damaged())?;
        let half = |at: usize| i16::from_le_bytes([head[at], head[at + 1]]);
        let word =
            |at: usize| u32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
        let plain_len = BlockSums::bytes(self.lattice.colour);
        let len = word(8) as usize;
        // A length from a damaged file must not become an allocation.
        if len > lz4_flex::block::get_maximum_output_size(plain_len) {
            return Err(damaged());
        }
        let mut packed = vec![0; len];
        self.file.read_exact(&mut packed).map_err(|_| damaged())?;
        let coord = BlockCoord { x: half(0), y: half(2), z: half(4) };
        // Blocks ascend: merging relies on it.
        if checksum(&head, &packed) != word(12) || self.last.is_some_and(|last| last >= coord) {
            return Err(damaged());
        }
        let plain = lz4_flex::block::decompress(&packed, plain_len).map_err(|_| damaged())?;
        let sums = BlockSums::read(&plain, self.lattice.colour).ok_or_else(damaged)?;
        (self.left, self.last) = (self.left - 1, Some(coord));
        Ok(Some((coord, sums)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LATTICE: Lattice = Lattice { voxel_size_m: 0.1, truncation_m: 0.5, colour: false };

    fn blocks() -> Vec<(BlockCoord, BlockSums)> {
        let block = |x: i16| {
            let mut sums = BlockSums::zero(false);
            sums.observe(usize::from(x.unsigned_abs()), x, 3, [0; 3]);
            (BlockCoord { x, y: 0, z: -1 }, sums)
        };
        [-2, 1, 5].map(block).to_vec()
    }

    fn written(path: &Path) -> Vec<u8> {
        let mut blocks = blocks().into_iter();
        assert_eq!(write(path, &LATTICE, || Ok(blocks.next())).unwrap(), 3);
        std::fs::read(path).unwrap()
    }

    fn read(path: &Path) -> Result<Vec<(BlockCoord, BlockSums)>, FleetError> {
        let (mut reader, mut blocks) = (TileReader::open(path)?, Vec::new());
        assert_eq!(reader.lattice(), LATTICE);
        while let Some(block) = reader.next()? {
            blocks.push(block);
        }
        Ok(blocks)
    }

    #[test]
    fn blocks_come_back_and_every_changed_byte_or_length_is_refused() {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("0_0_0.sums");
        let whole = written(&path);
        assert_eq!(read(&path).unwrap(), blocks());
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 1 << (at % 8);
            std::fs::write(&path, bytes).unwrap();
            assert!(read(&path).is_err(), "byte {at} of {}", whole.len());
        }
        // A file that a full disk cut short.
        for len in 0..whole.len() {
            std::fs::write(&path, &whole[..len]).unwrap();
            assert!(read(&path).is_err(), "{len} of {} bytes", whole.len());
        }
    }

    #[test]
    fn a_source_that_fails_leaves_no_file() {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("0_0_0.sums");
        let failing =
            write(&path, &LATTICE, || Err(FleetError::Exists { path: PathBuf::from("x") }));
        assert!(matches!(failing, Err(FleetError::Exists { .. })));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
