//! `frames.csv`: one row for each frame. Empty cells are values that are unknown.
//!
//! The table of columns ([`frame_columns`]) is the only place that knows them: the header, the
//! rows, the values of charts and the tables of `docs/run_folder.md` are made from it.

mod cell;
mod columns;
mod digests;
#[cfg(test)]
mod tests;

pub use cell::Cell;
pub use digests::{FrameDigests, read_frame_digests};

use crate::observe::FrameRow;
use dynvox_core::{Digested, Stage, StageDigests};
use std::borrow::Cow;
use std::io;
use std::sync::LazyLock;

/// A column of `frames.csv`.
#[derive(Clone, Debug)]
pub struct FrameColumn {
    /// Name in the header.
    pub name: Cow<'static, str>,
    /// Unit of the values; empty for counts, words and shares.
    pub unit: &'static str,
    /// Meaning, as a sentence of the documentation.
    pub doc: &'static str,
    value: Value,
    charted: bool,
}

/// Origin of a column's values.
#[derive(Clone, Copy, Debug)]
enum Value {
    /// A function of the row.
    Of(fn(&FrameRow) -> Cell),
    /// Wall time of a stage, ms.
    Wall(Stage),
    /// CPU time of a stage, ms.
    Cpu(Stage),
    /// Digest of a stage's outcome, or of the input.
    Digest(Digested),
}

impl FrameColumn {
    /// True where the values are kept for charts.
    pub fn is_charted(&self) -> bool {
        self.charted
    }

    /// The value in the row of a frame.
    pub fn cell(&self, row: &FrameRow) -> Cell {
        match self.value {
            Value::Of(value) => value(row),
            Value::Wall(stage) => Cell::rounded(row.times.stages[stage as usize].wall_ms, 4),
            Value::Cpu(stage) => Cell::rounded(row.times.stages[stage as usize].cpu_ms, 4),
            Value::Digest(of) => Cell::Text(digest(&row.report.digests, of)),
        }
    }
}

/// Columns of one stage: wall time and CPU time.
fn times(stage: Stage) -> [FrameColumn; 2] {
    [("ms", Value::Wall(stage)), ("cpu_ms", Value::Cpu(stage))].map(|(end, value)| FrameColumn {
        name: Cow::Owned(format!("{}_{end}", stage.name())),
        unit: "ms",
        doc: "",
        value,
        charted: true,
    })
}

/// Outcomes with a column for their digest; all objects share one.
fn digested() -> impl Iterator<Item = Digested> {
    let stages = StageDigests::default().in_order().map(|(of, _)| of);
    stages.into_iter().chain([Digested::Object(0)])
}

/// A digest as text; of objects those of all, by id.
fn digest(digests: &StageDigests, of: Digested) -> String {
    let known = digests.in_order().into_iter().find(|(stage, _)| *stage == of);
    known.map_or_else(|| digests.objects.to_string(), |(_, digest)| format!("{digest:016x}"))
}

/// All columns of `frames.csv`, in their order.
pub fn frame_columns() -> &'static [FrameColumn] {
    // Names of digests are put together, so that the table cannot be a constant.
    static COLUMNS: LazyLock<Vec<FrameColumn>> = LazyLock::new(|| {
        let digest = |of: Digested| FrameColumn {
            name: Cow::Owned(format!("{}_digest", of.name())),
            unit: "",
            doc: "",
            value: Value::Digest(of),
            charted: false,
        };
        let of_frames = columns::TABLES.iter().copied().flatten().cloned();
        let times = Stage::ALL.into_iter().flat_map(times);
        of_frames.chain(times).chain(digested().map(digest)).collect()
    });
    &COLUMNS
}

/// The row of a frame, with the header before the first.
///
/// # Errors
/// A value cannot be written as a cell.
pub fn frame_row(row: &FrameRow, first: bool) -> io::Result<Vec<u8>> {
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
    if first {
        writer.write_record(frame_columns().iter().map(|column| column.name.as_ref()))?;
    }
    let cells: Vec<Cell> = frame_columns().iter().map(|column| column.cell(row)).collect();
    writer.serialize(cells).map_err(io::Error::other)?;
    writer.into_inner().map_err(|error| io::Error::other(error.to_string()))
}
