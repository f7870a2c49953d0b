//! The finished map from behind and above the last camera, for report and viewer.

use super::{MapView, pictures};
use dynvox_core::geometry::Transform;

/// Position of the camera relative to the last camera, m: behind and above.
const OFFSET_M: [f64; 3] = [0.0, -7.0, -15.0];
/// Downward tilt of the overview's camera, rad.
const PITCH_RAD: f64 = 0.33;

/// The picture as a JPEG file; empty where the core refuses the pose.
pub fn overview(view: &mut dyn MapView<'_>, t_world_camera: &Transform) -> Vec<u8> {
    let down = nalgebra::Vector3::new(-PITCH_RAD, 0.0, 0.0);
    let pose = *t_world_camera * Transform::new(down, OFFSET_M);
    pictures::map(pictures::LARGE_PX, view, &pose).as_ref().map(pictures::jpeg).unwrap_or_default()
}
