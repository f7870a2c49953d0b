//! The camera without images: what it expects, doubts, holds, and what its digest tells apart.

use super::*;
use std::vec::Vec;

fn ahead(way_m: f64) -> Transform {
    Transform::from_translation([0.0, 0.0, way_m])
}

fn is_near(found: &Transform, to: &Transform) -> bool {
    let difference = found.inverse() * to;
    difference.distance_m() < 1e-9 && difference.angle_rad() < 1e-9
}

/// A camera that came 1 m ahead in the last tenth of a second, by 100 inliers.
fn moving() -> Egomotion {
    Egomotion {
        t_current_previous: ahead(-1.0),
        motion_s: 0.1,
        inliers: 100,
        ..Egomotion::default()
    }
}

/// An estimate of so many inliers among 100 matches.
fn estimated(inliers: u32) -> MotionEstimate {
    MotionEstimate {
        status: MotionStatus::Estimated,
        t_current_previous: None,
        matches: 100,
        inliers,
        residual_rms_px: 0.5,
        covariance: None,
        anchored: false,
        weak: WeakDirections::default(),
        samples: 3,
        steps: 9,
        right_ahead: None,
    }
}

fn config() -> EgomotionConfig {
    EgomotionConfig {
        acceleration_max_m_s2: 16.0,
        inlier_share_strong: 0.5,
        right_ahead_max_m: 0.125,
        ..EgomotionConfig::default()
    }
}

#[test]
fn a_camera_accelerates_within_its_bound_and_the_noise() {
    let camera = moving();
    // In half a second at 10 m/s it comes 5 m ahead; 16 m/s² make 4 m of them more or less.
    for (way_m, can) in [(-5.0, true), (-9.05, true), (-9.15, false), (-0.95, true), (-0.85, false)]
    {
        assert_eq!(camera.can_accelerate_to(&config(), &ahead(way_m), 0.5), can, "{way_m} m");
    }
    assert!(
        camera.can_accelerate_to(&config(), &Transform::from_translation([4.05, 0.0, -5.0]), 0.5),
        "to the side as well"
    );
    assert!(!camera.can_accelerate_to(
        &config(),
        &Transform::from_translation([4.15, 0.0, -5.0]),
        0.5
    ));
    assert!(
        Egomotion { motion_s: 0.0, ..moving() }.can_accelerate_to(&config(), &ahead(900.0), 0.5),
        "nothing is known of its motion"
    );
    assert!(!camera.may_stand(&config(), 0.5) && camera.may_stand(&config(), 0.625));
}

#[test]
fn a_motion_is_doubted_where_few_matches_agree_on_what_cannot_be() {
    let doubt = |estimate: MotionEstimate, way_m: f64| {
        Egomotion { reference_s: 0.1, ..moving() }.doubt(&config(), &ahead(way_m), &estimate)
    };
    let (as_before, leap) = (-1.0, -3.0);
    assert_eq!([50, 49, 6].map(|inliers| doubt(estimated(inliers), as_before)), [None; 3]);
    assert_eq!(doubt(estimated(50), leap), None, "half of the matches agree");
    assert_eq!(doubt(estimated(49), leap), Some(MotionStatus::Implausible));
    // All of few, where there were many the frame before.
    let few = |count: u32| MotionEstimate { matches: count, ..estimated(count) };
    assert_eq!(doubt(few(25), leap), None);
    assert_eq!(doubt(few(24), leap), Some(MotionStatus::Implausible));
    // Cameras that do not expose at the same time.
    let late = |distance_m: f64, inliers: u32| MotionEstimate {
        right_ahead: Some(RightAhead { distance_m, sigma_m: 0.0 }),
        ..estimated(inliers)
    };
    assert_eq!(doubt(late(0.6, 90), as_before), Some(MotionStatus::Unsynchronized));
    assert_eq!(doubt(late(0.2, 90), as_before), None);
    assert_eq!(doubt(late(0.2, 40), as_before), Some(MotionStatus::Unsynchronized));
    assert_eq!(doubt(late(0.1, 40), as_before), None);
}

#[test]
fn what_few_matches_leave_open_is_doubted_after_a_gap_alone() {
    // 5 cm ahead with a deviation of 25 cm says nothing about synchrony.
    let open = MotionEstimate {
        right_ahead: Some(RightAhead { distance_m: 0.05, sigma_m: 0.25 }),
        ..estimated(40)
    };
    let doubt = |since_reference: u32| {
        let camera = Egomotion {
            since_reference,
            reference_s: 0.1 * f64::from(since_reference + 1),
            ..moving()
        };
        camera.doubt(&config(), &ahead(-1.0), &open)
    };
    assert_eq!(
        [0, 1, 2].map(doubt),
        [None, Some(MotionStatus::Unsynchronized), Some(MotionStatus::Unsynchronized)]
    );
}

#[test]
fn after_a_gap_few_inliers_do_not_prove_synchronous_cameras() {
    let doubt = |since_reference: u32, inliers: u32| {
        let camera = Egomotion {
            since_reference,
            reference_s: 0.1 * f64::from(since_reference + 1),
            ..moving()
        };
        let ahead_of = RightAhead { distance_m: 0.3, sigma_m: 0.1 };
        camera.doubt(
            &config(),
            &ahead(-1.0),
            &MotionEstimate { right_ahead: Some(ahead_of), matches: inliers, ..estimated(inliers) },
        )
    };
    // All matches agree, but a quarter as many as before must be left.
    assert_eq!(
        [25, 24].map(|inliers| doubt(1, inliers)),
        [None, Some(MotionStatus::Unsynchronized)]
    );
    assert_eq!([25, 24].map(|inliers| doubt(0, inliers)), [None; 2]);
}

