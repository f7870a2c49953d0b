//! A finished run: what was run, frame by frame, and the sections of its observers.

use super::{Incomplete, SkippedFrames, Streaming};
use crate::evaluate::quantile::{ascending, quantile};
use crate::observe::{FrameRow, STAGES, Sections, StageTime};
use dynvox_core::geometry::StereoRig;
use dynvox_core::{Capacity, Stage};

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
#[derive(Clone, Debug)]
pub struct RunRecord {
    /// What was run.
    pub header: RunHeader,
    /// Frame by frame.
    pub frames: Vec<FrameRow>,
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
    /// The part of it for mapping and waiting for images: without pictures, evaluation and files that only the report needs, s.
    pub mapping_seconds: f64,
    /// Most bytes resident, where the system reports it.
    pub rss_peak_bytes: Option<u64>,
}

impl RunRecord {
    /// Frames a second, over mapping and waiting for images.
    pub fn fps(&self) -> f64 {
        if self.mapping_seconds > 0.0 { self.frames.len() as f64 / self.mapping_seconds } else { 0.0 }
    }

    /// Digest after the last frame.
    pub fn digest(&self) -> u64 {
        self.frames.last().map_or(0, |row| row.report.digest)
    }

    /// Whether the file of stored blocks is a part of the result.
    pub fn keeps_blocks(&self) -> bool {
        self.sections.blocks.store.records > 0 && self.header.streaming.is_some_and(|streaming| streaming.keep_file)
    }

    /// Statistics of `step` and every stage that ran, in pipeline order.
    pub fn stage_statistics(&self) -> Vec<(&'static str, StageStatistics)> {
        let step: Vec<StageTime> =
            self.frames.iter().map(|row| StageTime { wall_ms: row.step_ms, cpu_ms: cpu_ms_within_step(&row.stages) }).collect();
        let stages = Stage::ALL.iter().enumerate().map(|(at, stage)| {
            let ran = self.frames.iter().filter_map(|row| row.stages.get(at).copied()).filter(|time| time.wall_ms > 0.0);
            (stage.name(), ran.collect::<Vec<_>>())
        });
        std::iter::once(("step", step)).chain(stages).filter_map(|(name, times)| Some((name, statistics(&times)?))).collect()
    }
}

/// The step does not raycast: the report does, on some frames.
fn cpu_ms_within_step(stages: &[StageTime; STAGES]) -> f64 {
    stages.iter().zip(Stage::ALL).filter(|(_, stage)| *stage != Stage::Raycast).map(|(time, _)| time.cpu_ms).sum()
}

/// Median and 99th percentile of a stage, over the frames it ran in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageStatistics {
    /// Median wall time, ms.
    pub median_ms: f64,
    /// 99th percentile of the wall time, ms.
    pub p99_ms: f64,
    /// Median CPU time over all threads, ms.
    pub cpu_median_ms: f64,
    /// Frames it ran in.
    pub frames: usize,
}

fn statistics(times: &[StageTime]) -> Option<StageStatistics> {
    let (wall, cpu) = (ascending(times.iter().map(|time| time.wall_ms)), ascending(times.iter().map(|time| time.cpu_ms)));
    Some(StageStatistics {
        median_ms: quantile(&wall, 0.5)?,
        p99_ms: quantile(&wall, 0.99)?,
        cpu_median_ms: quantile(&cpu, 0.5)?,
        frames: times.len(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_are_of_the_frames_a_stage_ran_in() {
        let times: Vec<StageTime> = (1..=200).rev().map(|ms| StageTime { wall_ms: f64::from(ms), cpu_ms: 2.0 * f64::from(ms) }).collect();
        let of = statistics(&times).unwrap();
        assert_eq!((of.median_ms, of.p99_ms, of.cpu_median_ms, of.frames), (101.0, 199.0, 202.0, 200));
        assert_eq!(statistics(&[]), None);
    }
}
