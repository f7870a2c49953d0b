//! Tables of a run: rows are structs whose fields name the columns.

mod frames;
mod reference;
mod tracks;

pub use frames::{FrameDigests, read_frame_digests, write_frames};
pub use reference::write_reference;
pub use tracks::{write_tracks, write_tracks_truth};

use serde::Serialize;
use std::io::{self, Write};

/// Writes a table with its header.
fn write_rows<R: Serialize>(out: &mut impl Write, rows: impl Iterator<Item = R>) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    for row in rows {
        writer.serialize(row).map_err(io::Error::other)?;
    }
    writer.flush()
}

/// A value to so many decimals.
fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10f64.powi(decimals);
    (value * scale).round() / scale
}
