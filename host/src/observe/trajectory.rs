//! The camera's path: written to `trajectory_kitti.txt` and `trajectory_tum.txt` as it comes, and
//! kept in memory only where it is compared with true poses, which are there as well.

use super::closed_path;
use super::{
    Finished, FrameContext, GrowingFile, LoopSection, ObserveError, ObservedRun, Observer,
};
use crate::evaluate::trajectory::{TrajectoryErrors, errors};
use crate::formats::{TIMED_TRAJECTORY_FILE, TRAJECTORY_FILE, kitti_line, tum_line};
use dynvox_core::egomotion::icp::IcpStatus;
use dynvox_core::geometry::{MapSegment, Transform};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Points kept of the path, at most.
const MAX_POINTS: usize = 4096;

/// Frames the depth tracker lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrackingFailures {
    /// Number of frames.
    pub frames: usize,
    /// Number of the first.
    pub first: usize,
    /// Reason why the camera was lost there.
    pub cause: &'static str,
}

/// The camera's path.
#[derive(Clone, Debug)]
pub struct TrajectorySection {
    /// Source of the motion: `stereo`, `icp` or `file`.
    pub source: &'static str,
    /// Positions of the camera, thinned for a chart.
    pub path: ThinnedPath,
    /// True poses of the first segment's frames, the first at the origin, where they are known.
    pub truth: Option<Vec<Transform>>,
    /// Errors against them, of the map's first segment: where another one stands is not known.
    pub errors: Option<TrajectoryErrors>,
    /// Frames whose pose was extrapolated at constant velocity.
    pub extrapolated_frames: usize,
    /// Reasons why they were, with the number of frames each, the most frequent first.
    pub extrapolated_because: Vec<(String, usize)>,
    /// Segments of the map: 1 where the camera was never lost.
    pub segments: u32,
    /// Frames the depth tracker lost, where it is used.
    pub failures: Option<TrackingFailures>,
    /// Loops that were closed; `None` where the camera found none.
    pub loops: Option<LoopSection>,
}

/// A path with at most `MAX_POINTS` points: every so many frames one, and the last frame's.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ThinnedPath {
    points_m: Vec<[f64; 3]>,
    /// Frames from one point to the next: 2 to the power of this.
    doublings: u32,
    frames: usize,
    last_m: Option<[f64; 3]>,
    length_m: f64,
}

impl ThinnedPath {
    /// Adds a position; the way to it counts where it is `connected` to the one before.
    fn add(&mut self, position_m: [f64; 3], connected: bool) {
        if self.frames.is_multiple_of(1 << self.doublings) {
            // Every second point goes, and from now on half as many come.
            if self.points_m.len() == MAX_POINTS {
                self.points_m = self.points_m.iter().step_by(2).copied().collect();
                self.doublings += 1;
            }
            self.points_m.push(position_m);
        }
        // The length counts every step, also those whose points are left out.
        let step = self
            .last_m
            .filter(|_| connected)
            .map(|last| nalgebra::Vector3::from(position_m) - nalgebra::Vector3::from(last));
        self.length_m += step.map_or(0.0, |step| step.norm());
        self.last_m = Some(position_m);
        self.frames += 1;
    }

    /// Returns the points, m, with the last frame's at the end.
    pub fn points_m(&self) -> impl Iterator<Item = [f64; 3]> {
        self.points_m.iter().copied().chain(self.last_m)
    }

    /// Distance travelled, frame by frame, m.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }
}

/// Collects poses.
#[derive(Debug, Serialize, Deserialize)]
pub struct TrajectoryObserver {
    kitti: GrowingFile,
    tum: GrowingFile,
    path: ThinnedPath,
    /// Number and pose of each frame, where true poses are known.
    compared: Vec<(usize, Transform)>,
    extrapolated_because: BTreeMap<String, usize>,
    segments: u32,
    /// Segment of the last frame.
    segment: MapSegment,
    /// Rows of the path at which another segment begins, and that segment.
    parts: Vec<(usize, MapSegment)>,
    /// Frames the depth tracker lost, and number and cause of the first.
    lost_frames: usize,
    first_lost: Option<(usize, IcpStatus)>,
}

