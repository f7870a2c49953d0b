//! Motions over ground, and what is not one.

use super::*;

/// A car 10 m ahead that does 8 m/s to the camera's 5.
fn ahead(frame: u32) -> [Transform; 2] {
    let t = f64::from(frame) * 0.1;
    [shift(0.0, 0.0, 5.0 * t), shift(1.0, 0.3, 10.0 + 8.0 * t)]
}

fn run(board: &Board, frames: u32, poses: impl Fn(u32) -> [Transform; 2]) -> Vec<TrackReport> {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        (0..frames)
            .map(|frame| {
                let [camera, car] = poses(frame);
                run.step(camera, &[(board, Some(car))]);
                run.track(1).unwrap()
            })
            .collect()
    })
}

#[test]
fn a_moving_cars_motion_is_its_own_and_not_the_cameras() {
    let tracks = run(&Board::CAR, 8, ahead);
    for track in &tracks[1..] {
        assert!(track.measured);
        let moved = track.motion_world.transform_point(Point3::from(track.center_world_m));
        let error = moved - Point3::from(track.center_world_m) - Vector3::new(0.0, 0.0, 0.8);
        assert!(error.norm() < 0.02, "{error}");
        assert!(track.motion_world.angle_rad().to_degrees() < 0.3);
    }
    let states: Vec<MotionState> = tracks.iter().map(|track| track.state).collect();
    assert_eq!(states[..3], [MotionState::Uncertain; 3]);
    assert_eq!(states[3..], [MotionState::Dynamic; 5]);
    let at = tracks[7].t_world_object.unwrap().translation()
        - tracks[3].t_world_object.unwrap().translation();
    assert!((at - Vector3::new(0.0, 0.0, 3.2)).norm() < 0.05, "{at}");
}

#[test]
fn a_parked_car_follows_the_camera_and_stays_where_it_is_in_the_world() {
    let tracks = run(&Board::CAR, 8, |frame| {
        [shift(0.0, 0.0, 0.5 * f64::from(frame)), shift(1.0, 0.3, 12.0)]
    });
    assert_eq!(tracks[7].state, MotionState::Static);
    assert_eq!(tracks[7].motion_world, Transform::IDENTITY);
    assert_eq!(
        tracks[7].t_world_object, tracks[0].t_world_object,
        "seen from the moving camera it moves, in the world it does not"
    );
}

#[test]
fn eleven_matches_make_no_first_motion_and_twelve_do() {
    let measured = |points| run(&Board { points, ..Board::CAR }, 2, ahead)[1].measured;
    assert_eq!([measured(11), measured(12)], [false, true]);
}

#[test]
fn two_fifths_of_background_under_the_mask_do_no_harm() {
    let tracks = run(&Board { background: 24, ..Board::CAR }, 6, ahead);
    assert!((tracks[5].speed_m_s.unwrap()[0] - 8.0).abs() < 0.2, "{:?}", tracks[5].speed_m_s);
    assert!(tracks[5].inliers <= 40);
}

#[test]
fn a_match_counts_only_from_mask_to_mask() {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        let [camera, car] = ahead(0);
        run.step(camera, &[(&Board::CAR, Some(car))]);
        let [camera, car] = ahead(1);
        run.step(camera, &[(&Board::CAR, Some(car))]);
        let pixels = run.track(1).unwrap().pixels;
        let delete = pixels.scaled(1200);
        let at = |u: i32, v: i32| Match { current_left: [u as f32, v as f32], ..Match::default() };
        let (last, beyond) = (delete.left, delete.left - 1);
        run.instances.assign_matches(
            &[
                at(last, pixels.top + 5),
                at(beyond, pixels.top + 5),
                at(pixels.left + 5, pixels.top + 5),
            ],
            &[],
        );
        assert_eq!(
            [0, 1, 2].map(|at| run.instances.tracker.test_match_owner(at)),
            [MatchOwner::Instance(0), MatchOwner::None, MatchOwner::Instance(0)]
        );
        run.instances
            .assign_matches(&[Match { current_left: [f32::NAN, 5.0], ..Match::default() }], &[]);
        assert_eq!(run.instances.tracker.test_match_owner(0), MatchOwner::None);
    });
}

#[test]
fn egomotion_excludes_moving_cars_and_large_ones_of_unknown_state() {
    let included = |config: &TrackingConfig,
                    frames: u32,
                    poses: &dyn Fn(u32) -> [Transform; 2],
                    board: &Board| {
        with(&CAPACITY, config, |instances, estimator| {
            let mut run = Run::new(instances, estimator);
            for frame in 0..frames {
                let [camera, car] = poses(frame);
                run.step(camera, &[(board, Some(car))]);
            }
            let pixels = run.track(1).unwrap().pixels;
            let middle = [pixels.left + pixels.width / 2, pixels.top + pixels.height / 2]
                .map(|px| px as f32);
            run.instances
                .assign_matches(&[Match { current_left: middle, ..Match::default() }], &[]);
            run.instances.tracker.test_egomotion_includes(0)
        })
    };
    let parked = |frame: u32| [shift(0.0, 0.0, 0.5 * f64::from(frame)), shift(1.0, 0.3, 12.0)];
    let config = any_size();
    assert!(!included(&config, 6, &ahead, &Board::CAR), "known to move");
    assert!(included(&config, 6, &parked, &Board::CAR), "known to stand");
    let small = Board { half_m: [0.9, 0.5], ..Board::CAR };
    assert!(included(&config, 1, &ahead, &small), "unknown and small");
    let large = Board { half_m: [2.5, 1.2], ..Board::CAR };
    assert!(!included(&config, 1, &ahead, &large), "unknown and large");
}

