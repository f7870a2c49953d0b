//! The camera over frames that say nothing, leap, or are lost.

use super::*;

#[test]
fn a_dark_right_camera_repeats_the_last_motion() {
    let (mut flow_slab, mut slab) = (slab(), Box::new(Slab([0; BYTES])));
    let mut matcher = FlowMatcher::new_in(
        &CAPACITY,
        &mut Carver::new(&mut flow_slab.0, FlowMatcher::bytes(&CAPACITY)).unwrap(),
    );
    let mut estimator = estimator(&mut slab);
    let mut camera = Egomotion::default();
    let step = Transform::new(Vector3::zeros(), Vector3::new(0.0, 0.0, 0.4));
    let dark = vec![0; WIDTH * HEIGHT];
    let mut t_world_camera = Transform::IDENTITY;
    for frame in 0..4 {
        let [left, right] = see(&t_world_camera);
        // The right camera fails at the third frame, after one motion could be estimated.
        let right = if frame < 2 { &right } else { &dark };
        let view = |pixels| View::new(pixels, WIDTH, HEIGHT).unwrap();
        matcher.push(&SceneFlowConfig::default(), view(&left), view(right), &Serial);
        if frame > 0 {
            let estimate = camera.step(
                &EgomotionConfig::default(),
                &RIG,
                at_10_hz(matcher.bucketed()),
                &mut estimator,
            );
            let expected =
                if frame == 1 { MotionStatus::Estimated } else { MotionStatus::TooFewMatches };
            assert_eq!((estimate.status, camera.extrapolated_frames()), (expected, frame - 1));
            // A motion that cannot be estimated repeats the last one, which here is the true one.
            let (distance, _) = between(camera.t_current_previous(), &step.inverse());
            assert!(distance < 0.02);
        }
        t_world_camera = t_world_camera * step;
    }
    assert!(
        (camera.t_world_camera().translation().z - 1.2).abs() < 0.05,
        "three steps, two of them extrapolated"
    );
}

#[test]
fn after_dark_frames_the_camera_is_found_from_the_last_frame_seen() {
    let (mut flow_slab, mut slab) = (slab(), Box::new(Slab([0; BYTES])));
    let mut matcher = FlowMatcher::new_in(
        &CAPACITY,
        &mut Carver::new(&mut flow_slab.0, FlowMatcher::bytes(&CAPACITY)).unwrap(),
    );
    let mut estimator = estimator(&mut slab);
    let mut camera = Egomotion::default();
    let dark = vec![0; WIDTH * HEIGHT];
    let mut t_world_camera = Transform::IDENTITY;
    // The camera slows down while it sees nothing, so that the guesses are wrong.
    for (frame, metres) in [0.0, 0.3, 0.3, 0.1, 0.1].into_iter().enumerate() {
        t_world_camera = t_world_camera * Transform::from_translation([0.0, 0.0, metres]);
        let seen = see(&t_world_camera);
        let [left, right] =
            if frame == 2 || frame == 3 { [&dark, &dark] } else { [&seen[0], &seen[1]] };
        let view = |pixels| View::new(pixels, WIDTH, HEIGHT).unwrap();
        matcher.push(&SceneFlowConfig::default(), view(left), view(right), &Serial);
        if frame > 0 {
            camera.step(
                &EgomotionConfig::default(),
                &RIG,
                at_10_hz(matcher.bucketed()),
                &mut estimator,
            );
        }
        // As the tracker does: the frame before the dark ones stays the reference.
        if camera.since_reference() > 0 {
            matcher.keep_previous();
        }
        let (distance, _) = between(camera.t_world_camera(), &t_world_camera);
        let guessed = camera.extrapolated_frames() > 0;
        assert_eq!((guessed, camera.segment().get()), (frame == 2 || frame == 3, 0));
        // A guess is wrong by what the camera moved otherwise; afterwards the error must be gone.
        assert!(distance < if guessed { 0.3 } else { 0.03 }, "frame {frame}: {distance} m");
    }
    assert!(
        (camera.t_current_previous().distance_m() - 0.5 / 3.0).abs() < 0.02,
        "a frame's share of the motion since then"
    );
}

#[test]
fn the_time_of_frames_without_matches_counts_in_the_motion_over_them() {
    let mut slab = Box::new(Slab([0; BYTES]));
    let (mut estimator, mut camera, mut random) =
        (estimator(&mut slab), Egomotion::default(), Random::new(5));
    let config = EgomotionConfig::default();
    camera.step(&config, &RIG, at_10_hz(&matches(60, 0, &motion(), &mut random)), &mut estimator);
    // A frame without matches, of a tenth of a second.
    camera.hold(0.1);
    // The next matches span both frames.
    let over_two = matches(60, 30, &(motion() * motion()), &mut random);
    let estimate = camera.step(&config, &RIG, at_10_hz(&over_two), &mut estimator);
    assert_eq!(
        (estimate.status, camera.extrapolated_frames()),
        (MotionStatus::Estimated, 0),
        "half of the matches agree with what was expected"
    );
    assert!(between(camera.t_current_previous(), &motion()).0 < 0.05);
}

