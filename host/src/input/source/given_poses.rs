//! Poses from a file, to be used instead of egomotion.

use super::{FrameSource, InputError};
use crate::formats::read_poses;
use dynvox_core::geometry::Transform;
use std::path::Path;

/// A pose this far in time from a frame is not its own, s.
const NEAR_S: f64 = 0.02;

/// Reads `t_world_camera` of each of the chosen frames. KITTI's lines are numbered as the images
/// are, or count from the first frame where there is one for each; TUM's belong to the frame whose
/// time they are nearest to.
///
/// # Errors
/// The file cannot be read as poses, or a frame has no pose.
pub fn read_given_poses(
    path: &Path,
    source: &dyn FrameSource,
    indices: &[usize],
) -> Result<Vec<Transform>, InputError> {
    let read = read_poses(path)?;
    let poses = &read.poses;
    let refuse = |reason: String| InputError::Table {
        path: path.to_path_buf(),
        reason,
        action: "Give KITTI or TUM poses that cover every frame mapped, map fewer frames with \
             --frames, or estimate them: --egomotion stereo"
            .into(),
    };
    let number = |index: usize| {
        source
            .stem(index)
            .and_then(|stem| stem.parse().ok())
            .filter(|_| read.numbers.is_some() || poses.len() != source.len())
            .unwrap_or(index)
    };
    let find = |&index: &usize| {
        if read.times_s.is_none() {
            let missing = || {
                refuse(format!(
                    "it has {} poses, but none for frame {}, which is to be mapped",
                    poses.len(),
                    number(index)
                ))
            };
            return read.of_frame(number(index)).ok_or_else(missing);
        }
        let time_s = source.time_s(index);
        read.near(time_s, NEAR_S).ok_or_else(|| {
            refuse(format!("it has no pose within {NEAR_S} s of frame {index}, at {time_s} s"))
        })
    };
    indices.iter().map(find).collect()
}
