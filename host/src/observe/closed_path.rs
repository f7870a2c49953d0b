//! The camera's path after the loops that were closed, written beside the path as it was driven.
//!
//! Loops move keyframes. A frame moves with the keyframes before and after it, by its place between
//! them; frames before the first keyframe and after the last one move with that.

use super::ObserveError;
use crate::evaluate::trajectory::{TrajectoryErrors, errors};
use crate::formats::{
    CLOSED_TRAJECTORY_FILE, TIMED_CLOSED_TRAJECTORY_FILE, TIMED_TRAJECTORY_FILE, TRAJECTORY_FILE,
    kitti_line, read_poses, shown_pose, tum_row,
};
use crate::owned;
use dynvox_core::geometry::{MapSegment, Transform};
use dynvox_core::places::{CorrectedKeyframe, HeldLoop, LoopCounts};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::Serialize;
use std::fs;
use std::path::Path;

/// Loops at the end of a run.
#[derive(Clone, Debug, Default)]
pub struct ClosedLoops {
    /// Counts of closures.
    pub counts: LoopCounts,
    /// Keyframes where the closures put them, oldest first.
    pub keyframes: Vec<CorrectedKeyframe>,
    /// Loops that hold them there.
    pub held: Vec<HeldLoop>,
    /// Positions of --fixes that belong to a frame.
    pub fixes_given: usize,
    /// Triangles of the map after all loops, where it was written.
    pub triangles: Option<u64>,
}

/// Loops that a run closed.
#[derive(Clone, Debug, Serialize)]
pub struct LoopSection {
    /// Closures that were taken.
    pub closures: u32,
    /// Closures that were farther off than drift explains.
    pub refused: u32,
    /// Positions of --fixes that belong to a frame.
    pub fixes_given: usize,
    /// Number of these that the mapper took.
    pub fixes: u32,
    /// Closures and fixes that others contradicted.
    pub taken_out: u32,
    /// Times that poses of keyframes changed.
    pub moved: u32,
    /// Triangles of the map after all loops; absent where it was not written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub triangles: Option<u64>,
    /// Largest distance from a frame's position as driven to the one after all loops, m.
    pub largest_correction_m: f64,
    /// Distance between both positions of the last frame, m.
    pub end_correction_m: f64,
    /// Errors of the path after all loops, where true poses are known.
    #[serde(skip)]
    pub errors: Option<TrajectoryErrors>,
    /// Absolute trajectory error of that path, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ate_m: Option<f64>,
    /// Loops that hold the path at the end of the run.
    pub held: Vec<LoopRow>,
}

/// Loop between two frames that show one place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LoopRow {
    /// Earlier frame, by its row in the trajectory.
    pub from: u32,
    /// Later frame.
    pub to: u32,
    /// Distance between its motion and the true one, m, where true poses are known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_m: Option<f64>,
    /// Angle between both, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_deg: Option<f64>,
}

impl LoopRow {
    fn new(held: &HeldLoop, truth: Option<&[Transform]>) -> Self {
        let pose = |frame: u32| truth.and_then(|truth| truth.get(frame as usize));
        let error = pose(held.from_frame).zip(pose(held.to_frame)).map(|(from, to)| {
            let t_from_to = from.inverse() * *to;
            t_from_to.inverse() * held.t_from_to
        });
        Self {
            from: held.from_frame,
            to: held.to_frame,
            error_m: error.map(|error| error.distance_m()),
            error_deg: error.map(|error| error.angle_rad().to_degrees()),
        }
    }
}

/// Keyframe's motion from where it was driven to where loops put it.
struct Moved {
    row: usize,
    segment: MapSegment,
    t_closed_driven: Transform,
}

/// First rows of a path's parts, each in one segment of the map.
pub(super) type Parts = [(usize, MapSegment)];

fn segment_of(parts: &Parts, row: usize) -> MapSegment {
    let after = parts.partition_point(|(first, _)| *first <= row);
    parts.get(after.wrapping_sub(1)).map_or(MapSegment::FIRST, |(_, segment)| *segment)
}

