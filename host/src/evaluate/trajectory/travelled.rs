//! Lengths of paths.

use dynvox_core::geometry::Transform;
use nalgebra::Vector3;

/// Distance travelled up to each frame, m.
pub fn travelled_m(poses: &[Transform]) -> Vec<f64> {
    let steps = poses.windows(2).map(|pair| {
        (Vector3::from(pair[1].translation_m) - Vector3::from(pair[0].translation_m)).norm()
    });
    std::iter::once(0.0)
        .chain(steps.scan(0.0, |sum, step| {
            *sum += step;
            Some(*sum)
        }))
        .collect()
}