#[test]
fn starting_and_stopping_show_within_five_frames() {
    // Stands for eight frames, speeds up to 5 m/s within ten, then brakes to a stop within ten.
    let speed = |frame: u32| match frame {
        0..=8 => 0.0,
        9..=18 => 0.5 * f64::from(frame - 8),
        19..=28 => 5.0,
        29..=38 => 0.5 * f64::from(38 - frame),
        _ => 0.0,
    };
    let poses = |frame: u32| {
        [
            shift(0.0, 0.0, 0.3 * f64::from(frame)),
            shift(1.0, 0.3, 10.0 + (0..=frame).map(|n| 0.1 * speed(n)).sum::<f64>()),
        ]
    };
    let states: Vec<MotionState> =
        run(&Board::CAR, 50, poses).iter().map(|track| track.state).collect();
    let is =
        |state, range: core::ops::Range<usize>| range.clone().all(|frame| states[frame] == state);
    assert!(
        is(MotionState::Static, 4..9)
            && is(MotionState::Dynamic, 13..38)
            && is(MotionState::Static, 43..50),
        "{states:?}"
    );
}

#[test]
fn matches_on_the_silhouette_between_two_cars_are_ambiguous() {
    let mask = [1; 3600];
    let boxes = [
        PixelBox { left: 40, top: 30, width: 60, height: 60 },
        PixelBox { left: 100, top: 30, width: 60, height: 60 },
    ];
    with(&CAPACITY, &any_size(), |instances, _| {
        let cars = boxes.map(|pixels| detection(Class::Car, 0.5, &pixels, &mask));
        instances.ingest(0, &cars, [WIDTH, HEIGHT]);
        let at = |u: f32| Match { current_left: [u, 60.0], ..Match::default() };
        instances.assign_matches(&[at(90.0), at(97.0), at(102.0), at(110.0)], &[]);
        let of_match = |at| instances.tracker.test_match_owner(at);
        assert_eq!([of_match(1), of_match(2)], [MatchOwner::Ambiguous; 2]);
        assert_ne!(of_match(0), of_match(3));
        assert!(of_match(0) != MatchOwner::Ambiguous && of_match(3) != MatchOwner::Ambiguous);
    });
}

/// A board too small to be reconstructed, and its camera.
fn small_car(speed_m_s: f64) -> impl Fn(u32) -> [Transform; 2] {
    move |frame| {
        let t = f64::from(frame) * 0.1;
        [shift(0.0, 0.0, 5.0 * t), shift(1.0, 0.3, 14.0 + speed_m_s * t)]
    }
}

#[test]
fn a_small_object_is_reported_once_measured_and_masked_once_moving() {
    let instances = InstancesConfig {
        area_min_px: 1_000_000,
        track_area_min_px: 0,
        ..InstancesConfig::default()
    };
    let config = TrackingConfig { instances, ..TrackingConfig::default() };
    for (speed_m_s, state) in [(8.0, MotionState::Dynamic), (0.0, MotionState::Static)] {
        with(&CAPACITY, &config, |instances, estimator| {
            let mut run = Run::new(instances, estimator);
            for frame in 0..8 {
                let [camera, car] = small_car(speed_m_s)(frame);
                run.step(camera, &[(&Board::CAR, Some(car))]);
                assert_eq!(run.track(1).is_some(), frame > 0, "frame {frame}");
                let mut depth_m = vec![5.0; WIDTH * HEIGHT];
                run.instances
                    .mask_dynamic_depth(&mut ViewMut::new(&mut depth_m, WIDTH, HEIGHT).unwrap());
                let moves = run.track(1).is_some_and(|track| track.state == MotionState::Dynamic);
                assert_eq!(depth_m.contains(&0.0), moves, "frame {frame}");
            }
            assert_eq!(run.track(1).unwrap().state, state);
            assert_eq!(run.instances.objects().count(), 0, "never reconstructed");
        });
    }
}

#[test]
fn a_few_matches_on_what_hides_a_car_do_not_outweigh_its_own() {
    // A post much nearer than the car, in front of it, standing; its matches count the square of
    // sixteen times as much each.
    let board = Board { points: 40, ..Board::CAR };
    let post = Board { half_m: [0.04, 0.1], points: 6, ..Board::CAR };
    let speed = |with_post: bool| {
        with(&CAPACITY, &any_size(), |instances, estimator| {
            let mut run = Run::new(instances, estimator);
            for frame in 0..5 {
                let t = f64::from(frame) * 0.1;
                let (camera, car, t_world_post) = (
                    shift(0.0, 0.0, 2.0 * t),
                    shift(0.3, 0.2, 28.0 + 8.0 * t),
                    shift(0.04, 0.03, 4.0),
                );
                let posts = [(&post, Some(t_world_post))];
                run.step_behind(
                    camera,
                    &[(&board, Some(car))],
                    if with_post { &posts } else { &[] },
                );
            }
            run.track(1).unwrap().speed_m_s.unwrap()[0]
        })
    };
    assert!((speed(false) - 8.0).abs() < 0.2, "{}", speed(false));
    assert!((speed(true) - 8.0).abs() < 0.2, "{}", speed(true));
}
