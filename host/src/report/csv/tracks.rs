//! `tracks_truth.csv`: one row for each track in a frame that was compared with a true object.

use super::write_rows;
use crate::evaluate::objects::TrackComparison;
use crate::observe::tables::rounded;
use crate::observe::{TracksSection, state_name};
use serde::Serialize;
use std::io::{self, Write};

/// Errors are empty where no motion was estimated or the object was not seen before. `settled`
/// counts the frames since the track began and since the true state last changed; `view` is whole,
/// small or cut.
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

/// Writes `tracks_truth.csv`.
///
/// # Errors
/// The disk refuses.
pub fn write_tracks_truth(out: &mut impl Write, tracks: &TracksSection) -> io::Result<()> {
    let columns = |(id, one): &(u32, TrackComparison)| {
        Some(truth_columns(*tracks.compared_frames.get(one.at)?, *id, one))
    };
    write_rows(out, tracks.comparisons.iter().filter_map(columns))
}

fn truth_columns(frame: usize, id: u32, one: &TrackComparison) -> TruthColumns {
    // Errors of a track without a measurement are empty cells.
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
