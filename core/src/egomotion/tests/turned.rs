//! A camera whose turn something else predicts, before views that tell it badly.

use super::*;
use crate::egomotion::{PredictedTurn, Turned};

/// Matches of points that move together, with some noise.
struct Group {
    count: usize,
    depths_m: [f64; 2],
    columns: [f64; 2],
    motion: Transform,
}

fn matches(seed: u64, groups: &[Group]) -> Vec<Match> {
    let mut random = Random::new(seed);
    let mut share = || random.fraction();
    let mut matches = Vec::new();
    for Group { count, depths_m, columns, motion } in groups {
        for _ in 0..*count {
            let mut within = |[low, high]: [f64; 2]| low + (high - low) * share();
            let z = within(*depths_m);
            let x = (within(*columns) - 0.5) * 2.0 * RIG.center_u_px / RIG.focal_px * z;
            let point = Point3::new(x, within([-0.3, 0.3]) * z, z);
            let mut noisy = |at: [f32; 2]| at.map(|at| at + 0.4 * (share() as f32 - 0.5));
            let [previous_left, previous_right] = project(&point).map(&mut noisy);
            let [current_left, current_right] =
                project(&motion.transform_point(point)).map(&mut noisy);
            matches.push(Match { previous_left, previous_right, current_left, current_right });
        }
    }
    matches
}

/// Motion of the camera in each frame: previous to current.
fn motion() -> Transform {
    Transform::new([0.0, 0.12, 0.0], [0.02, 0.0, -0.05])
}

const TURN_SIGMA_RAD: f64 = 0.002;

/// The motion as a unit predicts it, off by half of what it says.
fn predicted(way_sigma_m: Option<f64>) -> PredictedTurn {
    let off = Transform::new([0.0, 0.5 * TURN_SIGMA_RAD, 0.0], [0.0; 3]);
    let turned = Turned {
        t_before_now: (off * motion()).inverse(),
        variance: TURN_SIGMA_RAD * TURN_SIGMA_RAD,
    };
    PredictedTurn { last: turned, whole: Some(turned), way_sigma_m }
}

/// Steps a camera over views, the first ones of a world that stands still before it. Returns the
/// last estimate and the error of the last motion, m and rad.
fn last_of(views: &[Vec<Match>], predicted: Option<PredictedTurn>) -> (MotionEstimate, f64, f64) {
    let mut slab = Box::new(Slab([0; BYTES]));
    let (mut estimator, mut camera) = (estimator(&mut slab), Egomotion::default());
    let mut last = None;
    for view in views {
        camera.expect_turn(predicted);
        let timed = at_10_hz(view);
        last = Some(camera.step(&EgomotionConfig::default(), &RIG, timed, &mut estimator));
    }
    let (way_m, turn_degrees) = between(camera.t_current_previous(), &motion());
    (last.unwrap(), way_m, turn_degrees.to_radians())
}

const WORLD_M: [f64; 2] = [2.0, 8.0];

fn world(count: usize) -> Group {
    Group { count, depths_m: WORLD_M, columns: [0.0, 1.0], motion: motion() }
}

#[test]
fn somebody_who_fills_the_view_does_not_carry_a_camera_with_a_unit() {
    // He walks beside the camera and sways, and hides all but a bare wall, which has too few
    // matches for a rival of his motion.
    let sways = Transform::new([0.0, 0.015, 0.0], [0.06, 0.01, 0.01]) * motion();
    let close = Group { count: 80, depths_m: [1.2, 3.6], columns: [0.0, 1.0], motion: sways };
    let wall = Group { count: 20, depths_m: [4.0, 4.1], columns: [0.4, 1.0], motion: motion() };
    let views = [matches(1, &[world(240)]), matches(2, &[world(240)]), matches(3, &[wall, close])];
    let (_, way_m, turn_rad) = last_of(&views, None);
    assert!(way_m > 0.04 || turn_rad > 0.01, "images tell it badly: {way_m} m, {turn_rad} rad");
    for way_sigma_m in [None, Some(0.004)] {
        let (estimate, way_m, turn_rad) = last_of(&views, Some(predicted(way_sigma_m)));
        assert_eq!(estimate.status, MotionStatus::Estimated);
        assert!(way_m < 0.012 && turn_rad < 0.002, "{way_m} m, {turn_rad} rad");
    }
}

