//! `blocks.csv`: one row for each block of the static map, whenever it left memory and at the end.

use super::csv_text;
use dynvox_core::geometry::MapSegment;
use serde::Serialize;
use std::io;

/// Last event of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BlockFate {
    /// The block is in the map at the end.
    Map,
    /// Pruning took it.
    Pruned,
    /// The block was evicted to make space, and may have come back.
    Evicted,
}

/// Coordinates count blocks of 8 voxels from the first camera.
#[derive(Serialize)]
struct BlockColumns {
    segment: u16,
    x: i16,
    y: i16,
    z: i16,
    last_frame: u32,
    fate: BlockFate,
}

/// The rows of some blocks: segment and coordinates, the frame each was last visible in, and what
/// became of it; with the header before the first.
///
/// # Errors
/// A value cannot be written as a cell.
pub fn block_rows(
    rows: impl Iterator<Item = ((MapSegment, [i16; 3]), u32, BlockFate)>,
    first: bool,
) -> io::Result<Vec<u8>> {
    csv_text(
        first,
        rows.map(|((segment, [x, y, z]), last_frame, fate)| BlockColumns {
            segment: segment.get(),
            x,
            y,
            z,
            last_frame,
            fate,
        }),
    )
}
