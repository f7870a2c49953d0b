//! Poses from a file, to be used in place of egomotion: KITTI (twelve numbers a line) or TUM (time, place, quaternion).

use super::{Dataset, DatasetError, error::read_failed, pose_of_row};
use dynvox_core::geometry::{Transform, renormalised};
use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use std::path::Path;

/// A pose this far in time from a frame is not its own, s.
const NEAR_S: f64 = 0.02;

/// Reads `t_world_camera` of each of the chosen frames. KITTI's lines are numbered as the images are, or count from the first frame where
/// there is one for each; TUM's belong to the frame whose time they are nearest to.
///
/// # Errors
/// The file cannot be read, a line is neither, or a frame has no pose.
pub fn read_given_poses(path: &Path, dataset: &dyn Dataset, indices: &[usize]) -> Result<Vec<Transform>, DatasetError> {
    let text = std::fs::read_to_string(path).map_err(read_failed(path))?;
    let refuse = |reason: String| DatasetError::Table {
        path: path.to_path_buf(),
        reason,
        action:
            "Give KITTI or TUM poses that cover every frame mapped, map fewer frames with --frames, or estimate them: --egomotion stereo"
                .into(),
    };
    let mut rows = Vec::new();
    for (at, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#')) {
        let numbers: Option<Vec<f64>> =
            line.split_whitespace().map(|word| word.parse().ok().filter(|value: &f64| value.is_finite())).collect();
        let row =
            numbers.and_then(Row::of).ok_or_else(|| refuse(format!("line {} holds neither 12 numbers (KITTI) nor 8 (TUM)", at + 1)))?;
        if rows.first().is_some_and(|first: &Row| first.time_s.is_some() != row.time_s.is_some()) {
            return Err(refuse(format!("line {} is of another kind than the first", at + 1)));
        }
        rows.push(row);
    }
    let timed = rows.first().is_some_and(|row| row.time_s.is_some());
    let number =
        |index: usize| dataset.stem(index).and_then(|stem| stem.parse().ok()).filter(|_| rows.len() != dataset.len()).unwrap_or(index);
    let find = |&index: &usize| {
        if !timed {
            let missing = || refuse(format!("it has {} poses, but frame {} is to be mapped", rows.len(), number(index)));
            return rows.get(number(index)).map(|row| row.pose).ok_or_else(missing);
        }
        let time_s = dataset.time_s(index);
        let apart = |row: &Row| (row.time_s.unwrap_or(f64::INFINITY) - time_s).abs();
        let nearest = rows.iter().min_by(|a, b| apart(a).total_cmp(&apart(b))).filter(|row| apart(row) <= NEAR_S);
        nearest.map(|row| row.pose).ok_or_else(|| refuse(format!("it has no pose within {NEAR_S} s of frame {index}, at {time_s} s")))
    };
    indices.iter().map(find).collect()
}

struct Row {
    time_s: Option<f64>,
    pose: Transform,
}

impl Row {
    fn of(numbers: Vec<f64>) -> Option<Self> {
        if let Ok(row) = <&[f64; 12]>::try_from(numbers.as_slice()) {
            return Some(Self { time_s: None, pose: pose_of_row(row) });
        }
        let [time_s, x, y, z, i, j, k, w] = *<&[f64; 8]>::try_from(numbers.as_slice()).ok()?;
        let quaternion = Quaternion::new(w, i, j, k);
        let pose = Transform::from_parts(Translation3::new(x, y, z), UnitQuaternion::new_unchecked(quaternion));
        (quaternion.norm() > 0.5).then(|| Self { time_s: Some(time_s), pose: renormalised(&pose) })
    }
}
