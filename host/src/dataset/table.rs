//! Text tables beside the images: times and poses.

use super::{DatasetError, error::read_failed};
use dynvox_core::geometry::{Transform, renormalised};
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};
use std::path::Path;

/// Reads `times.txt`: one time in seconds per line, increasing.
pub fn read_times(path: &Path) -> Result<Vec<f64>, DatasetError> {
    let rows = read_rows::<1>(path, "one time in seconds")?;
    let times: Vec<f64> = rows.iter().map(|[time]| *time).collect();
    if let Some(at) = times.windows(2).position(|pair| matches!(pair, [a, b] if a >= b)) {
        return Err(DatasetError::Table {
            path: path.to_path_buf(),
            reason: format!("the time on line {} is not after the one before it", at + 2),
            action: "Times must increase; without the file 10 Hz are assumed".into(),
        });
    }
    Ok(times)
}

/// Reads KITTI poses: 12 numbers per line, the rows of `t_world_camera`.
pub fn read_poses(path: &Path) -> Result<Vec<Transform>, DatasetError> {
    Ok(read_rows::<12>(path, "12 numbers, the rows of a 3 x 4 pose")?.iter().map(pose_of_row).collect())
}

/// The rigid motion of a KITTI pose row. Rounded rotations are brought back to length 1.
pub fn pose_of_row(row: &[f64; 12]) -> Transform {
    let [r00, r01, r02, x, r10, r11, r12, y, r20, r21, r22, z] = *row;
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::new(r00, r01, r02, r10, r11, r12, r20, r21, r22));
    renormalised(&Transform::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_rotation_matrix(&rotation)))
}

fn read_rows<const N: usize>(path: &Path, what: &str) -> Result<Vec<[f64; N]>, DatasetError> {
    let text = std::fs::read_to_string(path).map_err(read_failed(path))?;
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    lines
        .map(|(at, line)| {
            let numbers: Option<Vec<f64>> =
                line.split_whitespace().map(|word| word.parse().ok().filter(|value: &f64| value.is_finite())).collect();
            numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok()).ok_or_else(|| DatasetError::Table {
                path: path.to_path_buf(),
                reason: format!("line {} is not {what}", at + 1),
                action: "Correct the line, or move the file away: it is optional".into(),
            })
        })
        .collect()
}
