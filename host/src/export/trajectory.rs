//! Trajectories as other tools read them. Numbers are written so that reading gives the same bits.

use dynvox_core::geometry::Transform;
use std::io::{self, Write};

/// KITTI: the twelve numbers of the rows of `t_world_camera`, one line a frame.
pub fn write_kitti(out: &mut impl Write, poses: &[Transform]) -> io::Result<()> {
    for pose in poses {
        let rotation = pose.rotation.to_rotation_matrix();
        let rows = rotation.matrix().row_iter().zip(pose.translation.vector.iter());
        let numbers = rows.flat_map(|(row, shift)| [row[0], row[1], row[2], *shift]);
        writeln!(out, "{}", joined(numbers))?;
    }
    Ok(())
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
