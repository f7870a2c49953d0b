//! `tracks.csv`: one row for each track seen in a frame.

use super::{csv_text, rounded};
use crate::observe::{TrackRow, state_name};
use serde::Serialize;
use std::io;

/// The box is in px, `x2` and `y2` excluded; speeds are empty until a motion was measured.
#[derive(Serialize)]
struct TrackColumns {
    frame: usize,
    id: u32,
    class: &'static str,
    state: &'static str,
    speed_m_s: Option<f64>,
    speed_sigma_m_s: Option<f64>,
    x1: i32,
    y1: i32,
    x2: i32,
    y2: i32,
    score: f64,
    matches: u32,
    inliers: u32,
    measured: u8,
    blocks: u32,
}

/// The rows of the tracks seen in a frame, with the header before the first.
///
/// # Errors
/// A value cannot be written as a cell.
pub fn track_rows(frame: usize, tracks: &[TrackRow], first: bool) -> io::Result<Vec<u8>> {
    csv_text(first, tracks.iter().map(|track| track_columns(frame, track)))
}

fn track_columns(frame: usize, track: &TrackRow) -> TrackColumns {
    let pixels = &track.pixels;
    // Unknown speeds stay empty cells.
    let [speed, sigma] =
        [0, 1].map(|at| track.speed_m_s.map(|speeds| rounded(f64::from(speeds[at]), 3)));
    TrackColumns {
        frame,
        id: track.id,
        class: track.class.name(),
        state: state_name(track.state),
        speed_m_s: speed,
        speed_sigma_m_s: sigma,
        x1: pixels.left,
        y1: pixels.top,
        x2: pixels.left + pixels.width,
        y2: pixels.top + pixels.height,
        score: rounded(f64::from(track.score), 3),
        matches: track.matches,
        inliers: track.inliers,
        measured: u8::from(track.measured),
        blocks: track.blocks,
    }
}