#[test]
fn a_turn_that_few_matches_tell_is_the_units_and_the_way_follows_it() {
    let few = |count, columns| {
        vec![matches(4, &[Group { count, depths_m: [3.0, 3.4], columns, motion: motion() }])]
    };
    let views = few(9, [0.45, 0.6]);
    let (_, way_m, turn_rad) = last_of(&views, None);
    let (estimate, way_with_m, turn_with_rad) = last_of(&views, Some(predicted(None)));
    assert!(turn_with_rad < 0.5 * turn_rad, "{turn_with_rad} of {turn_rad} rad");
    assert!(way_with_m < 0.5 * way_m, "{way_with_m} of {way_m} m");
    let sigma_rad = estimate.covariance.unwrap().angle_sigma_rad();
    assert!(
        sigma_rad < 3f64.sqrt() * TURN_SIGMA_RAD,
        "the covariance is that of both: {sigma_rad}"
    );
    assert!(turn_with_rad < 2.0 * sigma_rad, "{turn_with_rad} {sigma_rad}");
}

#[test]
fn a_turn_that_many_matches_tell_stays_theirs() {
    let views = vec![matches(5, &[world(300)])];
    let (_, _, turn_rad) = last_of(&views, None);
    let (_, _, turn_with_rad) = last_of(&views, Some(predicted(Some(0.004))));
    assert!(turn_with_rad < turn_rad + 0.1 * TURN_SIGMA_RAD, "{turn_with_rad} {turn_rad}");
}

#[test]
fn a_motion_that_contradicts_is_refused_if_there_is_none_near() {
    let other = Transform::new([0.0, 0.03, 0.0], [0.0; 3]) * motion();
    let views = vec![matches(
        6,
        &[Group { count: 200, depths_m: WORLD_M, columns: [0.0, 1.0], motion: other }],
    )];
    let (estimate, _, turn_rad) = last_of(&views, Some(predicted(None)));
    assert_eq!(estimate.status, MotionStatus::Implausible);
    assert!(estimate.t_current_previous.is_none() && turn_rad < TURN_SIGMA_RAD, "{turn_rad}");
}

#[test]
fn after_dark_frames_a_refused_motion_does_not_leave_the_camera_lost() {
    // Few matches with the frame before the dark, of something else; many from then on.
    let other = Transform::new([0.0, 0.05, 0.0], [0.0; 3]) * motion();
    let few = Group { count: 14, depths_m: WORLD_M, columns: [0.0, 1.0], motion: other };
    let views = [matches(7, &[world(200)]), Vec::new(), Vec::new(), matches(8, &[few])];
    let mut slab = Box::new(Slab([0; BYTES]));
    let (mut estimator, mut camera) = (estimator(&mut slab), Egomotion::default());
    let mut truth = Transform::IDENTITY;
    let mut since = Vec::new();
    for view in &views {
        // The turn since the frame before the dark adds up.
        let frames = camera.since_reference() + 1;
        let one = predicted(None);
        let whole = (1..frames).fold(one.last, |sum, _| sum.then(&one.last));
        camera.expect_turn(Some(PredictedTurn { whole: Some(whole), ..one }));
        camera.step(&EgomotionConfig::default(), &RIG, at_10_hz(view), &mut estimator);
        since.push(camera.since_reference());
        truth = truth * motion().inverse();
    }
    assert_eq!(since, [0, 1, 2, 0], "the guess that images follow is what they are matched with");
    assert_eq!(camera.extrapolated_frames(), 3, "and stays a guess");
    let (way_m, turn_degrees) = between(camera.t_world_camera(), &truth);
    assert!(way_m < 0.05 && turn_degrees < 0.5, "{way_m} m, {turn_degrees} degrees");
}
