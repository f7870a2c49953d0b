//! Tables of the run folder: rows are structs whose fields name the columns.

mod blocks;
mod frames;
mod tracks;

pub use blocks::{BlockFate, block_rows};
pub use frames::{Cell, FrameColumn, FrameDigests, frame_columns, frame_row, read_frame_digests};
pub use tracks::track_rows;

use serde::Serialize;
use std::io;

/// Rows as text, with the header where they are the first.
fn csv_text<R: Serialize>(first: bool, rows: impl Iterator<Item = R>) -> io::Result<Vec<u8>> {
    let mut writer = csv::WriterBuilder::new().has_headers(first).from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).map_err(io::Error::other)?;
    }
    writer.into_inner().map_err(|error| io::Error::other(error.to_string()))
}

/// A value to so many decimals.
pub fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10f64.powi(decimals);
    (value * scale).round() / scale
}
