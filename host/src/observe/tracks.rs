//! Tracks frame by frame, and each over the whole run.

use crate::evaluate::objects::{TrackErrors, median};
use crate::run::FrameRow;
use dynvox_core::masks::PixelBox;
use dynvox_core::tracking::{Class, State, TrackReport};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Name of a state in tables and files.
pub const fn state_name(state: State) -> &'static str {
    match state {
        State::Uncertain => "uncertain",
        State::Static => "static",
        State::Dynamic => "dynamic",
    }
}

/// A track seen in a frame: what a run remembers of its report. 64 bytes, so that a long drive may have many.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackRow {
    /// Its number.
    pub id: u32,
    /// What it is.
    pub class: Class,
    /// Whether it moves.
    pub state: State,
    /// Whether its motion was measured in this frame.
    pub measured: bool,
    /// Score of its detection.
    pub score: f32,
    /// Where it was seen.
    pub pixels: PixelBox,
    /// Speed over ground and its error, one sigma, m/s.
    pub speed_m_s: Option<[f32; 2]>,
    /// Matches on it.
    pub matches: u32,
    /// Of these, explained by its motion.
    pub inliers: u32,
    /// Blocks of its volume.
    pub blocks: u32,
}

const _: () = assert!(size_of::<TrackRow>() <= 64);

impl From<&TrackReport> for TrackRow {
    fn from(track: &TrackReport) -> Self {
        Self {
            id: track.id,
            class: track.class,
            state: track.state,
            measured: track.measured,
            score: track.score,
            pixels: track.pixels,
            speed_m_s: track.speed_m_s,
            matches: track.matches,
            inliers: track.inliers,
            blocks: track.blocks,
        }
    }
}

/// A track over the whole run.
#[derive(Clone, Debug)]
pub struct TrackRecord {
    /// Its number.
    pub id: u32,
    /// What it is.
    pub class: Class,
    /// First and last frame it was seen in, as the data set counts.
    pub first_frame: usize,
    /// See `first_frame`.
    pub last_frame: usize,
    /// Frames it was seen in.
    pub frames: usize,
    /// Of these, frames in each state: uncertain, static, dynamic.
    pub states: [usize; 3],
    /// The state it was in most, of static and dynamic; uncertain if it was neither.
    pub state: State,
    /// Median speed over the frames in that state, m/s.
    pub speed_m_s: Option<f64>,
    /// Most blocks of its volume.
    pub blocks: u32,
    /// Against the truth, where it is known.
    pub errors: Option<TrackErrors>,
}

/// Every track over all frames.
pub(super) fn track_records(rows: &[FrameRow], errors: &BTreeMap<u32, TrackErrors>) -> Vec<TrackRecord> {
    let mut seen = BTreeMap::<u32, Vec<(usize, &TrackRow)>>::new();
    for (row, track) in rows.iter().flat_map(|row| row.tracks.iter().map(move |track| (row, track))) {
        seen.entry(track.id).or_default().push((row.frame, track));
    }
    let record = |(id, seen): (u32, Vec<(usize, &TrackRow)>)| {
        let of = |state: State| seen.iter().filter(move |(_, track)| track.state == state);
        let states = [State::Uncertain, State::Static, State::Dynamic].map(|state| of(state).count());
        let state = match states {
            [_, 0, 0] => State::Uncertain,
            [_, still, moving] if moving > still => State::Dynamic,
            _ => State::Static,
        };
        let (first, last) = (seen.first()?, seen.last()?);
        Some(TrackRecord {
            id,
            class: last.1.class,
            first_frame: first.0,
            last_frame: last.0,
            frames: seen.len(),
            states,
            state,
            speed_m_s: median(of(state).filter_map(|(_, track)| track.speed_m_s.map(|[speed, _]| f64::from(speed)))),
            blocks: seen.iter().map(|(_, track)| track.blocks).max().unwrap_or_default(),
            errors: errors.get(&id).cloned(),
        })
    };
    seen.into_iter().filter_map(record).collect()
}
