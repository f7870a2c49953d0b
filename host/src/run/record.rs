//! What is remembered of a run: a row per frame, a few pictures, the figures at the end.

use super::{ShelfUse, StageTime, Streaming, disk_store};
use crate::evaluate::{exact::ExactFigures, trajectory::TrajectoryErrors};
use crate::formats::Mesh;
use crate::input::MaskRefusals;
use crate::observe::{LidarRecord, ObjectsRecord, TrackRow};
use dynvox_core::egomotion::MotionStatus;
use dynvox_core::egomotion::icp::IcpStatus;
use dynvox_core::geometry::{StereoRig, Transform};
use dynvox_core::memory::Region;
use dynvox_core::tracking::State;
use dynvox_core::volume::PruneReport;
use dynvox_core::{Capacity, PoseOrigin, Report, Severity, Stage};
use serde::{Deserialize, Serialize};

/// One frame.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FrameRow {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// Its time, s.
    pub time_s: f64,
    /// What the core reports.
    pub report: Report,
    /// Frames in the pruning window's history.
    pub history_frames: usize,
    /// Tracks seen in this frame, by age.
    pub tracks: Vec<TrackRow>,
    /// What the source of masks said and could not be used.
    pub refusals: MaskRefusals,
    /// Values of a given depth image that are none: not finite, negative, or no disparity of this rig.
    pub depth_refused: u32,
    /// Wall time of the whole step, ms.
    pub step_ms: f64,
    /// Resident memory of the process, where the machine tells.
    pub rss_bytes: Option<u64>,
    /// Time by stage, in the order of `Stage::ALL`.
    pub stages: [StageTime; Stage::ALL.len()],
}

impl FrameRow {
    /// How the camera's motion was found, in one word.
    pub fn motion(&self) -> &'static str {
        if let Some(icp) = &self.report.icp {
            return match icp.status {
                IcpStatus::Tracked => "tracked",
                IcpStatus::TooFewPairs => "tracking_failure_too_few_pairs",
                IcpStatus::NotHeld => "tracking_failure_direction_not_held",
                IcpStatus::OffTheMap => "tracking_failure_off_the_map",
                IcpStatus::TooFar => "tracking_failure_too_far",
                IcpStatus::Contradicted => "tracking_failure_contradicted_by_the_images",
            };
        }
        match self.report.egomotion.map(|motion| motion.status) {
            None if self.report.pose == PoseOrigin::Given => "given",
            None => "first",
            Some(MotionStatus::Estimated) => "estimated",
            Some(MotionStatus::TooFewMatches) => "too_few_matches",
            Some(MotionStatus::TooFewInliers) => "too_few_inliers",
            Some(MotionStatus::NotConverged) => "not_converged",
            Some(MotionStatus::BadRig) => "bad_rig",
        }
    }

    /// Whether the motion was held at constant velocity for want of an estimate.
    pub fn held(&self) -> bool {
        self.report.pose == PoseOrigin::Held
    }

    /// Matches the estimate was made of, inliers among them, and their root mean square error in px; for the depth tracker those asked, and
    /// those that agree.
    pub fn matches(&self) -> (u32, u32, f64) {
        if let Some(icp) = &self.report.icp {
            return (icp.matches[1], icp.matches[0], 0.0);
        }
        self.report.egomotion.map_or((0, 0, 0.0), |motion| (motion.matches, motion.inliers, motion.residual_rms_px))
    }

    /// What harmed the map in this frame, in words.
    pub fn cause(&self) -> String {
        let (allocation, motion) = (&self.report.allocation, self.motion());
        let guessed = self.held().then(|| format!("its pose had to be guessed ({}), so it was not fused", motion.replace('_', " ")));
        let counts = [
            (allocation.refused, "requests for blocks found no room in the pool"),
            (allocation.beyond, "points lie beyond the map's coordinates"),
            (allocation.unlisted, "visible blocks found no room in the list"),
            (allocation.eviction.lost, "blocks left the full pool and were not kept"),
        ];
        let counted = counts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}"));
        guessed.into_iter().chain(counted).collect::<Vec<_>>().join("; ")
    }

    /// How many of the tracks seen are in a state.
    pub fn tracks_in(&self, state: State) -> usize {
        self.tracks.iter().filter(|track| track.state == state).count()
    }

    /// Blocks the map lacks after this frame: refused, beyond its coordinates, or left out of the list of visible ones.
    pub fn blocks_refused(&self) -> u32 {
        let allocation = &self.report.allocation;
        allocation.refused + allocation.beyond + allocation.unlisted
    }
}

