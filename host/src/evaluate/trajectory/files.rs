//! Trajectories in files: KITTI's rows of twelve numbers, TUM's rows of time, place and quaternion.

use crate::dataset::pose_of_row;
use dynvox_core::geometry::{Transform, renormalised};
use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use std::path::{Path, PathBuf};

/// Two poses belong together when their times differ by at most this, s (as `evo` has it).
const SAME_TIME_S: f64 = 0.01;
/// File of a run folder that is read when a folder is given.
const OF_A_RUN: &str = "trajectory_tum.txt";

/// Poses from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// Times, s; `None` in KITTI's format.
    pub times_s: Option<Vec<f64>>,
    /// `t_world_camera` of each.
    pub poses: Vec<Transform>,
}

/// Why trajectories cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum TrajectoryError {
    /// The file cannot be read.
    #[error("{path} cannot be read: {source}. Give a file of poses, or a run folder")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the machine says.
        source: std::io::Error,
    },
    /// A line is no pose.
    #[error(
        "{path}: line {line} is no pose. A line holds 12 numbers (KITTI: the rows of t_world_camera) or 8 (TUM: time x y z qx qy qz qw), the same in every line"
    )]
    Line {
        /// The file.
        path: PathBuf,
        /// Its number, from 1.
        line: usize,
    },
    /// Lists that do not belong together.
    #[error(
        "the first has {first} poses, the second {second}, and without times in both nobody knows which belong together. Give TUM files, or files of the same frames"
    )]
    Lengths {
        /// Poses of the first.
        first: usize,
        /// Poses of the second.
        second: usize,
    },
    /// Fewer than two pairs.
    #[error("only {pairs} poses belong together: two are needed. Times must agree to {SAME_TIME_S} s; are both in the same clock?")]
    Few {
        /// Pairs found.
        pairs: usize,
    },
}

/// Reads a file of either format; of a run folder its own trajectory.
///
/// # Errors
/// The file cannot be read, or a line is no pose.
pub fn read_trajectory(path: &Path) -> Result<Trajectory, TrajectoryError> {
    let path = if path.is_dir() { path.join(OF_A_RUN) } else { path.to_path_buf() };
    let text = std::fs::read_to_string(&path).map_err(|source| TrajectoryError::Read { path: path.clone(), source })?;
    let (mut times_s, mut poses) = (Vec::new(), Vec::new());
    let rows = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'));
    for (line, row) in rows {
        let (time_s, pose) = pose(row).ok_or_else(|| TrajectoryError::Line { path: path.clone(), line })?;
        times_s.extend(time_s);
        poses.push(pose);
        if times_s.len() != if time_s.is_some() { poses.len() } else { 0 } {
            return Err(TrajectoryError::Line { path, line });
        }
    }
    Ok(Trajectory { times_s: (!times_s.is_empty()).then_some(times_s), poses })
}

fn pose(row: &str) -> Option<(Option<f64>, Transform)> {
    let words = row.split_whitespace().map(|word| word.parse().ok().filter(|value: &f64| value.is_finite()));
    let numbers: Vec<f64> = words.collect::<Option<_>>()?;
    if let Ok(row) = <[f64; 12]>::try_from(numbers.as_slice()) {
        return Some((None, pose_of_row(&row)));
    }
    let [time_s, x, y, z, i, j, k, w] = <[f64; 8]>::try_from(numbers.as_slice()).ok()?;
    let rotation = Quaternion::new(w, i, j, k);
    let pose = Transform::from_parts(Translation3::new(x, y, z), UnitQuaternion::new_unchecked(rotation));
    (rotation.norm() > 0.5).then(|| (Some(time_s), renormalised(&pose)))
}

/// The poses of both that belong together: by time where both have times, else row by row.
///
/// # Errors
/// They cannot be told to belong together, or fewer than two do.
pub fn together(first: &Trajectory, second: &Trajectory) -> Result<(Vec<Transform>, Vec<Transform>), TrajectoryError> {
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
