//! Two trajectories, matched: by time, or row by row.

use crate::formats::{FRAMES_FILE, FormatError, TIMED_TRAJECTORY_FILE, Trajectory, read_poses};
use dynvox_core::geometry::Transform;
use std::path::{Path, PathBuf};

/// Two poses are of the same frame when their times differ by at most this, s (as `evo` has it).
const SAME_TIME_S: f64 = 0.01;

#[derive(serde::Deserialize)]
struct FrameNumber {
    frame: usize,
}

/// Reason why trajectories cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum TrajectoryError {
    /// A file cannot be read as poses.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// Lists of different lengths.
    #[error(
        "the first has {first} poses, the second {second}, and they cannot be matched by time. \
         Give TUM files, or files of the same frames"
    )]
    Lengths {
        /// Poses of the first.
        first: usize,
        /// Poses of the second.
        second: usize,
    },
    /// A run's table of frames cannot be read.
    #[error("{path} cannot be read: {reason}. Give its trajectory_tum.txt and true poses with \
             times", path = .path.display())]
    Frames {
        /// The table.
        path: PathBuf,
        /// Reason, as it completes the message's sentence.
        reason: String,
    },
    /// The true poses end before the run does.
    #[error(
        "the run mapped frame {frame}, and the true poses have {rows} rows. Give those of the \
         whole sequence, one row for each of its frames"
    )]
    NoRow {
        /// Number of the frame.
        frame: usize,
        /// Rows there are.
        rows: usize,
    },
    /// Fewer than two pairs.
    #[error(
        "only {pairs} poses have the same time: two are needed. Times must agree to {SAME_TIME_S} \
         s; check that both use the same clock"
    )]
    Few {
        /// Pairs found.
        pairs: usize,
    },
}

/// Numbers of a run folder's frames in its data set; `None` where `path` is no such folder.
///
/// # Errors
/// The run's table of frames cannot be read.
pub fn frames_of_run(path: &Path) -> Result<Option<Vec<usize>>, TrajectoryError> {
    let table = path.join(FRAMES_FILE);
    if !table.is_file() {
        return Ok(None);
    }
    let unreadable = |error: csv::Error| TrajectoryError::Frames {
        path: table.clone(),
        reason: error.to_string(),
    };
    let mut rows = csv::Reader::from_path(&table).map_err(unreadable)?;
    let frames: Result<Vec<usize>, _> =
        rows.deserialize().map(|row| row.map(|FrameNumber { frame }| frame)).collect();
    frames.map(Some).map_err(unreadable)
}

/// The rows of `truth` that belong to these frames: KITTI's rows are numbered as a data set's
/// frames. All of them where they have times, or are as many as the frames.
///
/// # Errors
/// There is no row for a frame.
pub fn truth_of_frames(truth: Trajectory, frames: &[usize]) -> Result<Trajectory, TrajectoryError> {
    if truth.times_s.is_some() || truth.poses.len() == frames.len() {
        return Ok(truth);
    }
    let row = |&frame: &usize| {
        truth
            .poses
            .get(frame)
            .copied()
            .ok_or(TrajectoryError::NoRow { frame, rows: truth.poses.len() })
    };
    Ok(Trajectory { times_s: None, poses: frames.iter().map(row).collect::<Result<_, _>>()? })
}

/// Reads a file of either format; of a run folder its own trajectory.
///
/// # Errors
/// The file cannot be read, or a line is not a pose.
pub fn read_trajectory(path: &Path) -> Result<Trajectory, TrajectoryError> {
    let path = if path.is_dir() { path.join(TIMED_TRAJECTORY_FILE) } else { path.to_path_buf() };
    Ok(read_poses(&path)?)
}

/// The poses of both that are of the same frame: by time where both have times, otherwise row by
/// row.
///
/// # Errors
/// The poses cannot be matched, or fewer than two can.
pub fn matched(
    first: &Trajectory,
    second: &Trajectory,
) -> Result<(Vec<Transform>, Vec<Transform>), TrajectoryError> {
    let pairs: Vec<(Transform, Transform)> = match (&first.times_s, &second.times_s) {
        (Some(times), Some(others)) => {
            let nearest = |time: &f64| {
                let at = others
                    .iter()
                    .enumerate()
                    .min_by(|a, b| (a.1 - time).abs().total_cmp(&(b.1 - time).abs()))?;
                // A pose farther away in time belongs to another frame.
                ((at.1 - time).abs() <= SAME_TIME_S)
                    .then(|| second.poses.get(at.0).copied())
                    .flatten()
            };
            times
                .iter()
                .zip(&first.poses)
                .filter_map(|(time, pose)| Some((*pose, nearest(time)?)))
                .collect()
        }
        // Without times the files must correspond row by row.
        _ if first.poses.len() == second.poses.len() => {
            first.poses.iter().copied().zip(second.poses.iter().copied()).collect()
        }
        _ => {
            return Err(TrajectoryError::Lengths {
                first: first.poses.len(),
                second: second.poses.len(),
            });
        }
    };
    // One pose has no motion to compare.
    if pairs.len() < 2 {
        return Err(TrajectoryError::Few { pairs: pairs.len() });
    }
    Ok(pairs.into_iter().unzip())
}
