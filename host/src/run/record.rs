//! A finished run: what was run, frame by frame, and the sections of its observers.

use super::{Continued, Incomplete, SkippedFrames};
pub use crate::observe::StageStatistics;
use crate::observe::{FrameLog, Sections};
use crate::request::Plan;

/// A finished run.
#[derive(Debug)]
pub struct RunRecord {
    /// Plan that was run.
    pub plan: Plan,
    /// The frames.
    pub frames: FrameLog,
    /// Old map that the run went on with.
    pub continued: Option<Continued>,
    /// Frames left out because they could not be read or mapped.
    pub skipped: SkippedFrames,
    /// Frames of a stream that came while the mapper was busy, and were dropped.
    pub dropped: u64,
    /// Reason that the results are incomplete, if they are.
    pub incomplete: Option<Incomplete>,
    /// Findings of the observers.
    pub sections: Sections,
    /// Wall time of the run, s.
    pub seconds: f64,
    /// The part of it for mapping and waiting for images: without pictures, evaluation and files
    /// that only the report needs, s.
    pub mapping_seconds: f64,
    /// Most bytes resident, where the system reports it.
    pub rss_peak_bytes: Option<u64>,
}

impl RunRecord {
    /// Frames a second, over mapping and waiting for images.
    pub fn fps(&self) -> f64 {
        if self.mapping_seconds > 0.0 {
            self.frames.len() as f64 / self.mapping_seconds
        } else {
            0.0
        }
    }

    /// Digest after the last frame.
    pub fn digest(&self) -> u64 {
        self.frames.last().map_or(0, |row| row.report.digest)
    }

    /// Returns true if the file of stored blocks is a part of the result.
    pub fn keeps_blocks(&self) -> bool {
        self.sections.blocks.store.records > 0
            && self.plan.request.storage.streaming().is_some_and(|streaming| streaming.keep_file)
    }
}