/// A camera that moved by `motion()` a frame, and what it makes of one of another motion with
/// `outliers` among 60 matches.
fn after_one_frame(then: &Transform, outliers: usize) -> (MotionEstimate, Egomotion) {
    let mut slab = Box::new(Slab([0; BYTES]));
    let (mut estimator, mut camera, mut random) =
        (estimator(&mut slab), Egomotion::default(), Random::new(5));
    let config = EgomotionConfig::default();
    let first = matches(60, 0, &motion(), &mut random);
    assert_eq!(
        camera.step(&config, &RIG, at_10_hz(&first), &mut estimator).status,
        MotionStatus::Estimated
    );
    let second = matches(60, outliers, then, &mut random);
    (camera.step(&config, &RIG, at_10_hz(&second), &mut estimator), camera)
}

#[test]
fn a_leap_is_believed_of_many_matches_that_agree_and_not_of_few() {
    // A metre back within a frame is more than the acceleration allows.
    let leap = motion() * Transform::from_translation([0.0, 0.0, -1.0]);
    let (estimate, camera) = after_one_frame(&leap, 30);
    assert_eq!(
        (estimate.status, estimate.t_current_previous, camera.extrapolated_frames()),
        (MotionStatus::Implausible, None, 1)
    );
    assert!(between(camera.t_current_previous(), &motion()).0 < 1e-3, "it moves on as before");
    assert_eq!(after_one_frame(&leap, 5).0.status, MotionStatus::Estimated);
    assert_eq!(
        after_one_frame(&motion(), 30).0.status,
        MotionStatus::Estimated,
        "half of the matches are enough for what was expected"
    );
    // Of 60 matches 50 are outliers: too few are left.
    assert_eq!(after_one_frame(&motion(), 50).0.status, MotionStatus::TooFewInliers);
}

#[test]
fn a_camera_stands_at_once_where_it_could_brake() {
    let config = EgomotionConfig::default();
    assert!(Egomotion::default().may_stand(&config, 0.1), "nothing is known of its motion");
    let (_, camera) = after_one_frame(&motion(), 0);
    let braked_m = config.acceleration_max_m_s2 * 0.1 * 0.1;
    assert!(motion().distance_m() > braked_m + 0.1);
    assert!(!camera.may_stand(&config, 0.1) && camera.may_stand(&config, 1.0));
}

#[test]
fn a_camera_lost_for_long_begins_a_segment_at_its_origin() {
    let mut camera = Egomotion::default();
    camera.set_pose(&Transform::from_translation([0.0, 0.0, 1.0]));
    // Until then the reference is kept, and each frame guesses the last motion again.
    for frame in 1..=MAX_REFERENCE_FRAMES {
        assert_eq!((camera.is_lost(), camera.since_reference()), (false, frame - 1));
        camera.hold(0.1);
    }
    // Lost: the guess goes on, and a segment begins only when told.
    for frame in 0..20 {
        assert_eq!(
            (camera.is_lost(), camera.segment().get(), camera.since_reference()),
            (true, 0, 0)
        );
        assert!(
            (camera.t_world_camera().translation_m[2]
                - 1.0
                - f64::from(MAX_REFERENCE_FRAMES + frame))
            .abs()
                < 1e-9
        );
        camera.hold(0.1);
    }
    camera.begin_segment();
    let second = MapSegment::new(1);
    assert_eq!((*camera.t_world_camera(), camera.segment()), (Transform::IDENTITY, second));
    let pose = Transform::from_translation([3.0, 0.0, 2.0]);
    camera.relocalize(&pose);
    // A pose that was found again belongs to the same segment.
    assert_eq!((*camera.t_world_camera(), camera.segment()), (pose, second));
}

#[test]
fn a_pose_given_after_a_loss_lies_in_the_first_segment() {
    let mut camera = Egomotion::default();
    camera.begin_segment();
    let motion = Transform::from_translation([0.0, 0.0, -1.0]);
    camera.advance(Some(motion));
    let given = Transform::from_translation([40.0, 0.0, 7.0]);
    camera.set_pose(&given);
    assert_eq!((*camera.t_world_camera(), camera.segment()), (given, MapSegment::FIRST));
    assert_eq!(*camera.t_current_previous(), motion, "no motion leads from one to the other");
    camera.begin_segment();
    assert_eq!(camera.segment(), MapSegment::new(2), "a number is used once");
}

#[test]
fn a_camera_stays_lost_where_no_number_is_left_for_a_segment() {
    let mut camera = Egomotion::default();
    // The upper half of the numbers is that of archived blocks.
    let last = MapSegment::new(u16::MAX / 2);
    (0..last.get()).for_each(|_| camera.begin_segment());
    assert_eq!((camera.segment(), camera.is_lost()), (last, false));
    camera.begin_segment();
    assert_eq!((camera.segment(), camera.is_lost()), (last, true));
}
