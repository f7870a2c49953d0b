//! A finished run: what was run, frame by frame, and the sections of its observers.

use super::{Incomplete, SkippedFrames, Streaming};
pub use crate::observe::StageStatistics;
use crate::observe::{FrameLog, Sections};
use dynvox_core::Capacity;
use dynvox_core::geometry::StereoRig;

/// What was run.
#[derive(Clone, Debug)]
pub struct RunHeader {
    /// Name of the data set.
    pub name: String,
    /// Assumptions of the data set's loader.
    pub notes: Vec<String>,
    /// What is doubtful about the images.
    pub warnings: Vec<String>,
    /// Name of the profile.
    pub profile: String,
    /// Its bounds.
    pub capacity: Capacity,
    /// Threads at work.
    pub threads: usize,
    /// Image size, px.
    pub size: (usize, usize),
    /// The rig.
    pub rig: StereoRig,
    /// The resolved configuration as a file.
    pub config_toml: String,
    /// How evicted blocks were stored, if they were.
    pub streaming: Option<Streaming>,
    /// Bytes of the slab.
    pub slab_bytes: usize,
    /// Resident memory the process was allowed.
    pub rss_limit_bytes: u64,
}

/// A finished run.
#[derive(Debug)]
pub struct RunRecord {
    /// What was run.
    pub header: RunHeader,
    /// The frames.
    pub frames: FrameLog,
    /// Frames left out because they could not be read or mapped.
    pub skipped: SkippedFrames,
    /// Frames of a stream that came while the mapper was busy, and were dropped.
    pub dropped: u64,
    /// Why the results are incomplete, if they are.
    pub incomplete: Option<Incomplete>,
    /// What the observers found.
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

    /// Whether the file of stored blocks is a part of the result.
    pub fn keeps_blocks(&self) -> bool {
        self.sections.blocks.store.records > 0
            && self.header.streaming.is_some_and(|streaming| streaming.keep_file)
    }
}