/// Writes the path after all loops into the folder. `None` where no loop moved anything.
///
/// # Errors
/// A file of the folder cannot be read or written.
pub(super) fn write(
    folder: &Path,
    parts: &Parts,
    loops: &ClosedLoops,
    truth: Option<&[Transform]>,
) -> Result<Option<LoopSection>, ObserveError> {
    let counts = loops.counts;
    if counts.closures + counts.refused == 0 && loops.fixes_given == 0 {
        return Ok(None);
    }
    let section = LoopSection {
        closures: counts.closures,
        refused: counts.refused,
        fixes_given: loops.fixes_given,
        fixes: counts.fixes,
        taken_out: counts.taken_out,
        moved: counts.moved,
        triangles: loops.triangles,
        largest_correction_m: 0.0,
        end_correction_m: 0.0,
        errors: None,
        ate_m: None,
        held: loops.held.iter().map(|held| LoopRow::new(held, truth)).collect(),
    };
    if counts.moved == 0 {
        return Ok(Some(section));
    }
    let path = folder.join(TRAJECTORY_FILE);
    let driven = read_poses(&path)
        .map_err(|error| ObserveError::Changed { path, reason: error.to_string() })?
        .poses;
    let closed = closed_poses(&driven, parts, loops);
    let path = folder.join(TIMED_TRAJECTORY_FILE);
    let times = fs::read_to_string(&path)
        .map_err(|error| ObserveError::Changed { path, reason: error.to_string() })?;
    let times = times.lines().filter_map(|line| line.split(' ').next());
    let kitti: String = closed.iter().map(kitti_line).collect();
    let tum: String = times.zip(&closed).map(|(time, pose)| tum_row(time, pose)).collect();
    for (name, text) in [(CLOSED_TRAJECTORY_FILE, kitti), (TIMED_CLOSED_TRAJECTORY_FILE, tum)] {
        let path = folder.join(name);
        owned::write(&path, text.as_bytes())
            .map_err(|source| ObserveError::Write { path, source })?;
    }
    let moved_m = |row: usize| {
        let [a, b] = [&driven, &closed].map(|poses| Vector3::from(poses[row].translation_m));
        (a - b).norm()
    };
    let errors = truth.and_then(|truth| {
        let first = |&row: &usize| segment_of(parts, row) == MapSegment::FIRST;
        let compared: Vec<Transform> =
            (0..closed.len()).filter(first).map(|row| closed[row]).collect();
        errors(truth, &compared)
    });
    Ok(Some(LoopSection {
        largest_correction_m: (0..closed.len()).map(moved_m).fold(0.0, f64::max),
        end_correction_m: closed.len().checked_sub(1).map_or(0.0, moved_m),
        ate_m: errors.as_ref().map(|errors| errors.ate_m),
        errors,
        ..section
    }))
}

/// Poses after all loops.
fn closed_poses(driven: &[Transform], parts: &Parts, loops: &ClosedLoops) -> Vec<Transform> {
    let moved: Vec<Moved> = loops
        .keyframes
        .iter()
        .filter_map(|keyframe| {
            let row = keyframe.frame as usize;
            let shown = shown_pose(keyframe.pose.segment, &keyframe.pose.t_world_camera);
            Some(Moved {
                row,
                segment: segment_of(parts, row),
                t_closed_driven: shown * driven.get(row)?.inverse(),
            })
        })
        .collect();
    let closed = |(row, pose): (usize, &Transform)| {
        let after = moved.partition_point(|keyframe| keyframe.row < row);
        let segment = segment_of(parts, row);
        let of_segment = |at: usize| moved.get(at).filter(|keyframe| keyframe.segment == segment);
        match (after.checked_sub(1).and_then(of_segment), of_segment(after)) {
            (Some(before), Some(after)) => {
                let share = (row - before.row) as f64 / (after.row - before.row) as f64;
                let ends = [before, after].map(|keyframe| keyframe.t_closed_driven * *pose);
                between(&ends, share)
            }
            (Some(one), None) | (None, Some(one)) => one.t_closed_driven * *pose,
            (None, None) => *pose,
        }
    };
    driven.iter().enumerate().map(closed).collect()
}

