//! Rigid motion.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// A rigid transformation. `t_world_camera` maps camera coordinates to world coordinates.
pub type Transform = Isometry3<f64>;

/// The transformation that rotates by the vector `rotation_rad` (axis times angle) and then moves by `translation_m`.
pub fn exp(rotation_rad: Vector3<f64>, translation_m: Vector3<f64>) -> Transform {
    let angle = libm::sqrt(rotation_rad.dot(&rotation_rad));
    // Below 1e-9 rad the sine is its argument to the last bit.
    let (real, scale) = if angle > 1e-9 { (libm::cos(0.5 * angle), libm::sin(0.5 * angle) / angle) } else { (1.0, 0.5) };
    let quaternion = Quaternion::from_parts(real, rotation_rad * scale);
    renormalised(&Transform::from_parts(Translation3::from(translation_m), UnitQuaternion::new_unchecked(quaternion)))
}

/// The same motion with its quaternion brought back to length 1: long products drift.
pub fn renormalised(motion: &Transform) -> Transform {
    let q = motion.rotation.quaternion().coords;
    let length = libm::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    let unit = Quaternion::from(q / length);
    Transform::from_parts(motion.translation, UnitQuaternion::new_unchecked(unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_about_y_carries_z_to_x() {
        let turn = exp(Vector3::new(0.0, core::f64::consts::FRAC_PI_2, 0.0), Vector3::new(0.0, 0.0, 1.0));
        let moved = turn.transform_point(&nalgebra::Point3::new(0.0, 0.0, 2.0));
        assert!((moved - nalgebra::Point3::new(2.0, 0.0, 1.0)).norm() < 1e-12);
    }
}
