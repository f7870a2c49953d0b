//! The camera's path.

use super::{Finished, FrameContext, ObserveError, Observer, Setup};
use crate::evaluate::trajectory::{TrajectoryErrors, errors};
use dynvox_core::egomotion::icp::IcpStatus;
use dynvox_core::geometry::Transform;
use serde::{Deserialize, Serialize};

/// Frames the depth tracker lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrackingFailures {
    /// How many.
    pub frames: usize,
    /// Number of the first.
    pub first: usize,
    /// Why it was lost there.
    pub cause: &'static str,
}

/// The camera's path.
#[derive(Clone, Debug)]
pub struct TrajectorySection {
    /// Where the motion came from: `stereo`, `icp` or `file`.
    pub source: &'static str,
    /// Time of each frame, s.
    pub times_s: Vec<f64>,
    /// `t_world_camera` of each frame.
    pub poses: Vec<Transform>,
    /// True poses of the same frames, the first at the origin, where they are known.
    pub truth: Option<Vec<Transform>>,
    /// Errors against them.
    pub errors: Option<TrajectoryErrors>,
    /// Frames whose pose was extrapolated at constant velocity.
    pub held_frames: usize,
    /// Frames the depth tracker lost, where it is used.
    pub failures: Option<TrackingFailures>,
}

/// Collects poses.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct TrajectoryObserver {
    times_s: Vec<f64>,
    poses: Vec<Transform>,
    held_frames: usize,
}

impl Observer for TrajectoryObserver {
    type Section = TrajectorySection;

    fn frame(&mut self, _: &Setup<'_>, frame: &mut FrameContext<'_, '_>) -> Result<(), ObserveError> {
        self.times_s.push(frame.row.time_s);
        self.poses.push(frame.row.report.t_world_camera);
        self.held_frames += usize::from(frame.row.held());
        Ok(())
    }

    fn finish(self, setup: &Setup<'_>, finished: &Finished<'_>) -> Result<TrajectorySection, ObserveError> {
        let frames: Vec<usize> = finished.rows.iter().map(|row| row.frame).collect();
        let truth = setup.dataset.truth().map(|truth| from_first(truth, &frames));
        let statuses = finished.rows.iter().filter_map(|row| Some((row.frame, row.report.icp?.status)));
        let lost: Vec<(usize, IcpStatus)> = statuses.filter(|(_, status)| *status != IcpStatus::Tracked).collect();
        Ok(TrajectorySection {
            source: setup.motion_source,
            errors: truth.as_ref().and_then(|truth| errors(truth, &self.poses)),
            truth,
            times_s: self.times_s,
            poses: self.poses,
            held_frames: self.held_frames,
            failures: lost.first().map(|&(first, status)| TrackingFailures { frames: lost.len(), first, cause: status.name() }),
        })
    }
}

/// Poses of the chosen frames relative to the first of them.
pub fn from_first(poses: &[Transform], indices: &[usize]) -> Vec<Transform> {
    let chosen: Vec<Transform> = indices.iter().filter_map(|&index| poses.get(index).copied()).collect();
    let Some(first) = chosen.first().map(Transform::inverse) else { return Vec::new() };
    chosen.iter().map(|pose| first * pose).collect()
}