/// Pose between two, at a share of the way from the first.
fn between([from, to]: &[Transform; 2], share: f64) -> Transform {
    let [start, end] = [from, to].map(|pose| {
        let [x, y, z, w] = pose.rotation;
        UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
    });
    let rotation = start.try_slerp(&end, share, 1e-9).unwrap_or(start);
    let [start, end] = [from, to].map(|pose| Vector3::from(pose.translation_m));
    Transform { rotation: rotation.coords.into(), translation_m: start.lerp(&end, share).into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dynvox_core::places::SegmentPose;
    use tempfile::TempDir;

    fn ahead(m: f64) -> Transform {
        Transform::from_translation([0.0, 0.0, m])
    }

    /// Keyframe of frame `frame` that loops put `m` metres ahead.
    fn keyframe(frame: u32, m: f64) -> CorrectedKeyframe {
        let pose = SegmentPose { segment: MapSegment::FIRST, t_world_camera: ahead(m) };
        CorrectedKeyframe { frame, pose }
    }

    #[test]
    fn frames_move_with_the_keyframes_around_them() {
        let folder = TempDir::new().unwrap();
        let driven: Vec<Transform> = (0..8).map(|at| ahead(f64::from(at))).collect();
        let rows: String = driven.iter().map(kitti_line).collect();
        fs::write(folder.path().join(TRAJECTORY_FILE), rows).unwrap();
        let timed: String = (0..8).map(|at| tum_row(&format!("{at}.5"), &driven[at])).collect();
        fs::write(folder.path().join(TIMED_TRAJECTORY_FILE), timed).unwrap();
        // The camera drove 2 m too far from frame 2 on; the last frames are of another segment.
        let loops = ClosedLoops {
            keyframes: vec![keyframe(1, 1.0), keyframe(5, 3.0)],
            counts: LoopCounts { closures: 1, moved: 1, ..LoopCounts::default() },
            triangles: None,
            // The true way from frame 1 to frame 5 is 2 m; the loop says 2.1 m.
            held: vec![HeldLoop { from_frame: 1, to_frame: 5, t_from_to: ahead(2.1) }],
            fixes_given: 0,
        };
        let parts = [(0, MapSegment::FIRST), (7, MapSegment::new(1))];
        let truth: Vec<Transform> = [0.0, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0].map(ahead).to_vec();
        let section = write(folder.path(), &parts, &loops, Some(&truth)).unwrap().unwrap();
        let path = folder.path().join(CLOSED_TRAJECTORY_FILE);
        let closed = read_poses(&path).unwrap().poses;
        for (pose, truth) in closed.iter().zip(&truth) {
            assert!((pose.inverse() * *truth).distance_m() < 1e-9, "{closed:?}");
        }
        assert_eq!(closed[7], driven[7], "nothing is known of another segment");
        assert!(section.ate_m.unwrap() < 1e-9 && section.largest_correction_m == 2.0);
        let row = section.held[0];
        assert!((row.from, row.to) == (1, 5) && (row.error_m.unwrap() - 0.1).abs() < 1e-9);
        let timed = fs::read_to_string(folder.path().join(TIMED_CLOSED_TRAJECTORY_FILE)).unwrap();
        assert!(timed.lines().nth(5).unwrap().starts_with("5.5 0.0 0.0 3.0"), "{timed}");
    }

    #[test]
    fn a_run_without_loops_writes_nothing() {
        let folder = TempDir::new().unwrap();
        let section = write(folder.path(), &[], &ClosedLoops::default(), None).unwrap();
        assert!(section.is_none() && fs::read_dir(folder.path()).unwrap().next().is_none());
    }
}
