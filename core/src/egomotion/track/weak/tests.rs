//! Estimates that determine all directions, or not all.

use super::*;
use crate::{egomotion::MotionCovariance, geometry::Transform};
use std::string::ToString;

/// An estimate of 3 m ahead and 0.2 m to the left, with these deviations to the right, down and
/// ahead, m.
fn estimate(sigma_m: [f64; 3]) -> MotionEstimate {
    let mut matrix = [[0.0; 6]; 6];
    for (axis, sigma) in (3..).zip(sigma_m) {
        matrix[axis][axis] = sigma * sigma;
    }
    MotionEstimate {
        t_current_previous: Some(Transform::from_translation([0.2, 0.0, -3.0])),
        covariance: Some(MotionCovariance::from_matrix(&matrix)),
        ..MotionEstimate::default()
    }
}

/// A camera that came 1 m ahead in each tenth of a second.
fn moving() -> Egomotion {
    Egomotion {
        t_current_previous: Transform::from_translation([0.0, 0.0, -1.0]),
        motion_s: 0.1,
        reference_s: 0.1,
        ..Egomotion::default()
    }
}

#[test]
fn the_last_motion_goes_on_along_a_weak_direction_only() {
    let held = moving().hold_weak_directions(estimate([0.01, 0.01, 0.6]));
    assert_eq!(held.weak.to_string(), "ahead");
    assert_eq!(held.t_current_previous.unwrap().translation_m, [0.2, 0.0, -1.0]);
    // Half a second after motions of a tenth it has gone five times as far.
    let late = Egomotion { reference_s: 0.5, ..moving() };
    let held = late.hold_weak_directions(estimate([0.6, 0.01, 0.6]));
    assert_eq!(held.weak.to_string(), "right, ahead");
    assert_eq!(held.t_current_previous.unwrap().translation_m, [0.0, 0.0, -5.0]);
}

#[test]
fn a_sound_estimate_and_a_first_one_stay_as_they_are() {
    let sound = estimate([0.02, 0.02, 0.02]);
    assert_eq!(moving().hold_weak_directions(sound), sound);
    let first = Egomotion::default().hold_weak_directions(estimate([0.01, 0.01, 0.6]));
    assert!(first.weak.ahead && first.t_current_previous == sound.t_current_previous);
}

#[test]
fn a_jump_is_not_hidden_by_the_last_motion() {
    let jump = estimate([0.01, 0.01, 0.2]);
    let held = moving().hold_weak_directions(jump);
    assert!(held.weak.ahead && held.t_current_previous == jump.t_current_previous);
}
