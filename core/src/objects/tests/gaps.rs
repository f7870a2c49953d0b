//! Objects that are not seen, or not measured, for some frames.

use super::*;

/// Shows a car in the frames `shown` selects and calls `inspect` after each.
fn run(
    frames: u32,
    poses: fn(u32) -> [Transform; 2],
    shown: impl Fn(u32) -> bool,
    mut inspect: impl FnMut(u32, &Run<'_, '_, '_>),
) {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        for frame in 0..frames {
            let [camera, car] = poses(frame);
            run.step(camera, &[(&Board::CAR, shown(frame).then_some(car))]);
            inspect(frame, &run);
        }
    });
}

#[test]
fn what_waits_of_a_car_of_unknown_motion_goes_when_it_is_lost() {
    run(
        4,
        ahead,
        |frame| frame < 3,
        |frame, run| {
            assert_eq!(
                run.instances.objects.crops.len(),
                [1, 2, 3, 0][frame as usize],
                "frame {frame}"
            );
        },
    );
}

#[test]
fn without_a_motion_a_parked_car_is_fused_and_a_moving_one_not() {
    let silent = Board { points: 0, ..Board::CAR };
    for (poses, fused) in [(ahead as fn(u32) -> [Transform; 2], [1, 0, 1]), (parked, [1, 1, 1])] {
        with(&CAPACITY, &any_size(), |instances, estimator| {
            let mut run = Run::new(instances, estimator);
            let mut count = Vec::new();
            for frame in 0..8 {
                let [camera, car] = poses(frame);
                let board = if frame == 6 { &silent } else { &Board::CAR };
                count.push(run.step(camera, &[(board, Some(car))]).fused);
            }
            assert_eq!(count[5..], fused);
        });
    }
}

#[test]
fn nothing_is_kept_for_a_volume_while_the_camera_is_lost() {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        for frame in 0..10 {
            run.known = frame >= 6;
            let [camera, car] = ahead(frame);
            let report = run.step(camera, &[(&Board::CAR, Some(car))]);
            assert_eq!(
                (run.instances.objects.crops.len(), report.fused),
                (0, u32::from(frame >= 6)),
                "frame {frame}"
            );
        }
    });
}

#[test]
fn a_motion_too_late_after_a_gap_restarts_the_volume() {
    let segments = |missed: u32| {
        let mut segments = 0;
        run(
            16,
            ahead,
            |frame| !(6..6 + missed).contains(&frame),
            |_, run| {
                segments =
                    run.instances.objects().next().map_or(0, |(summary, _)| summary.segment_id);
            },
        );
        segments
    };
    // The frame in which it is found again has no motion either: of dynamic_frames one goes to it.
    let most = u32::from(StateConfig::default().dynamic_frames);
    assert_eq!([segments(0), segments(most - 1), segments(most)], [1, 1, 2]);
}