/// Pictures of one frame, as PNG files.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Keyframe {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// Left image.
    pub input_png: Vec<u8>,
    /// Disparity in colours.
    pub disparity_png: Vec<u8>,
    /// The map from the camera's place.
    pub raycast_png: Vec<u8>,
    /// The same with every object where it is; empty where there are none.
    pub composed_png: Vec<u8>,
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

/// A finished run.
#[derive(Clone, Debug)]
pub struct RunRecord {
    /// Name of the data set.
    pub name: String,
    /// What the data set's loader assumed.
    pub notes: Vec<String>,
    /// Where the camera's motion came from: `stereo`, `icp` or `file`.
    pub motion_source: &'static str,
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
    /// The frames.
    pub rows: Vec<FrameRow>,
    /// True poses of the same frames, the first at the origin.
    pub truth: Option<Vec<Transform>>,
    /// Errors against them.
    pub errors: Option<TrajectoryErrors>,
    /// The map against exact depth.
    pub exact: Option<ExactFigures>,
    /// Input and map against LiDAR or exact depth, where it was asked for.
    pub lidar: Option<LidarRecord>,
    /// What moves or could.
    pub objects: ObjectsRecord,
    /// Pictures.
    pub keyframes: Vec<Keyframe>,
    /// The finished map from behind and above the last camera, as a PNG file; empty where there is none.
    pub overview_png: Vec<u8>,
    /// The slab, region by region, at the end.
    pub regions: Vec<Region>,
    /// Bytes of the slab.
    pub slab_bytes: usize,
    /// Most bytes resident, where the machine tells.
    pub rss_peak_bytes: Option<u64>,
    /// Blocks of the map in memory in the end.
    pub blocks: usize,
    /// How blocks that left the pool were kept on disk, if they were.
    pub streaming: Option<Streaming>,
    /// What was kept.
    pub shelf: ShelfUse,
    /// Why nothing more was kept, if the disk failed.
    pub shelf_failure: Option<String>,
    /// Resident memory the process was allowed.
    pub rss_limit_bytes: u64,
    /// What draining the window pruned in the end.
    pub finish: PruneReport,
    /// The mesh written.
    pub mesh: Mesh,
    /// Wall time of the run, s.
    pub seconds: f64,
    /// Of it, mapping and waiting for images: without the pictures, evaluation and files that only the report needs, s.
    pub mapping_seconds: f64,
}

impl RunRecord {
    /// Frames a second, over mapping and waiting for images.
    pub fn fps(&self) -> f64 {
        if self.mapping_seconds > 0.0 { self.rows.len() as f64 / self.mapping_seconds } else { 0.0 }
    }

