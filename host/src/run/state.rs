//! The state of a run next to its mapper, as plain data: all of it goes into a checkpoint.

use super::{Continued, SkippedFrames};
use crate::observe::{FrameLog, GrowingFile, ObserveError, Observer, Observers};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::{Duration, Instant};

/// Frames, observers, timers. What follows from the plan (settings, folders) is not here.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct RunState {
    pub frames: FrameLog,
    /// Frames taken from the source, those left out included.
    pub taken: usize,
    pub skipped: SkippedFrames,
    pub observers: Observers,
    pub timers: Timers,
    /// Time stamp of the frame before the last one, ns.
    pub before_last_ns: Option<u64>,
    /// Old map that the run goes on with.
    pub continued: Option<Continued>,
}

impl RunState {
    /// The files that grow frame by frame.
    fn files(&mut self) -> Vec<&mut GrowingFile> {
        std::iter::once(self.frames.file()).chain(self.observers.files()).collect()
    }

    /// Writes rows that are due.
    pub fn write_due(&mut self, folder: &Path) -> Result<(), ObserveError> {
        self.files().into_iter().try_for_each(|file| file.write_due(folder))
    }

    /// Writes all rows, and waits until they are on the disk. Returns the files that cannot be
    /// written, and why.
    pub fn sync(&mut self, folder: &Path) -> Vec<(String, ObserveError)> {
        self.files()
            .into_iter()
            .filter_map(|file| Some((file.name().to_owned(), file.sync(folder).err()?)))
            .collect()
    }

    /// Brings the rows on disk back to those of the checkpoint.
    pub fn resume(&mut self, folder: &Path) -> Result<(), ObserveError> {
        self.files().into_iter().try_for_each(|file| file.resume(folder))
    }
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