#[test]
fn the_time_of_a_frame_is_its_share_of_the_time_since_the_reference() {
    // Three frames in 0.3 s: each may be 1 m ahead, and 16 m/s² of a tenth of a second make 0.16 m
    // more.
    let camera = Egomotion { since_reference: 2, reference_s: 0.3, ..moving() };
    let doubt = |way_m: f64| camera.doubt(&config(), &ahead(way_m), &estimated(10));
    assert_eq!([-1.25, -1.27].map(doubt), [None, Some(MotionStatus::Implausible)]);
}

#[test]
fn a_held_camera_expects_the_way_since_its_reference_and_one_frame_more() {
    let turn = Transform::new([0.0, 0.02, 0.0], [0.1, 0.0, -1.0]);
    let mut camera = Egomotion { t_current_previous: turn, motion_s: 0.1, ..Egomotion::default() };
    assert!(is_near(&camera.expected(), &turn));
    for frames in 1..MAX_REFERENCE_FRAMES {
        camera.hold(0.1);
        // One motion for each frame held, and one for the next.
        let whole = (0..=frames).fold(Transform::IDENTITY, |way, _| turn * way);
        assert!(is_near(&camera.expected(), &whole), "after {frames} frames");
        assert_eq!((camera.since_reference(), camera.extrapolated_frames()), (frames, frames));
        assert!((camera.reference_s - 0.1 * f64::from(frames)).abs() < 1e-6);
        let there = (0..frames).fold(Transform::IDENTITY, |way, _| way * turn.inverse());
        assert!(
            is_near(camera.t_world_camera(), &there)
                && is_near(&camera.t_world_reference, &Transform::IDENTITY)
        );
    }
    // One frame more than a reference is kept.
    camera.hold(0.1);
    assert!(
        camera.is_lost() && is_near(&camera.expected(), &turn),
        "the last frame is the reference now"
    );
    assert_eq!((camera.since_reference(), camera.reference_s), (0, 0.0));
}

#[test]
fn a_given_pose_tells_the_motion_and_ends_what_was_held() {
    let mut camera = moving();
    camera.hold(0.1);
    camera.advance(None);
    assert_eq!((camera.extrapolated_frames(), camera.since_reference()), (2, 0));
    let (before, pose) =
        (*camera.t_world_camera(), Transform::new([0.0, 0.3, 0.0], [2.0, 0.0, 5.0]));
    camera.set_pose(&pose);
    assert!(is_near(camera.t_world_camera(), &pose) && is_near(&camera.t_world_reference, &pose));
    // The motion told is that between the two poses.
    assert!(is_near(&(before * camera.t_current_previous().inverse()), &pose));
    assert_eq!((camera.extrapolated_frames(), camera.motion_s), (0, 0.0));
    camera.advance(Some(ahead(-0.5)));
    assert!(
        is_near(camera.t_world_camera(), &(pose * ahead(0.5))) && camera.extrapolated_frames() == 0
    );
    camera.begin_segment();
    assert_eq!((*camera.t_world_camera(), camera.segment().get()), (Transform::IDENTITY, 1));
    assert_eq!(camera.t_world_reference, Transform::IDENTITY);
}

#[test]
fn every_field_and_every_figure_of_the_estimate_is_in_the_digest() {
    // A change of each field, which must change the digest.
    let fields: [fn(&mut Egomotion); 11] = [
        |camera| camera.t_world_camera.translation_m[2] += 1.0,
        |camera| camera.t_world_reference.translation_m[2] += 1.0,
        |camera| camera.since_reference += 1,
        |camera| camera.reference_s += 1.0,
        |camera| camera.t_current_previous.rotation[1] += 0.1,
        |camera| camera.motion_s += 1.0,
        |camera| camera.inliers += 1,
        |camera| camera.extrapolated += 1,
        |camera| camera.segment = MapSegment::new(1),
        |camera| camera.newest_segment = MapSegment::new(1),
        |camera| camera.random = Random::new(1),
    ];
    let figures: [fn(&mut MotionEstimate); 6] = [
        |estimate| estimate.status = MotionStatus::Implausible,
        |estimate| estimate.matches += 1,
        |estimate| estimate.inliers += 1,
        |estimate| estimate.samples += 1,
        |estimate| estimate.steps += 1,
        |estimate| estimate.residual_rms_px += 1.0,
    ];
    let mut digests = Vec::from([moving().digest(None), moving().digest(Some(&estimated(9)))]);
    for change in fields {
        let mut camera = moving();
        change(&mut camera);
        digests.push(camera.digest(None));
    }
    for change in figures {
        let mut estimate = estimated(9);
        change(&mut estimate);
        digests.push(moving().digest(Some(&estimate)));
    }
    digests.sort_unstable();
    digests.dedup();
    // 17 changes, and the two unchanged ones.
    assert_eq!(digests.len(), 19, "each has its own");
}
