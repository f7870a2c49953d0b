//! Poses and rotations with closed answers.

use super::*;
use crate::random::Random;
use nalgebra::{Isometry3, Point3, Translation3};

fn isometry(motion: &Transform) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(motion.translation()), motion.quaternion())
}

fn bits(motion: &Transform) -> [u64; 7] {
    let [x, y, z, w] = motion.rotation;
    let [a, b, c] = motion.translation_m;
    [x, y, z, w, a, b, c].map(f64::to_bits)
}

fn bits_of(motion: &Isometry3<f64>) -> [u64; 7] {
    let (q, t) = (motion.rotation.coords, motion.translation.vector);
    [q.x, q.y, q.z, q.w, t.x, t.y, t.z].map(f64::to_bits)
}

#[test]
fn equal_parts_of_a_small_motion_make_it_up() {
    let whole = Transform::new([0.02, -0.05, 0.01], [0.3, -0.1, 4.0]);
    let part = whole.part_of(5);
    assert!((part.angle_rad() * 5.0 - whole.angle_rad()).abs() < 1e-12);
    assert!((part.distance_m() * 5.0 - whole.distance_m()).abs() < 1e-12);
    // q and -q are one rotation; the part must take the shorter way for both.
    let negative = Transform { rotation: whole.rotation.map(|value| -value), ..whole };
    let difference = negative.part_of(5).inverse() * part;
    assert!(
        difference.angle_rad() < 1e-9 && difference.distance_m() < 1e-12,
        "both quaternions are one rotation"
    );
    // Without a rotation the part is exact.
    assert_eq!(
        Transform::from_translation([0.0, 0.0, 6.0]).part_of(3),
        Transform::from_translation([0.0, 0.0, 2.0])
    );
}

#[test]
fn every_operation_gives_the_bits_of_nalgebra() {
    let mut random = Random::new(5);
    let mut number = |scale: f64| scale * (f64::from(random.next_u32()) / 2_147_483_648.0 - 1.0);
    for round in 0..2_000 {
        // Every third turn is close to none, where its axis is hard to tell.
        let angle = if round % 3 == 0 { 1e-10 } else { 3.0 };
        let mut motion = || {
            Transform::new(
                [number(angle), number(angle), number(angle)],
                [number(50.0), number(2.0), number(900.0)],
            )
        };
        // To the bit, since digests are compared with recorded ones.
        let (a, b) = (motion(), motion());
        assert_eq!(bits(&(a * b)), bits_of(&(isometry(&a) * isometry(&b))));
        assert_eq!(bits(&a.inverse()), bits_of(&isometry(&a).inverse()));
        let point = Point3::new(number(9.0), number(9.0), number(9.0));
        assert_eq!(
            a.transform_point(point).coords.map(f64::to_bits),
            (isometry(&a) * point).coords.map(f64::to_bits)
        );
        assert_eq!(
            a.rotate(point.coords).map(f64::to_bits),
            (a.quaternion() * point.coords).map(f64::to_bits)
        );
        let matrix = a.quaternion().to_rotation_matrix();
        for (r, row) in a.rotation_matrix().iter().enumerate() {
            for (c, entry) in row.iter().enumerate() {
                assert_eq!(entry.to_bits(), matrix[(r, c)].to_bits());
            }
        }
        assert!((a.angle_rad() - a.quaternion().angle()).abs() < 1e-7 && a.is_rotation());
    }
}

#[test]
fn a_quarter_turn_about_y_carries_z_to_x() {
    let turn = Transform::new([0.0, core::f64::consts::FRAC_PI_2, 0.0], [0.0, 0.0, 1.0]);
    let [x, y, z] = turn.transform_point([0.0, 0.0, 2.0]);
    assert!((x - 2.0).abs() < 1e-12 && y.abs() < 1e-12 && (z - 1.0).abs() < 1e-12);
}

#[test]
fn a_step_is_taken_after_the_motion() {
    let motion = Transform::new([0.0, 0.3, 0.0], [1.0, 0.0, 2.0]);
    let step = motion.retract([0.1, 0.0, 0.0, 0.0, 0.0, 0.5]);
    assert_eq!(step, (Transform::new([0.1, 0.0, 0.0], [0.0, 0.0, 0.5]) * motion).normalized());
    assert_eq!(motion.retract([0.0; 6]).translation_m, motion.translation_m);
}

#[test]
fn only_unit_quaternions_are_rotations() {
    let of_length =
        |length: f64| Transform { rotation: [0.0, 0.0, 0.0, length], ..Transform::IDENTITY };
    assert!([1.0, 1.0 + 1e-6, -1.0].into_iter().all(|length| of_length(length).is_rotation()));
    for length in [0.0, 1e-200, 1e200, 0.99, 1.01, f64::NAN, f64::INFINITY] {
        assert!(!of_length(length).is_rotation(), "{length}");
    }
    assert!(of_length(1e200).is_finite() && !of_length(f64::NAN).is_finite());
    let lost = Transform::from_translation([0.0, f64::INFINITY, 0.0]);
    assert!(lost.is_rotation() && !lost.is_finite());
}
