//! Motions over ground, and what is not one.

mod errors;

use super::*;
use crate::tracking::tests::*;
use std::vec::Vec;

/// A car 10 m ahead that does 8 m/s to the camera's 5.
fn ahead(frame: u32) -> [Transform; 2] {
    let t = f64::from(frame) * 0.1;
    [shift(0.0, 0.0, 5.0 * t), shift(1.0, 0.3, 10.0 + 8.0 * t)]
}

fn run(board: &Board, frames: u32, poses: impl Fn(u32) -> [Transform; 2]) -> Vec<TrackReport> {
    with(&CAPACITY, &any_size(), |tracker, estimator| {
        let mut run = Run::new(tracker, estimator);
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
fn a_few_matches_on_what_hides_a_car_do_not_outweigh_its_own() {
    // A post much nearer than the car, in front of it, standing; its matches count the square of
    // sixteen times as much each.
    let board = Board { points: 40, ..Board::CAR };
    let post = Board { half_m: [0.04, 0.1], points: 6, ..Board::CAR };
    let speed = |with_post: bool| {
        with(&CAPACITY, &any_size(), |tracker, estimator| {
            let mut run = Run::new(tracker, estimator);
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
