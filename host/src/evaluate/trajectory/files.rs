//! Two trajectories, matched: by time, or row by row.

use super::association::{SAME_TIME_S, associated};
use super::travelled::travelled_m;
use crate::formats::{FRAMES_FILE, FormatError, TIMED_TRAJECTORY_FILE, Trajectory, read_poses};
use dynvox_core::geometry::Transform;
use std::path::{Path, PathBuf};

/// A true path shorter than this has no direction to align and no length to measure by, m.
const STANDING_M: f64 = 1e-3;

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
    /// The true path stands still.
    #[error(
        "the true path is {length_m} m long: it stands still, and nothing can be aligned or \
         measured by its length. Give the poses of a camera that moves"
    )]
    Standing {
        /// Length, m.
        length_m: f64,
    },
    /// Fewer than two pairs.
    #[error(
        "too few poses are of the same time: {pairs}, where two are needed. Times must agree to \
         {SAME_TIME_S} s; check that both use the same clock"
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
    // The table of another program, or cut short.
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
    let by_row = truth.numbers.is_none();
    // Times match by themselves, and equal counts row by row.
    if truth.times_s.is_some() || (by_row && truth.poses.len() == frames.len()) {
        return Ok(truth);
    }
    let row = |&frame: &usize| {
        truth.of_frame(frame).ok_or(TrajectoryError::NoRow { frame, rows: truth.poses.len() })
    };
    let poses = frames.iter().map(row).collect::<Result<_, _>>()?;
    Ok(Trajectory { poses, notes: truth.notes, ..Trajectory::default() })
}

/// Reads a file of either format; of a run folder its own trajectory.
///
/// # Errors
/// The file cannot be read, or a line is not a pose.
pub fn read_trajectory(path: &Path) -> Result<Trajectory, TrajectoryError> {
    let path = if path.is_dir() { path.join(TIMED_TRAJECTORY_FILE) } else { path.to_path_buf() };
    Ok(read_poses(&path)?)
}

/// Poses of two trajectories that are of the same frames.
#[derive(Clone, Debug, Default)]
pub struct MatchedPoses {
    /// Poses of the first.
    pub first: Vec<Transform>,
    /// Poses of the second, one for each.
    pub second: Vec<Transform>,
    /// Poses that each of the trajectories has.
    pub of: [usize; 2],
}

/// The poses of both that are of the same frame: by time where both have times, by number where
/// both have numbers, otherwise row by row.
///
/// # Errors
/// They cannot be matched, fewer than two can, or the second, the true one, does not move.
pub fn matched(first: &Trajectory, second: &Trajectory) -> Result<MatchedPoses, TrajectoryError> {
    let of = [first.poses.len(), second.poses.len()];
    let pairs: Vec<(usize, usize)> = match (&first.times_s, &second.times_s) {
        (Some(times_s), Some(others_s)) => associated(times_s, others_s),
        _ => match [&first.numbers, &second.numbers] {
            [Some(numbers), Some(others)] => (0..)
                .zip(numbers)
                .filter_map(|(at, number)| Some((at, others.binary_search(number).ok()?)))
                .collect(),
            // Rows without numbers are numbered from 0.
            [Some(numbers), None] if of[0] != of[1] => {
                (0..).zip(numbers.iter().copied()).filter(|(_, row)| *row < of[1]).collect()
            }
            [None, Some(numbers)] if of[0] != of[1] => {
                numbers.iter().copied().zip(0..).filter(|(row, _)| *row < of[0]).collect()
            }
            _ if of[0] == of[1] => (0..of[0]).map(|at| (at, at)).collect(),
            _ => return Err(TrajectoryError::Lengths { first: of[0], second: of[1] }),
        },
    };
    // One pose has no motion to compare.
    if pairs.len() < 2 {
        return Err(TrajectoryError::Few { pairs: pairs.len() });
    }
    let matched = MatchedPoses {
        first: pairs.iter().filter_map(|&(at, _)| first.poses.get(at).copied()).collect(),
        second: pairs.iter().filter_map(|&(_, at)| second.poses.get(at).copied()).collect(),
        of,
    };
    let length_m = travelled_m(&matched.second).last().copied().unwrap_or_default();
    if length_m < STANDING_M {
        return Err(TrajectoryError::Standing { length_m });
    }
    Ok(matched)
}
