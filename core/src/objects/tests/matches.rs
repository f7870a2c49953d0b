//! Which matches count, and for which object.

use super::*;

const MASK: [u8; 3600] = [1; 3600];

fn car(left: i32, score: f32) -> Detection<'static> {
    detection(Class::Car, score, &PixelBox { left, top: 30, width: 60, height: 60 }, &MASK)
}

/// Points of an object that moves away from a standing camera by 0.2 m, seen in a band of the box
/// of `car(left, _)`, no two within 5 px.
fn points(count: u32, left: i32, top: i32, depth_m: f64) -> Vec<Match> {
    let seen = |n: u32| {
        let pixel = [
            f64::from(left) + 5.0 + f64::from(7 * n % 50),
            f64::from(top) + f64::from(13 * n % 20),
        ];
        let z = depth_m * (1.0 + 0.01 * f64::from(n % 5));
        let per_px = z / RIG.focal_px;
        let point = Point3::new(
            (pixel[0] - RIG.center_u_px) * per_px,
            (pixel[1] - RIG.center_v_px) * per_px,
            z,
        );
        let ([previous_left, previous_right], [current_left, current_right]) =
            (project(&point), project(&(point + Vector3::new(0.0, 0.0, 0.2))));
        Match { previous_left, previous_right, current_left, current_right }
    };
    (0..count).map(seen).collect()
}

/// Returns the number of matches that a car counts in its second frame.
fn counted(refined: &[Match], sparse: &[Match]) -> u32 {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        take_frame(instances, estimator, 0, &[car(100, 0.9)], [&[], &[]]);
        take_frame(instances, estimator, 1, &[car(100, 0.9)], [refined, sparse]);
        instances.tracks().next().unwrap().matches
    })
}

#[test]
fn a_match_that_leaves_the_mask_or_enters_it_is_not_counted() {
    let stays = points(20, 100, 35, 10.0);
    let aside = |[u, v]: [f32; 2]| [u + 100.0, v];
    let leaves = points(5, 100, 65, 10.0)
        .into_iter()
        .map(|m| Match { current_left: aside(m.current_left), ..m });
    let entering = points(5, 100, 65, 10.0).into_iter().map(|m| Match {
        previous_left: aside(m.previous_left),
        previous_right: aside(m.previous_right),
        ..m
    });
    let all: Vec<Match> = stays.iter().copied().chain(leaves).chain(entering).collect();
    assert_eq!([counted(&stays, &[]), counted(&all, &[])], [20; 2]);
}

#[test]
fn sparse_matches_fill_up_few_refined_ones_and_count_once() {
    let (few, sparse) = (points(20, 100, 35, 10.0), points(30, 100, 65, 10.0));
    assert_eq!(counted(&few, &sparse), 50);
    let again =
        |m: &Match| Match { current_left: [m.current_left[0] + 0.5, m.current_left[1]], ..*m };
    let with_doubles: Vec<Match> =
        sparse.iter().copied().chain(few.iter().take(5).map(again)).collect();
    assert_eq!(counted(&few, &with_doubles), 50, "the same feature says nothing new");
    assert_eq!(counted(&points(60, 100, 35, 10.0), &sparse), 60, "enough are enough");
}

#[test]
fn matches_through_windows_and_before_the_car_are_not_counted() {
    let own = points(20, 100, 35, 10.0);
    let behind = points(5, 100, 65, 60.0);
    let before = points(5, 100, 65, 3.0);
    for other in [behind, before] {
        let all: Vec<Match> = own.iter().copied().chain(other).collect();
        assert_eq!(counted(&all, &[]), 20);
    }
}

#[test]
fn an_object_seen_for_the_first_time_has_no_matches() {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        take_frame(instances, estimator, 0, &[car(100, 0.9)], [&[], &[]]);
        take_frame(instances, estimator, 1, &[car(250, 0.9)], [&points(30, 250, 35, 10.0), &[]]);
        let matches: Vec<(u32, u32)> =
            instances.tracks().map(|track| (track.id, track.matches)).collect();
        assert_eq!(matches, [(1, 0), (2, 0)]);
    });
}

/// A car that crosses at 8 m/s before a standing camera.
fn crossing(frame: u32) -> [Transform; 2] {
    [Transform::IDENTITY, shift(-2.0 + 0.8 * f64::from(frame), 0.2, 10.0)]
}

/// The car's track in the frame after `boards`, each shown in one frame.
fn after(config: &TrackingConfig, boards: &[Board]) -> TrackReport {
    with(&CAPACITY, config, |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        for (frame, board) in (0..).zip(boards) {
            let [camera, t_world_board] = crossing(frame);
            run.step(camera, &[(board, Some(t_world_board))]);
        }
        run.track(1).unwrap()
    })
}

#[test]
fn nine_matches_do_once_there_is_a_motion_to_go_by_and_eight_do_not() {
    let measured = |points| {
        after(&any_size(), &[Board::CAR, Board::CAR, Board::CAR, Board { points, ..Board::CAR }])
            .measured
    };
    assert_eq!([measured(8), measured(9)], [false, true]);
}

