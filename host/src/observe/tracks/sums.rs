//! Sums of a track while the run goes on.

use super::{TrackRecord, TrackRow, TrackSpan};
use crate::evaluate::histogram::Histogram;
use crate::evaluate::objects::TrackErrors;
use dynvox_core::tracking::{Class, MotionState};
use serde::{Deserialize, Serialize};

/// A track so far.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct TrackSums {
    class: Class,
    first_frame: usize,
    last_frame: usize,
    /// Frames by state: uncertain, static, dynamic.
    states: [usize; 3],
    /// Speeds by state, m/s.
    speeds_m_s: [Histogram; 3],
    blocks: u32,
    spans: Vec<TrackSpan>,
}

impl TrackSums {
    /// Begins the sums of a track first seen in a frame.
    pub fn begin(frame: usize) -> Self {
        Self {
            class: Class::default(),
            first_frame: frame,
            last_frame: frame,
            states: [0; 3],
            speeds_m_s: Default::default(),
            blocks: 0,
            spans: Vec::new(),
        }
    }

    /// Adds a frame with its number and its position in the run.
    pub fn add(&mut self, frame: usize, position: usize, row: &TrackRow) {
        let state = index(row.state);
        (self.class, self.last_frame, self.blocks) =
            (row.class, frame, self.blocks.max(row.blocks));
        self.states[state] += 1;
        let speed_m_s = row.speed_m_s.map(|[speed, _]| speed);
        speed_m_s.iter().for_each(|speed| self.speeds_m_s[state].add(f64::from(*speed)));
        // A span goes on while state and measurement stay and no frame is missing.
        let like = |last: &&mut TrackSpan| {
            last.to == position && (last.state, last.measured) == (row.state, row.measured)
        };
        match self.spans.last_mut().filter(like) {
            Some(last) => (last.to, last.speed_m_s) = (position + 1, speed_m_s),
            None => self.spans.push(TrackSpan {
                from: position,
                to: position + 1,
                state: row.state,
                measured: row.measured,
                speed_m_s,
            }),
        }
    }

    /// The track over the whole run.
    pub fn record(self, id: u32, errors: Option<&TrackErrors>) -> TrackRecord {
        // Uncertain frames do not count; of equals, static.
        let state = match self.states {
            [_, 0, 0] => MotionState::Uncertain,
            [_, still, moving] if moving > still => MotionState::Dynamic,
            _ => MotionState::Static,
        };
        TrackRecord {
            id,
            class: self.class,
            first_frame: self.first_frame,
            last_frame: self.last_frame,
            frames: self.states.iter().sum(),
            states: self.states,
            state,
            speed_m_s: self.speeds_m_s[index(state)].quantile(0.5),
            blocks: self.blocks,
            spans: self.spans,
            errors: errors.cloned(),
        }
    }
}

/// Position of a state in counts by state.
const fn index(state: MotionState) -> usize {
    match state {
        MotionState::Uncertain => 0,
        MotionState::Static => 1,
        MotionState::Dynamic => 2,
    }
}
