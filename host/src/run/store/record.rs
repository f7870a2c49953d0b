//! One block as bytes: a header with a checksum, then the voxels, compressed.
//!
//! Header, 24 bytes, little endian: x, y, z (`i16`), segment of the map (`u16`), where the last
//! record of the same tile begins (`u64`, 0 none), length of the payload and flags (`u16` each, bit
//! 0: colour), CRC-32 of the first 20 bytes and the payload. Payload: LZ4 of 512 distances (`i16`),
//! 512 weights, and with colour three planes of 512 bytes.

use dynvox_core::geometry::MapSegment;
use dynvox_core::volume::{BLOCK_VOXELS, BlockCoord, BlockKey, EvictedBlock, LoadedBlock};

/// Bytes of a record's header.
pub(super) const HEADER: usize = 24;
const CHECKED: usize = 20;
const PLAIN: usize = BLOCK_VOXELS * 3;
const COLOURED: usize = BLOCK_VOXELS * 6;
/// No payload is longer: LZ4's worst case for a coloured block.
pub(super) const LONGEST: usize = lz4_flex::block::get_maximum_output_size(COLOURED);
const _: () = assert!(LONGEST <= u16::MAX as usize, "a length is 16 bits");
const HAS_COLOUR: u16 = 1;

/// Fields of a record's header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub key: BlockKey,
    /// Offset of the previous record of the same tile; 0 for the first one.
    pub previous: u64,
    pub len: usize,
    flags: u16,
    checksum: u32,
}

impl Header {
    /// Reads a header; `None` when it cannot be one.
    pub fn read(bytes: &[u8; HEADER]) -> Option<Self> {
        let half = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        let [x, y, z] = [0, 2, 4].map(|at| half(at) as i16);
        let word = |at: usize| {
            u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
        };
        let header = Self {
            key: BlockKey { segment: MapSegment::new(half(6)), coord: BlockCoord { x, y, z } },
            previous: u64::from(word(8)) | u64::from(word(12)) << 32,
            len: usize::from(half(16)),
            flags: half(18),
            checksum: word(CHECKED),
        };
        (header.len <= LONGEST && header.flags <= HAS_COLOUR).then_some(header)
    }

    /// Returns true if header and payload are as they were written.
    pub fn fits(&self, bytes: &[u8; HEADER], payload: &[u8]) -> bool {
        checksum(bytes, payload) == self.checksum
    }
}

fn checksum(header: &[u8; HEADER], payload: &[u8]) -> u32 {
    let mut crc = crc32fast::Hasher::new();
    crc.update(&header[..CHECKED]);
    crc.update(payload);
    crc.finalize()
}

/// Writes a block into `record`, header and all, as the one after `previous` in its tile. `scratch`
/// is working space.
pub(super) fn write(
    block: &EvictedBlock<'_>,
    previous: u64,
    scratch: &mut Vec<u8>,
    record: &mut Vec<u8>,
) {
    scratch.clear();
    scratch.extend(block.sdf.iter().flat_map(|sdf| sdf.to_le_bytes()));
    scratch.extend_from_slice(block.weight);
    block.colour.into_iter().flatten().for_each(|plane| scratch.extend_from_slice(plane));
    record.clear();
    record.resize(HEADER + LONGEST, 0);
    let len = lz4_flex::block::compress_into(scratch, &mut record[HEADER..])
        .expect("LONGEST is LZ4's worst case");
    record.truncate(HEADER + len);
    let flags = if block.colour.is_some() { HAS_COLOUR } else { 0 };
    let mut header = [0; HEADER];
    let BlockKey { segment, coord } = block.key;
    let words = [coord.x as u16, coord.y as u16, coord.z as u16, segment.get()];
    for (at, value) in words.into_iter().enumerate() {
        header[2 * at..2 * at + 2].copy_from_slice(&value.to_le_bytes());
    }
    header[8..16].copy_from_slice(&previous.to_le_bytes());
    header[16..18].copy_from_slice(&(len as u16).to_le_bytes());
    header[18..CHECKED].copy_from_slice(&flags.to_le_bytes());
    let sum = checksum(&header, &record[HEADER..]);
    header[CHECKED..].copy_from_slice(&sum.to_le_bytes());
    record[..HEADER].copy_from_slice(&header);
}

/// Fills a block from a payload; `false`, and the block as it was, when the payload is not that of
/// such a block.
pub(super) fn read(payload: &[u8], block: LoadedBlock<'_>, scratch: &mut Vec<u8>) -> bool {
    let wanted = if block.colour.is_some() { COLOURED } else { PLAIN };
    scratch.clear();
    scratch.resize(wanted, 0);
    if !lz4_flex::block::decompress_into(payload, scratch).is_ok_and(|len| len == wanted) {
        return false;
    }
    let (sdf, rest) = scratch.split_at(2 * BLOCK_VOXELS);
    let (weight, colour) = rest.split_at(BLOCK_VOXELS);
    block
        .sdf
        .iter_mut()
        .zip(sdf.as_chunks().0)
        .for_each(|(to, from)| *to = i16::from_le_bytes(*from));
    block.weight.copy_from_slice(weight);
    if let Some(planes) = block.colour {
        planes.as_flattened_mut().copy_from_slice(colour);
    }
    true
}
