//! Trajectories as other tools read them. Numbers are written so that reading gives the same bits.

use dynvox_core::geometry::Transform;
use std::io::{self, Write};

/// KITTI: the twelve numbers of the rows of `t_world_camera`, one line a frame.
pub fn write_kitti(out: &mut impl Write, poses: &[Transform]) -> io::Result<()> {
    poses.iter().try_for_each(|pose| writeln!(out, "{}", row(pose)))
}

/// Poses of some frames only: the frame's number, then the twelve numbers of KITTI's row.
pub fn write_numbered(out: &mut impl Write, poses: &[(usize, Transform)]) -> io::Result<()> {
    poses.iter().try_for_each(|(frame, pose)| writeln!(out, "{frame} {}", row(pose)))
}

fn row(pose: &Transform) -> String {
    let rotation = pose.rotation.to_rotation_matrix();
    let rows = rotation.matrix().row_iter().zip(pose.translation.vector.iter());
    joined(rows.flat_map(|(row, shift)| [row[0], row[1], row[2], *shift]))
}

/// TUM: `t x y z qx qy qz qw`, one line a frame.
pub fn write_tum(out: &mut impl Write, times_s: &[f64], poses: &[Transform]) -> io::Result<()> {
    for (time, pose) in times_s.iter().zip(poses) {
        let (t, q) = (&pose.translation.vector, pose.rotation.quaternion());
        writeln!(out, "{}", joined([*time, t.x, t.y, t.z, q.i, q.j, q.k, q.w].into_iter()))?;
    }
    Ok(())
}

fn joined(numbers: impl Iterator<Item = f64>) -> String {
    numbers.map(|number| format!("{number:?}")).collect::<Vec<_>>().join(" ")
}
