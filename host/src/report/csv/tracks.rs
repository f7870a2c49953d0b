//! `tracks.csv`: one row for each track seen in a frame; `tracks_truth.csv`: one for each that was compared with a true object.

use super::{rounded, write_rows};
use crate::evaluate::objects::TrackComparison;
use crate::observe::{FrameTracks, TrackRow, TracksSection, state_name};
use serde::Serialize;
use std::io::{self, Write};

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

/// Errors are empty where no motion was estimated or the object was not seen before. `settled` counts the frames since the track began and
/// since the true state last changed; `view` is whole, small or cut.
#[derive(Serialize)]
struct TruthColumns {
    frame: usize,
    id: u32,
    truth: u32,
    moving: u8,
    state: &'static str,
    distance_m: f64,
    me_t_m: Option<f64>,
    me_r_deg: Option<f64>,
    true_speed_m_s: f64,
    speed_m_s: Option<f64>,
    settled: u32,
    view: &'static str,
}

/// Writes `tracks.csv`.
///
/// # Errors
/// The disk refuses.
pub fn write_tracks(out: &mut impl Write, frames: &[FrameTracks]) -> io::Result<()> {
    write_rows(out, frames.iter().flat_map(|frame| frame.tracks.iter().map(|track| track_columns(frame.frame, track))))
}

/// Writes `tracks_truth.csv`.
///
/// # Errors
/// The disk refuses.
pub fn write_tracks_truth(out: &mut impl Write, tracks: &TracksSection) -> io::Result<()> {
    let columns = |(id, one): &(u32, TrackComparison)| Some(truth_columns(tracks.frames.get(one.at)?.frame, *id, one));
    write_rows(out, tracks.comparisons.iter().filter_map(columns))
}

fn track_columns(frame: usize, track: &TrackRow) -> TrackColumns {
    let pixels = &track.pixels;
    let [speed, sigma] = [0, 1].map(|at| track.speed_m_s.map(|speeds| rounded(f64::from(speeds[at]), 3)));
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

fn truth_columns(frame: usize, id: u32, one: &TrackComparison) -> TruthColumns {
    let [t, r] = [0, 1].map(|at| one.error.map(|error| rounded(error[at], 5)));
    TruthColumns {
        frame,
        id,
        truth: one.truth,
        moving: u8::from(one.moving),
        state: state_name(one.state),
        distance_m: rounded(one.distance_m, 3),
        me_t_m: t,
        me_r_deg: r,
        true_speed_m_s: rounded(one.true_speed_m_s, 3),
        speed_m_s: one.speed_m_s.map(|speed| rounded(speed, 3)),
        settled: one.settled,
        view: one.view.name(),
    }
}
