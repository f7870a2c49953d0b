//! Matches, samples and errors by which a motion is known.

use super::*;

/// A car that crosses at 8 m/s before a standing camera.
fn crossing(frame: u32) -> [Transform; 2] {
    [Transform::IDENTITY, shift(-2.0 + 0.8 * f64::from(frame), 0.2, 10.0)]
}

/// The car's track in the frame after `boards`, each shown in one frame.
fn after(config: &TrackingConfig, boards: &[Board]) -> TrackReport {
    with(&CAPACITY, config, |tracker, estimator| {
        let mut run = Run::new(tracker, estimator);
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
        with(&CAPACITY, &TrackingConfig { motion, ..any_size() }, |tracker, estimator| {
            let mut run = Run::new(tracker, estimator);
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
