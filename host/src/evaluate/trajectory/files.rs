//! Two trajectories, matched: by time, or row by row.

use crate::formats::{FormatError, Trajectory, read_poses};
use dynvox_core::geometry::Transform;
use std::path::Path;

/// Two poses are of the same frame when their times differ by at most this, s (as `evo` has it).
const SAME_TIME_S: f64 = 0.01;
/// File of a run folder that is read when a folder is given.
const OF_A_RUN: &str = "trajectory_tum.txt";

/// Why trajectories cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum TrajectoryError {
    /// A file cannot be read as poses.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// Lists of different lengths.
    #[error(
        "the first has {first} poses, the second {second}, and they cannot be matched by time. Give TUM files, or files of the same frames"
    )]
    Lengths {
        /// Poses of the first.
        first: usize,
        /// Poses of the second.
        second: usize,
    },
    /// Fewer than two pairs.
    #[error(
        "only {pairs} poses have the same time: two are needed. Times must agree to {SAME_TIME_S} s; check that both use the same clock"
    )]
    Few {
        /// Pairs found.
        pairs: usize,
    },
}

/// Reads a file of either format; of a run folder its own trajectory.
///
/// # Errors
/// The file cannot be read, or a line is not a pose.
pub fn read_trajectory(path: &Path) -> Result<Trajectory, TrajectoryError> {
    let path = if path.is_dir() { path.join(OF_A_RUN) } else { path.to_path_buf() };
    Ok(read_poses(&path)?)
}

/// The poses of both that are of the same frame: by time where both have times, otherwise row by row.
///
/// # Errors
/// They cannot be matched, or fewer than two can.
pub fn matched(first: &Trajectory, second: &Trajectory) -> Result<(Vec<Transform>, Vec<Transform>), TrajectoryError> {
    let pairs: Vec<(Transform, Transform)> = match (&first.times_s, &second.times_s) {
        (Some(times), Some(others)) => {
            let nearest = |time: &f64| {
                let at = others.iter().enumerate().min_by(|a, b| (a.1 - time).abs().total_cmp(&(b.1 - time).abs()))?;
                ((at.1 - time).abs() <= SAME_TIME_S).then(|| second.poses.get(at.0).copied()).flatten()
            };
            times.iter().zip(&first.poses).filter_map(|(time, pose)| Some((*pose, nearest(time)?))).collect()
        }
        _ if first.poses.len() == second.poses.len() => first.poses.iter().copied().zip(second.poses.iter().copied()).collect(),
        _ => return Err(TrajectoryError::Lengths { first: first.poses.len(), second: second.poses.len() }),
    };
    if pairs.len() < 2 {
        return Err(TrajectoryError::Few { pairs: pairs.len() });
    }
    Ok(pairs.into_iter().unzip())
}
