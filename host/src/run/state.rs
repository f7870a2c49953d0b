//! What a run gathers beside its mapper, as plain data: all of it goes into a snapshot.

use super::{FrameRow, Keyframe};
use crate::evaluate::exact::ExactErrors;
use crate::observe::ObjectsAtWork;
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};

/// Rows, pictures, sums. What only says how they are made (settings, folders) is not here: that comes with the plan.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Gathered {
    pub(super) rows: Vec<FrameRow>,
    pub(super) keyframes: Vec<Keyframe>,
    pub(super) exact: ExactErrors,
    pub(super) objects: ObjectsAtWork,
    pub(super) spent: Spent,
}

/// Time a run took so far, that before a stop included.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Spent {
    /// All of it.
    pub whole: Duration,
    /// Of it, what only the report and snapshots needed.
    pub aside: Duration,
}

impl Spent {
    /// Adds what passed since `since`, which is now.
    pub fn until_now(&mut self, since: &mut Instant) {
        let now = Instant::now();
        self.whole += now - *since;
        *since = now;
    }

    /// Mapping and waiting for images.
    pub fn mapping(&self) -> Duration {
        self.whole.saturating_sub(self.aside)
    }
}
