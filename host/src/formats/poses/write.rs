//! Trajectories written so that reading them gives the same bits.

use crate::formats::times::seconds_text;
use dynvox_core::geometry::Transform;
use std::io::{self, Write};

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
    tum_row(&seconds_text(time_ns), pose)
}

/// TUM's line with a time that is text already, s.
pub fn tum_row(time_s: &str, pose: &Transform) -> String {
    format!("{time_s} {}\n", joined(pose.translation_m.into_iter().chain(pose.rotation)))
}

fn joined(numbers: impl Iterator<Item = f64>) -> String {
    numbers.map(|number| format!("{number:?}")).collect::<Vec<_>>().join(" ")
}
