//! Small motions as six numbers: a rotation vector (rad), then a translation (m).

use super::dense::{factor, forward};
use crate::{egomotion::MotionCovariance, geometry::Transform};

pub(super) type Twist = [f64; 6];

/// Sine of half an angle below which the angle is twice the sine to the last bit.
const SMALL_SINE: f64 = 1e-9;

/// The step that takes the identity to a motion, as `Transform::retract` applies it.
pub(super) fn twist_of(motion: &Transform) -> Twist {
    let ([i, j, k, w], [x, y, z]) = (motion.rotation, motion.translation_m);
    let sine = libm::sqrt(i * i + j * j + k * k);
    // Of the two rotations that a quaternion and its negative stand for, the shorter one.
    let half_angle = libm::atan2(if w < 0.0 { -sine } else { sine }, libm::fabs(w));
    let scale = if sine > SMALL_SINE { 2.0 * half_angle / sine } else { 2.0 };
    [i * scale, j * scale, k * scale, x, y, z]
}

/// Twist of the camera's frame as one of the world's, in which a camera has a pose.
pub(super) fn in_world(twist: &Twist, t_world_camera: &Transform) -> Twist {
    let [a, b, c, x, y, z] = *twist;
    let [a, b, c]: [f64; 3] = t_world_camera.rotate([a, b, c]);
    let [x, y, z]: [f64; 3] = t_world_camera.rotate([x, y, z]);
    // A turn about the world's origin swings the camera.
    let [px, py, pz] = t_world_camera.translation_m;
    [a, b, c, x + py * c - pz * b, y + pz * a - px * c, z + px * b - py * a]
}

/// Covariance of the camera's frame as one of the world's.
pub(super) fn spread_in_world(
    covariance: &MotionCovariance,
    t_world_camera: &Transform,
) -> MotionCovariance {
    MotionCovariance::ZERO.after(covariance, t_world_camera)
}

/// Covariance of errors that are alike along all axes.
#[inline(never)]
pub(super) fn isotropic(rotation_rad: f64, translation_m: f64) -> MotionCovariance {
    let mut matrix = [[0.0; 6]; 6];
    for (at, row) in matrix.iter_mut().enumerate() {
        let sigma = if at < 3 { rotation_rad } else { translation_m };
        if let Some(entry) = row.get_mut(at) {
            *entry = sigma * sigma;
        }
    }
    MotionCovariance::from_matrix(&matrix)
}

/// Square of an error in standard deviations of all its directions. `None` where the covariance
/// leaves a direction without any error.
pub(super) fn squared(error: &Twist, covariance: &MotionCovariance) -> Option<f64> {
    let mut lower = covariance.lower();
    factor(&mut lower, error.len())?;
    let mut scaled = *error;
    forward(&lower, &mut scaled)?;
    Some(scaled.iter().map(|value| value * value).sum())
}

pub(super) fn add(sum: &mut Twist, twist: &Twist) {
    sum.iter_mut().zip(twist).for_each(|(sum, value)| *sum += value);
}

pub(super) fn difference(a: &Twist, b: &Twist) -> Twist {
    let mut left = *a;
    left.iter_mut().zip(b).for_each(|(value, other)| *value -= other);
    left
}

/// A covariance times a twist.
pub(super) fn times(spread: &MotionCovariance, twist: &Twist) -> Twist {
    core::array::from_fn(|row| spread.row(row).iter().zip(twist).map(|(a, b)| a * b).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_twist_is_the_step_to_its_motion() {
        for twist in [[0.3, -0.2, 0.1, 4.0, 5.0, -6.0], [0.0; 6], [0.0, 3.0, 0.0, 0.0, 1.0, 0.0]] {
            let motion = Transform::IDENTITY.retract(twist);
            let again = twist_of(&motion);
            assert!(twist.iter().zip(again).all(|(a, b)| (a - b).abs() < 1e-12), "{again:?}");
            let negative = Transform { rotation: motion.rotation.map(|part| -part), ..motion };
            assert_eq!(twist_of(&negative).map(f64::abs), again.map(f64::abs));
        }
    }

    #[test]
    fn a_small_step_of_the_camera_is_one_of_the_world() {
        let pose = Transform::new([0.2, -1.0, 0.4], [30.0, -4.0, 7.0]);
        let step = [1e-6, -2e-6, 3e-6, 2e-6, 1e-6, -1e-6];
        let moved = pose * Transform::IDENTITY.retract(step);
        let expected = twist_of(&(moved * pose.inverse()));
        let twist = in_world(&step, &pose);
        assert!(twist.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{twist:?}");
    }

    #[test]
    fn errors_count_in_standard_deviations() {
        let covariance = isotropic(0.1, 2.0);
        let squared = squared(&[0.1, 0.0, 0.0, 0.0, 4.0, 0.0], &covariance).unwrap();
        assert!((squared - 5.0).abs() < 1e-12);
        assert_eq!(super::squared(&[0.0; 6], &MotionCovariance::ZERO), None);
    }
}
