//! How a run ends before its time, and what the results then lack.

use super::RunError;
use crate::observe::ObserveError;
use serde::{Deserialize, Serialize};

/// Cause that kept a run from its complete results.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum IncompleteCause {
    /// A signal asked for the end.
    Signal,
    /// A frame could not be read or mapped, or a stream stopped inside an image.
    Input,
    /// The process used more memory than it was allowed.
    Memory,
    /// A frame of a strict run affected the map.
    Strict,
    /// The disk refused.
    Disk,
}

/// Reason why the results of a run are incomplete: a section of `summary.json`.
#[derive(Clone, Debug, Serialize)]
pub struct Incomplete {
    /// Cause that kept the run from its complete results.
    pub cause: IncompleteCause,
    /// Cause as a sentence.
    pub reason: String,
    /// Frames of the run that were not mapped; absent for a stream, whose length is unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames_left: Option<usize>,
    /// Files of the run folder that could not be written.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
}

impl Incomplete {
    /// A run that ended early for `error`.
    pub(super) fn of(error: &RunError, frames_left: Option<usize>) -> Self {
        let cause = match error {
            RunError::Signal { .. } => IncompleteCause::Signal,
            RunError::Resident { .. } | RunError::AddressSpace { .. } => IncompleteCause::Memory,
            RunError::Strict { .. } => IncompleteCause::Strict,
            RunError::Folder(_) | RunError::Store(_) | RunError::Reopen(_) => IncompleteCause::Disk,
            RunError::Observe(ObserveError::Write { .. } | ObserveError::Changed { .. }) => {
                IncompleteCause::Disk
            }
            _ => IncompleteCause::Input,
        };
        Self { cause, reason: error.to_string(), frames_left, missing: Vec::new() }
    }

    /// A file that could not be written: the end of a run that had no other reason to be
    /// incomplete, or a part of it.
    pub fn add_missing(incomplete: &mut Option<Self>, name: &str, reason: &str) {
        incomplete
            .get_or_insert_with(|| Self::of_disk(reason.to_owned()))
            .missing
            .push(name.to_owned());
    }

    /// All frames are mapped, and the disk refused a part of the results.
    pub(super) fn of_disk(reason: String) -> Self {
        Self { cause: IncompleteCause::Disk, reason, frames_left: Some(0), missing: Vec::new() }
    }
}

/// Frames left out because they could not be read or mapped.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SkippedFrames {
    /// Number of frames.
    pub count: usize,
    /// The first [`SkippedFrames::LISTED`] of them.
    pub first: Vec<SkippedFrame>,
}

/// A frame left out.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SkippedFrame {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// Reason, as a sentence.
    pub reason: String,
}

impl SkippedFrames {
    /// Frames listed with their reason, at most.
    pub const LISTED: usize = 100;

    /// Counts a frame, and lists it among the first.
    pub(super) fn add(&mut self, frame: usize, reason: String) {
        self.count += 1;
        if self.first.len() < Self::LISTED {
            self.first.push(SkippedFrame { frame, reason });
        }
    }
}
