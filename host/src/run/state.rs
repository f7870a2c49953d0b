//! The state of a run next to its mapper, as plain data: all of it goes into a checkpoint.

use super::SkippedFrames;
use crate::observe::{FrameRow, Observers};
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};

/// Rows, observers, timers. What follows from the plan (settings, folders) is not here.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct RunState {
    pub rows: Vec<FrameRow>,
    /// Frames taken from the source, those left out included.
    pub taken: usize,
    pub skipped: SkippedFrames,
    pub observers: Observers,
    pub timers: Timers,
}

/// Time a run took so far, that before an interruption included.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Timers {
    /// All of it.
    pub total: Duration,
    /// The part of it that only the report and checkpoints needed.
    pub overhead: Duration,
}

impl Timers {
    /// Adds the time since `since`, which becomes now.
    pub fn add_since(&mut self, since: &mut Instant) {
        let now = Instant::now();
        self.total += now - *since;
        *since = now;
    }

    /// Mapping and waiting for images.
    pub fn mapping(&self) -> Duration {
        self.total.saturating_sub(self.overhead)
    }
}
