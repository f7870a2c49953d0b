//! The columns of `frames.csv` and `tracks.csv` that a viewer shows.

use crate::formats::{FormatError, rows_of_file};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// A row of `frames.csv`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct FrameColumns {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// Time of the frame, s.
    pub time_s: f64,
    /// Wall time of the step, ms.
    pub step_ms: f64,
    /// Matches that egomotion used.
    pub matches: u32,
    /// Inliers among them.
    pub inliers: u32,
    /// Share of pixels with disparity.
    pub stereo_density: f64,
    /// Blocks in use.
    pub blocks_used: u32,
    /// Tracks seen.
    pub tracks: u32,
    /// Dynamic ones among them.
    pub dynamic: u32,
}

/// A row of `tracks.csv`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct TrackColumns {
    /// Number of the frame.
    pub frame: usize,
    /// Number of the track.
    pub id: u32,
    /// Class of the track.
    pub class: String,
    /// Motion state of the track.
    pub state: String,
    /// Speed over ground, m/s.
    pub speed_m_s: Option<f64>,
    /// Left border of its box, px.
    pub x1: i32,
    /// Upper border, px.
    pub y1: i32,
    /// Right border, px, excluded.
    pub x2: i32,
    /// Lower border, px, excluded.
    pub y2: i32,
}

/// Hands the rows of a table to `sink`.
///
/// # Errors
/// The file cannot be read, or a row is not as this program writes it.
pub fn read_rows<R: DeserializeOwned>(
    path: &Path,
    mut sink: impl FnMut(R),
) -> Result<(), FormatError> {
    let refuse =
        |error: csv::Error| FormatError::content(path, error.to_string(), "Make the run again");
    for row in csv::Reader::from_reader(rows_of_file(path)?).deserialize() {
        sink(row.map_err(refuse)?);
    }
    Ok(())
}
