//! `blocks.csv`: one row for each block of the static map, whenever it left memory and at the end.

use super::csv_text;
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
    x: i16,
    y: i16,
    z: i16,
    last_frame: u32,
    fate: BlockFate,
}

/// The rows of some blocks: coordinates, the frame each was last visible in, and what became of it;
/// with the header before the first.
///
/// # Errors
/// A value cannot be written as a cell.
pub fn block_rows(
    rows: impl Iterator<Item = ([i16; 3], u32, BlockFate)>,
    first: bool,
) -> io::Result<Vec<u8>> {
    csv_text(
        first,
        rows.map(|([x, y, z], last_frame, fate)| BlockColumns { x, y, z, last_frame, fate }),
    )
}
