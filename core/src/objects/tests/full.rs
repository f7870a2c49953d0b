//! What happens at each bound: who goes, who stays, and what is counted.

use super::*;
use crate::volume::Slot;

#[test]
fn of_volumes_fused_last_in_the_same_frame_that_of_the_older_track_goes() {
    let board = Board { half_m: [0.8, 0.5], ..Board::CAR };
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        for frame in 0..12 {
            let car_at = |x: f64, shown: bool| (&board, shown.then(|| shift(x, 0.0, 9.0)));
            run.step(
                Transform::IDENTITY,
                &[car_at(-3.5, frame < 8), car_at(0.0, frame < 8), car_at(3.5, frame >= 5)],
            );
        }
        let lost: Vec<_> = run
            .sink
            .0
            .iter()
            .map(|retired| (retired.0.id, retired.0.last_frame, retired.1))
            .collect();
        assert_eq!(lost, [(1, 7, Retirement::Displaced)]);
        let ids: Vec<u32> = run.instances.objects().map(|(summary, _)| summary.id).collect();
        assert_eq!(ids, [3, 2]);
    });
}

/// The cars at 9 m of `small` m and, if there is one, of `large` m half a width, parked, until
/// their motion is known; crops dropped, and such fused in the end.
fn waited(crop_pixels: usize, small: f64, large: Option<f64>) -> (u32, u32) {
    with(
        &Capacity { crop_pixels, ..CAPACITY },
        &known_in_the_fourth_frame(),
        |instances, estimator| {
            let boards: Vec<Board> = [Some(small), large]
                .into_iter()
                .flatten()
                .map(|x| Board { half_m: [x, 0.5], ..Board::CAR })
                .collect();
            let mut run = Run::new(instances, estimator);
            let (mut dropped, mut caught_up) = (0, 0);
            for _ in 0..4 {
                let seen: Vec<_> = boards
                    .iter()
                    .zip([-4.0, 1.0])
                    .map(|(board, x)| (board, Some(shift(x, 0.0, 9.0))))
                    .collect();
                let report = run.step(Transform::IDENTITY, &seen);
                dropped += report.crops_dropped;
                caught_up += report.caught_up;
            }
            (dropped, caught_up)
        },
    )
}

#[test]
fn a_crop_larger_than_the_ring_is_counted_and_costs_no_other_its_place() {
    // 33 rows of 53 and of 200 columns: 1,749 and 6,600 px.
    assert_eq!(waited(6_000, 0.8, None), (0, 3));
    assert_eq!(waited(6_000, 0.8, Some(3.0)), (3, 3));
    assert_eq!(waited(100, 0.8, None), (3, 0));
}

#[test]
fn the_ring_of_crops_begins_anew_where_the_next_would_not_fit() {
    with(
        &Capacity { crop_pixels: 5_000, ..CAPACITY },
        &known_in_the_fourth_frame(),
        |instances, estimator| {
            let mut run = Run::new(instances, estimator);
            for frame in 0..3 {
                run.step(
                    shift(0.0, 0.0, 0.5 * f64::from(frame)),
                    &[(&Board::CAR, Some(shift(1.0, 0.3, 10.0)))],
                );
            }
            let cameras: Vec<f64> = run
                .instances
                .objects
                .crops
                .of(1)
                .map(|(crop, ..)| crop.t_world_camera.translation_m[2])
                .collect();
            assert_eq!(cameras, [1.0], "the latest");
        },
    );
}

#[test]
fn of_more_crops_than_there_are_entries_the_latest_wait() {
    let config = TrackingConfig {
        state: StateConfig {
            confirm_frames: 255,
            confirm_static_frames: 255,
            ..StateConfig::default()
        },
        ..any_size()
    };
    with(&Capacity { crop_pixels: 400_000, ..CAPACITY }, &config, |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        let board = Board { half_m: [0.8, 0.5], points: 20, ..Board::CAR };
        let dropped: u32 = (0..MAX_CROPS as u32 + 12)
            .map(|frame| {
                let z = 0.01 * f64::from(frame);
                run.step(shift(0.0, 0.0, z), &[(&board, Some(shift(0.0, 0.0, 9.0)))]).crops_dropped
            })
            .sum();
        let cameras: Vec<f64> = run
            .instances
            .objects
            .crops
            .of(1)
            .map(|(crop, ..)| crop.t_world_camera.translation_m[2])
            .collect();
        assert_eq!((cameras.len(), dropped), (MAX_CROPS, 12));
        assert!(
            (cameras[0] - 0.12).abs() < 1e-9 && (cameras[MAX_CROPS - 1] - 1.39).abs() < 1e-9,
            "{cameras:?}"
        );
    });
}

#[test]
fn a_volume_that_is_full_keeps_what_it_has() {
    let board = Board { half_m: [0.8, 0.5], ..Board::CAR };
    with(
        &Capacity { object_blocks: 50, ..CAPACITY },
        &known_in_the_fourth_frame(),
        |instances, estimator| {
            let mut run = Run::new(instances, estimator);
            let coords = |run: &Run<'_, '_, '_>| {
                let (_, object) = run.instances.objects().next().unwrap();
                let volume = object.volume();
                // Blocks that only one frame made go at every fourth.
                let lasting = |slot: &Slot| {
                    volume
                        .blocks()
                        .weight(*slot)
                        .is_some_and(|weights| weights.iter().any(|&weight| weight > 1))
                };
                volume
                    .pool()
                    .live()
                    .filter(lasting)
                    .filter_map(|slot| volume.blocks().coord(slot))
                    .collect::<Vec<_>>()
            };
            // With the fourth fused frame the blocks without a voxel have lost.
            for _ in 0..8 {
                run.step(Transform::IDENTITY, &[(&board, Some(shift(0.0, 0.0, 9.0)))]);
            }
            let before = coords(&run);
            assert!(before.len() > 20 && before.len() < 50, "{} blocks", before.len());
            // What was its right half is now the left one of what is seen of it.
            let mut refused = 0;
            for _ in 0..3 {
                refused += run
                    .step(
                        Transform::IDENTITY,
                        &[(&board, None), (&board, Some(shift(0.8, 0.0, 9.0)))],
                    )
                    .blocks_refused;
            }
            let after = coords(&run);
            assert!(refused > 0 && run.sink.0.is_empty(), "{refused} refused, {:?}", run.sink.0);
            assert!(before.iter().all(|coord| after.contains(coord)));
        },
    );
}

#[test]
fn the_sum_of_refusals_counts_every_kind() {
    let report = ObjectsReport {
        objects: 64,
        refused: 4,
        blocks_refused: 8,
        crops_dropped: 32,
        ..ObjectsReport::default()
    };
    assert_eq!(report.refusals(), 44);
}