    /// Files in the run folder that only served the making.
    pub fn served(&self) -> Vec<&'static str> {
        let stays = self.shelf.records > 0 && self.streaming.is_some_and(|streaming| streaming.keep_file);
        if stays { Vec::new() } else { vec![disk_store::FILE] }
    }

    /// Frames whose motion was held.
    pub fn held_frames(&self) -> usize {
        self.rows.iter().filter(|row| row.held()).count()
    }

    /// Frames the depth tracker lost, the number of the first of them and why it was lost; none where it was not used or lost none.
    pub fn tracking_failures(&self) -> Option<(usize, usize, &'static str)> {
        let mut failures = self
            .rows
            .iter()
            .filter_map(|row| Some((row.frame, row.report.icp?.status)))
            .filter(|(_, status)| *status != IcpStatus::Tracked);
        let (first, status) = failures.next()?;
        Some((1 + failures.count(), first, status.name()))
    }

    /// Estimated poses.
    pub fn poses(&self) -> Vec<Transform> {
        self.rows.iter().map(|row| row.report.t_world_camera).collect()
    }

    /// Blocks that found no room, over all frames.
    pub fn blocks_refused(&self) -> u64 {
        self.rows.iter().map(|row| u64::from(row.blocks_refused())).sum()
    }

    /// Blocks that left the full pool for good, and such that could not be read back, in all.
    pub fn blocks_lost(&self) -> u64 {
        let lost = self.rows.iter().map(|row| u64::from(row.report.allocation.eviction.lost)).sum::<u64>();
        lost + u64::from(self.shelf.end.lost) + self.shelf.unreadable
    }

    /// Blocks that came back, over all frames.
    pub fn blocks_back(&self) -> u64 {
        self.rows.iter().map(|row| u64::from(row.report.allocation.eviction.returned)).sum()
    }

    /// The worst thing that happened.
    pub fn worst(&self) -> Severity {
        let end = if self.blocks_lost() > 0 { Severity::MapAffected } else { Severity::Info };
        self.rows.iter().map(|row| row.report.severity()).fold(end, Severity::max)
    }

    /// Digest after the last frame.
    pub fn digest(&self) -> u64 {
        self.rows.last().map_or(0, |row| row.report.digest)
    }

    /// Most blocks in use at once.
    pub fn blocks_peak(&self) -> u32 {
        self.rows.last().map_or(0, |row| row.report.blocks.peak)
    }

    /// Bytes of the slab in use by the map's regions (`volume.*`).
    pub fn map_bytes(&self) -> u64 {
        self.regions.iter().filter(|region| region.name.starts_with("volume.")).map(|region| region.used as u64).sum()
    }

    /// Statistics of `step` and every stage that ran, in pipeline order.
    pub fn stage_statistics(&self) -> Vec<(&'static str, StageStatistics)> {
        // The step does not raycast: that is done beside it, on some frames.
        let within = |row: &FrameRow| {
            row.stages.iter().zip(Stage::ALL).filter(|(_, stage)| *stage != Stage::Raycast).map(|(time, _)| time.cpu_ms).sum()
        };
        let step: Vec<StageTime> = self.rows.iter().map(|row| StageTime { wall_ms: row.step_ms, cpu_ms: within(row) }).collect();
        let stages = Stage::ALL.iter().enumerate().map(|(at, stage)| {
            let ran = self.rows.iter().filter_map(|row| row.stages.get(at).copied()).filter(|time| time.wall_ms > 0.0);
            (stage.name(), ran.collect::<Vec<_>>())
        });
        std::iter::once(("step", step)).chain(stages).filter_map(|(name, times)| Some((name, statistics(&times)?))).collect()
    }
}

fn statistics(times: &[StageTime]) -> Option<StageStatistics> {
    let sorted = |of: fn(&StageTime) -> f64| {
        let mut values: Vec<f64> = times.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let (wall, cpu) = (sorted(|time| time.wall_ms), sorted(|time| time.cpu_ms));
    // Nearest rank: the smallest value that at least this share does not exceed.
    let quantile = |values: &[f64], share: f64| values.get(((share * values.len() as f64).ceil() as usize).saturating_sub(1)).copied();
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
    fn quantiles_are_values_that_occurred() {
        let times: Vec<StageTime> = (1..=200).rev().map(|ms| StageTime { wall_ms: f64::from(ms), cpu_ms: 2.0 * f64::from(ms) }).collect();
        let of = statistics(&times).unwrap();
        assert_eq!((of.median_ms, of.p99_ms, of.cpu_median_ms, of.frames), (100.0, 198.0, 200.0, 200));
        assert_eq!(statistics(&[]), None);
    }
}
