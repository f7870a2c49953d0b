//! Keypoints of matches, as pixels.

use crate::geometry::scalar::floor_i32;

/// Returns true if two keypoints are one.
pub(in super::super) fn is_same_keypoint(a: [f32; 2], b: [f32; 2]) -> bool {
    let [u, v] = [a[0] - b[0], a[1] - b[1]];
    u * u + v * v < 2.0
}

/// The pixel a keypoint lies in; one outside every image for what is not a number.
pub(in super::super) fn pixel([u, v]: [f32; 2]) -> (i32, i32) {
    if !(u.is_finite() && v.is_finite()) {
        return (-1, -1);
    }
    (floor_i32(u + 0.5), floor_i32(v + 0.5))
}
