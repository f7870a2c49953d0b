//! What happens to a thing that is not seen, or not measured, for a while.

use super::*;

/// A car 10 m ahead that does 8 m/s to the camera's 5.
fn ahead(frame: u32) -> [Transform; 2] {
    let t = f64::from(frame) * 0.1;
    [shift(0.0, 0.0, 5.0 * t), shift(1.0, 0.3, 10.0 + 8.0 * t)]
}

fn parked(frame: u32) -> [Transform; 2] {
    [shift(0.0, 0.0, 0.3 * f64::from(frame)), shift(1.0, 0.3, 14.0)]
}

/// Shows a car in the frames `shown` says and looks at each.
fn drive(frames: u32, place: fn(u32) -> [Transform; 2], shown: impl Fn(u32) -> bool, mut look: impl FnMut(u32, &Drive<'_, '_, '_>)) {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut drive = Drive::new(instances, estimator);
        for frame in 0..frames {
            let [camera, car] = place(frame);
            drive.step(camera, &[(&Board::CAR, shown(frame).then_some(car))]);
            look(frame, &drive);
        }
    });
}

#[test]
fn a_moving_car_goes_on_as_before_for_three_frames_and_a_parked_one_stands_for_five() {
    for (place, state, most) in [(ahead as fn(u32) -> [Transform; 2], MotionState::Dynamic, 3), (parked, MotionState::Static, 5)] {
        let mut states = Vec::new();
        let mut places = Vec::new();
        drive(
            13,
            place,
            |frame| frame < 6,
            |_, drive| {
                let track = drive.track(1).unwrap();
                states.push(track.state);
                places.push(track.t_world_object.map(|t_world_object| t_world_object.translation().z));
            },
        );
        let lost = 6 + most;
        assert!(states[5..lost].iter().all(|now| *now == state) && states[lost] == MotionState::Uncertain, "{states:?}");
        let step_m = if state == MotionState::Dynamic { 0.8 } else { 0.0 };
        for frame in 6..lost {
            let moved = places[frame].unwrap() - places[frame - 1].unwrap();
            assert!((moved - step_m).abs() < 0.02, "frame {frame}: {moved} m");
        }
        assert_eq!(places[lost], None, "nobody knows where it is");
    }
}

#[test]
fn the_middle_of_a_car_unseen_goes_on_with_it() {
    let mut middles = Vec::new();
    drive(8, ahead, |frame| frame < 6, |_, drive| middles.push(drive.track(1).unwrap().center_world_m[2]));
    // Of a frame with a motion it is where the middle was before it.
    let steps = [middles[6] - middles[5], middles[7] - middles[6]];
    assert!(steps.iter().all(|step| (step - 0.8).abs() < 0.05), "{steps:?}");
}

#[test]
fn what_waits_of_a_car_of_unknown_motion_goes_when_it_is_lost() {
    drive(
        4,
        ahead,
        |frame| frame < 3,
        |frame, drive| {
            assert_eq!(drive.instances.objects.crops.len(), [1, 2, 3, 0][frame as usize], "frame {frame}");
        },
    );
}

#[test]
fn a_car_that_stops_stays_where_it_stopped() {
    // 8 m/s until frame 8, then braking by 8 m/s within ten frames.
    let place = |frame: u32| {
        let speed = |n: u32| if n <= 8 { 8.0 } else { f64::from(18u32.saturating_sub(n)) * 0.8 };
        [Transform::IDENTITY, shift(0.5, 0.3, 7.0 + (1..=frame).map(|n| 0.1 * speed(n)).sum::<f64>())]
    };
    let mut last = None;
    drive(30, place, |_| true, |_, drive| last = drive.track(1));
    let track = last.unwrap();
    assert_eq!(track.state, MotionState::Static);
    let came = track.t_world_object.unwrap().translation().z;
    let drove = place(29)[1].translation().z - place(0)[1].translation().z;
    assert!((came / drove - 1.0).abs() < 0.1, "{came} of {drove} m");
}

#[test]
fn a_moving_car_is_not_fused_in_a_frame_without_a_motion_and_a_parked_one_is() {
    let silent = Board { points: 0, ..Board::CAR };
    for (place, fused) in [(ahead as fn(u32) -> [Transform; 2], [1, 0, 1]), (parked, [1, 1, 1])] {
        with(&CAPACITY, &any_size(), |instances, estimator| {
            let mut drive = Drive::new(instances, estimator);
            let mut count = Vec::new();
            for frame in 0..8 {
                let [camera, car] = place(frame);
                let board = if frame == 6 { &silent } else { &Board::CAR };
                count.push(drive.step(camera, &[(board, Some(car))]).objects.fused);
            }
            assert_eq!(count[5..], fused);
        });
    }
}

#[test]
fn nothing_is_kept_for_a_volume_while_the_camera_is_lost() {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut drive = Drive::new(instances, estimator);
        for frame in 0..10 {
            drive.known = frame >= 6;
            let [camera, car] = ahead(frame);
            let report = drive.step(camera, &[(&Board::CAR, Some(car))]).objects;
            assert_eq!((drive.instances.objects.crops.len(), report.fused), (0, u32::from(frame >= 6)), "frame {frame}");
        }
    });
}

#[test]
fn a_motion_that_comes_too_late_after_a_gap_restarts_the_volume_and_in_time_does_not() {
    let chains = |missed: u32| {
        let mut chains = 0;
        drive(
            16,
            ahead,
            |frame| !(6..6 + missed).contains(&frame),
            |_, drive| {
                chains = drive.instances.objects().next().map_or(0, |(summary, _)| summary.segment_id);
            },
        );
        chains
    };
    // The frame in which it is found again has no motion either: of dynamic_frames one goes to it.
    let most = u32::from(StateConfig::default().dynamic_frames);
    assert_eq!([chains(0), chains(most - 1), chains(most)], [1, 1, 2]);
}