#[test]
fn the_motion_so_far_is_found_again_where_draws_alone_would_miss_it() {
    // One draw only, and two thirds of what is under the mask stands: three points of the car are
    // drawn once in 27 times.
    let config = TrackingConfig {
        motion: MotionConfig { samples: 1, ..MotionConfig::default() },
        ..any_size()
    };
    let hidden = Board { background: 40, ..Board::CAR };
    let track = after(&config, &[Board::CAR, Board::CAR, Board::CAR, hidden]);
    assert!(track.measured && (15..=25).contains(&track.inliers), "{} inliers", track.inliers);
    assert!((track.speed_m_s.unwrap()[0] - 8.0).abs() < 0.3, "{:?}", track.speed_m_s);
}

#[test]
fn four_times_as_many_matches_do_not_halve_sigma() {
    let config = TrackingConfig {
        motion: MotionConfig { camera_rad: 0.0, ..MotionConfig::default() },
        ..any_size()
    };
    let sigma = |points| {
        after(&config, &[Board { points, ..Board::CAR }, Board { points, ..Board::CAR }])
            .speed_m_s
            .unwrap()[1]
    };
    let [few, many] = [60, 240].map(sigma);
    assert!((many / few - 1.0).abs() < 0.2, "{few} and {many} m/s");
}

#[test]
fn a_slow_car_within_the_cameras_errors_is_not_called_moving() {
    let state = |motion: MotionConfig| {
        with(&CAPACITY, &TrackingConfig { motion, ..any_size() }, |instances, estimator| {
            let mut run = Run::new(instances, estimator);
            for frame in 0..8 {
                let t = 0.1 * f64::from(frame);
                run.step(
                    shift(0.0, 0.0, 6.0 * t),
                    &[(&Board::CAR, Some(shift(3.5, 0.3, 14.0 + 3.0 * t)))],
                );
            }
            run.track(1).unwrap().state
        })
    };
    let exact =
        MotionConfig { bias_px: 0.0, lens_px: 0.0, camera_rad: 0.0, ..MotionConfig::default() };
    assert_eq!(state(exact), MotionState::Dynamic);
    for poor in [
        MotionConfig { bias_px: 5.0, ..exact },
        MotionConfig { lens_px: 200.0, ..exact },
        MotionConfig { camera_rad: 0.02, ..exact },
    ] {
        assert_eq!(state(poor), MotionState::Uncertain, "{poor:?}");
    }
}

fn at(u: f32) -> Match {
    Match { current_left: [u, 60.0], ..Match::default() }
}

#[test]
fn a_match_belongs_to_its_copy_mask_where_delete_masks_overlap() {
    with(&CAPACITY, &any_size(), |instances, _| {
        // The first one's mask ends at 99, its delete mask at 105; the second's begins at 101.
        instances.ingest(0, &[car(40, 0.9), car(101, 0.5)], [WIDTH, HEIGHT]);
        instances.assign_matches(&[at(100.0), at(105.0)], &[]);
        assert_eq!(instances.tracker.test_match_owner(1), MatchOwner::Instance(1));
    });
}

/// Evidence of that speed without any uncertainty.
fn seen_at(speed_m_s: f32) -> Option<MotionEvidence> {
    Some(MotionEvidence { speed_m_s, sigma_m_s: 0.0, spread_m_s: 0.0, bias_m_s: 0.0 })
}

#[test]
fn a_small_object_takes_its_neighbours_matches_only_once_it_moves() {
    let instances = InstancesConfig {
        area_min_px: 1_000_000,
        track_area_min_px: 0,
        ..InstancesConfig::default()
    };
    let config = TrackingConfig { instances, ..TrackingConfig::default() };
    with(&CAPACITY, &config, |instances, _| {
        instances.ingest(0, &[car(40, 0.9), car(100, 0.5)], [WIDTH, HEIGHT]);
        instances.assign_matches(&[at(97.0)], &[]);
        assert_eq!(instances.tracker.test_match_owner(0), MatchOwner::Instance(0));
        let certain = StateConfig { confirm_frames: 1, ..StateConfig::default() };
        instances.tracker.test_tracks()[1].motion_state.update(&certain, seen_at(9.0));
        instances.assign_matches(&[at(97.0)], &[]);
        assert_eq!(instances.tracker.test_match_owner(0), MatchOwner::Ambiguous);
    });
}

#[test]
fn egomotion_uses_an_ambiguous_match_only_if_it_may_use_both_objects() {
    for (large_share, included) in [(1.0, true), (0.0, false)] {
        with(&CAPACITY, &TrackingConfig { large_share, ..any_size() }, |instances, _| {
            instances.ingest(0, &[car(40, 0.9), car(100, 0.5)], [WIDTH, HEIGHT]);
            instances.assign_matches(&[at(97.0)], &[]);
            assert_eq!(instances.tracker.test_match_owner(0), MatchOwner::Ambiguous);
            assert_eq!(instances.tracker.test_egomotion_includes(0), included);
        });
    }
}

#[test]
fn a_motion_is_not_made_of_two_points() {
    use crate::tracking::tests::{MotionFilter, Observation};
    let config = MotionConfig::default();
    let sighting = |x: f64| Observation {
        static_prediction: Point3::new(x, 0.0, 10.0),
        left: [30.0 * x, 0.0],
        right: [30.0 * x - 15.0, 0.0],
    };
    let retired = |count: usize| {
        let mut filter = MotionFilter::default();
        filter.predict(&config, 0.1);
        filter.update(
            &config,
            &RIG,
            &Transform::IDENTITY,
            0.1,
            0.3,
            [0.0, 1.0, 0.5].into_iter().take(count).map(sighting),
        )
    };
    assert_eq!([retired(2), retired(3)], [false, true]);
}
