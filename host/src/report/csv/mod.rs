//! Tables that are written when a run has ended: rows are structs whose fields name the columns.

mod reference;
mod surface_errors;
mod tracks;

pub use reference::write_reference;
pub use surface_errors::write_surface_errors;
pub use tracks::write_tracks_truth;

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