impl Default for TrajectoryObserver {
    fn default() -> Self {
        Self {
            kitti: GrowingFile::new(TRAJECTORY_FILE),
            tum: GrowingFile::new(TIMED_TRAJECTORY_FILE),
            path: ThinnedPath::default(),
            compared: Vec::new(),
            extrapolated_because: BTreeMap::new(),
            segments: 1,
            segment: MapSegment::FIRST,
            parts: Vec::new(),
            lost_frames: 0,
            first_lost: None,
        }
    }
}

impl Observer for TrajectoryObserver {
    type Section = TrajectorySection;

    fn files(&mut self) -> Vec<&mut GrowingFile> {
        vec![&mut self.kitti, &mut self.tum]
    }

    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        let (row, pose) = (frame.row, frame.row.shown_t_world_camera());
        self.kitti.append(kitti_line(&pose).as_bytes());
        // The recording's own stamp, or its time in seconds.
        let time_ns = row.stamp_ns.unwrap_or((row.time_s * 1e9).round() as u64);
        self.tum.append(tum_line(time_ns, &pose).as_bytes());
        if row.report.segment != self.segment {
            self.parts.push((self.path.frames, row.report.segment));
        }
        self.path.add(pose.translation_m, row.report.segment == self.segment);
        self.segment = row.report.segment;
        // Later segments are apart from the first by an unknown motion.
        if run.plan.dataset.truth().is_some() && row.report.segment == MapSegment::FIRST {
            self.compared.push((row.frame, pose));
        }
        if row.is_extrapolated() {
            *self.extrapolated_because.entry(row.motion().replace('_', " ")).or_default() += 1;
        }
        self.segments = self.segments.max(u32::from(row.report.segment.get()) + 1);
        // Only depth registration reports its failures as a status.
        if let Some(status) =
            row.report.icp.map(|icp| icp.status).filter(|status| *status != IcpStatus::Tracked)
        {
            self.lost_frames += 1;
            self.first_lost.get_or_insert((row.frame, status));
        }
        Ok(())
    }

    fn finish(
        self,
        run: &ObservedRun<'_>,
        finished: &Finished,
    ) -> Result<TrajectorySection, ObserveError> {
        let (frames, poses): (Vec<usize>, Vec<Transform>) = self.compared.into_iter().unzip();
        let truth = run.plan.dataset.truth().map(|truth| from_first(truth, &frames));
        let loops =
            closed_path::write(&run.folder, &self.parts, &finished.loops, truth.as_deref())?;
        // The most frequent reason first.
        let mut because: Vec<_> = self.extrapolated_because.into_iter().collect();
        because.sort_by_key(|(_, frames)| std::cmp::Reverse(*frames));
        Ok(TrajectorySection {
            source: run.plan.motion_source(),
            path: self.path,
            errors: truth.as_ref().and_then(|truth| errors(truth, &poses)),
            truth,
            extrapolated_frames: because.iter().map(|(_, frames)| frames).sum(),
            extrapolated_because: because,
            segments: self.segments,
            failures: self.first_lost.map(|(first, status)| TrackingFailures {
                frames: self.lost_frames,
                first,
                cause: status.name(),
            }),
            loops,
        })
    }
}

/// Poses of the chosen frames relative to the first of them.
pub fn from_first(poses: &[Transform], indices: &[usize]) -> Vec<Transform> {
    let chosen: Vec<Transform> =
        indices.iter().filter_map(|&index| poses.get(index).copied()).collect();
    let Some(first) = chosen.first().map(Transform::inverse) else { return Vec::new() };
    chosen.iter().map(|pose| first * pose).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_path_is_thinned_and_keeps_its_length_and_its_end() {
        let mut path = ThinnedPath::default();
        (0..10_000).for_each(|at| path.add([0.0, 0.0, 0.5 * f64::from(at)], true));
        let points: Vec<[f64; 3]> = path.points_m().collect();
        assert!(points.len() <= MAX_POINTS && path.doublings == 2, "{}", points.len());
        assert_eq!(
            (points[1][2], points[points.len() - 1][2], path.length_m()),
            (2.0, 4_999.5, 4_999.5)
        );
        path.add([0.0, -100.0, 0.0], false);
        path.add([0.0, -100.0, 0.5], true);
        assert_eq!(path.length_m(), 5_000.0, "no way leads to another segment");
        assert_eq!(ThinnedPath::default().points_m().count(), 0);
    }
}
