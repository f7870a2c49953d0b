//! Tracks that are not seen, or not measured, for some frames.

use super::*;

/// Shows a car in the frames `shown` selects and calls `inspect` after each.
fn run(
    frames: u32,
    poses: fn(u32) -> [Transform; 2],
    shown: impl Fn(u32) -> bool,
    mut inspect: impl FnMut(u32, &Run<'_, '_, '_>),
) {
    with(&CAPACITY, &any_size(), |tracker, estimator| {
        let mut run = Run::new(tracker, estimator);
        for frame in 0..frames {
            let [camera, car] = poses(frame);
            run.step(camera, &[(&Board::CAR, shown(frame).then_some(car))]);
            inspect(frame, &run);
        }
    });
}

#[test]
fn an_unmeasured_car_moves_on_for_three_frames_or_stands_for_five() {
    for (poses, state, most) in [
        (ahead as fn(u32) -> [Transform; 2], MotionState::Dynamic, 3),
        (parked, MotionState::Static, 5),
    ] {
        let mut states = Vec::new();
        let mut depths_m = Vec::new();
        run(
            13,
            poses,
            |frame| frame < 6,
            |_, run| {
                let track = run.track(1).unwrap();
                states.push(track.state);
                depths_m.push(
                    track.t_world_object.map(|t_world_object| t_world_object.translation().z),
                );
            },
        );
        let lost = 6 + most;
        assert!(
            states[5..lost].iter().all(|now| *now == state)
                && states[lost] == MotionState::Uncertain,
            "{states:?}"
        );
        let step_m = if state == MotionState::Dynamic { 0.8 } else { 0.0 };
        for frame in 6..lost {
            let moved = depths_m[frame].unwrap() - depths_m[frame - 1].unwrap();
            assert!((moved - step_m).abs() < 0.02, "frame {frame}: {moved} m");
        }
        assert_eq!(depths_m[lost], None, "its pose is unknown");
    }
}

#[test]
fn the_middle_of_a_car_unseen_goes_on_with_it() {
    let mut middles = Vec::new();
    run(
        8,
        ahead,
        |frame| frame < 6,
        |_, run| middles.push(run.track(1).unwrap().center_world_m[2]),
    );
    // In a frame with a motion it is the middle before that motion.
    let steps = [middles[6] - middles[5], middles[7] - middles[6]];
    assert!(steps.iter().all(|step| (step - 0.8).abs() < 0.05), "{steps:?}");
}

#[test]
fn a_car_that_stops_stays_where_it_stopped() {
    // 8 m/s until frame 8, then braking by 8 m/s within ten frames.
    let poses = |frame: u32| {
        let speed = |n: u32| if n <= 8 { 8.0 } else { f64::from(18u32.saturating_sub(n)) * 0.8 };
        [
            Transform::IDENTITY,
            shift(0.5, 0.3, 7.0 + (1..=frame).map(|n| 0.1 * speed(n)).sum::<f64>()),
        ]
    };
    let mut last = None;
    run(30, poses, |_| true, |_, run| last = run.track(1));
    let track = last.unwrap();
    assert_eq!(track.state, MotionState::Static);
    let came = track.t_world_object.unwrap().translation().z;
    let drove = poses(29)[1].translation().z - poses(0)[1].translation().z;
    assert!((came / drove - 1.0).abs() < 0.1, "{came} of {drove} m");
}
