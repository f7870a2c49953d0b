//! Camera trajectories in text files, read and written: KITTI's rows of twelve numbers, TUM's rows
//! of time, position and quaternion.
//!
//! Numbers are written so that reading them gives the same bits.

use super::rows::{lines_of, numbers_of, seconds_text};
use super::{FormatError, read_text};
use dynvox_core::geometry::Transform;
use std::io::{self, Write};
use std::path::Path;

/// Poses from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// Times, s; `None` in KITTI's format.
    pub times_s: Option<Vec<f64>>,
    /// `t_world_camera` of each row.
    pub poses: Vec<Transform>,
}

/// Reads a file of either format. Empty lines and lines that begin with `#` are passed over.
///
/// # Errors
/// The file cannot be read, a line is not a pose, or lines of both formats are mixed.
pub fn read_poses(path: &Path) -> Result<Trajectory, FormatError> {
    let text = read_text(path)?;
    let (mut times_s, mut poses) = (Vec::new(), Vec::new());
    for (line, row) in lines_of(&text) {
        let refuse = |reason: &str| {
            FormatError::content(
                path,
                format!("line {line} {reason}"),
                "A line holds 12 numbers (KITTI: the rows of t_world_camera) or 8 (TUM: time x y z \
                 qx qy qz qw), the same in every line",
            )
        };
        let (time_s, pose) = numbers_of(row)
            .and_then(|numbers| pose_of(&numbers))
            .ok_or_else(|| refuse("is not a pose"))?;
        if !poses.is_empty() && time_s.is_some() == times_s.is_empty() {
            return Err(refuse("is of another format than the first"));
        }
        times_s.extend(time_s);
        poses.push(pose);
    }
    Ok(Trajectory { times_s: (!times_s.is_empty()).then_some(times_s), poses })
}

/// Reads poses of some frames as [`write_numbered`] writes them.
///
/// # Errors
/// The file cannot be read, or a line is not a number and a pose.
pub fn read_numbered(path: &Path) -> Result<Vec<(usize, Transform)>, FormatError> {
    let text = read_text(path)?;
    let pose = |row| {
        let numbers = numbers_of(row)?;
        let (frame, numbers) = numbers.split_first()?;
        Some((*frame as usize, pose_of(numbers)?.1))
    };
    let refuse = |line| {
        FormatError::content(
            path,
            format!("line {line} is not a frame and its pose"),
            "A line holds 13 numbers",
        )
    };
    lines_of(&text).map(|(line, row)| pose(row).ok_or_else(|| refuse(line))).collect()
}

/// Time, where the row has one, and pose. Rounded rotations are normalized to length 1.
fn pose_of(numbers: &[f64]) -> Option<(Option<f64>, Transform)> {
    if let &[r00, r01, r02, x, r10, r11, r12, y, r20, r21, r22, z] = numbers {
        let rotation = [[r00, r01, r02], [r10, r11, r12], [r20, r21, r22]];
        return Some((None, Transform::from_rotation_matrix(&rotation, [x, y, z]).normalized()));
    }
    let &[time_s, x, y, z, i, j, k, w] = numbers else { return None };
    let pose = Transform { rotation: [i, j, k, w], translation_m: [x, y, z] };
    pose.is_rotation().then(|| (Some(time_s), pose.normalized()))
}

/// KITTI: the twelve numbers of the rows of `t_world_camera`, one line a frame.
pub fn kitti_line(pose: &Transform) -> String {
    format!("{}\n", kitti_row(pose))
}

/// Poses of some frames only: the frame's number, then the twelve numbers of KITTI's row.
pub fn write_numbered(out: &mut impl Write, poses: &[(usize, Transform)]) -> io::Result<()> {
    poses.iter().try_for_each(|(frame, pose)| writeln!(out, "{frame} {}", kitti_row(pose)))
}

fn kitti_row(pose: &Transform) -> String {
    joined(pose.matrix_3x4().as_flattened().iter().copied())
}

/// TUM: `t x y z qx qy qz qw`, one line a frame. The time is in ns and written as seconds to the
/// last digit.
pub fn tum_line(time_ns: u64, pose: &Transform) -> String {
    format!(
        "{} {}\n",
        seconds_text(time_ns),
        joined(pose.translation_m.into_iter().chain(pose.rotation))
    )
}

fn joined(numbers: impl Iterator<Item = f64>) -> String {
    numbers.map(|number| format!("{number:?}")).collect::<Vec<_>>().join(" ")
}
