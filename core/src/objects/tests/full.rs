//! What happens at each bound: who goes, who stays, and what is counted.

use super::*;
use crate::volume::Slot;

const MASK: [u8; 3600] = [1; 3600];

fn car(left: i32) -> Detection<'static> {
    detection(Class::Car, 0.9, &PixelBox { left, top: 30, width: 60, height: 60 }, &MASK)
}

/// Takes a frame without matches; the tracks it sees.
fn take(
    instances: &mut Instances<'_>,
    estimator: &mut Estimator<'_>,
    frame: u32,
    detections: &[Detection<'_>],
) -> Vec<u32> {
    take_frame(instances, estimator, frame, detections, [&[], &[]]);
    instances.tracks().filter(|track| track.detected).map(|track| track.id).collect()
}

#[test]
fn a_mask_beyond_the_store_is_counted_and_a_smaller_one_still_fits() {
    // 60 rows of two words for the first, none for the second, 30 rows of one for the third.
    let third = detection(
        Class::Car,
        0.3,
        &PixelBox { left: 330, top: 30, width: 30, height: 30 },
        &MASK[..900],
    );
    let all = [Detection { score: 0.8, ..car(100) }, Detection { score: 0.5, ..car(180) }, third];
    with(&Capacity { mask_words: 150, ..CAPACITY }, &any_size(), |instances, _| {
        instances.ingest(0, &all, [WIDTH, HEIGHT]);
        let lefts: Vec<i32> = instances
            .tracker
            .test_instances()
            .iter()
            .map(|instance| instance.mask.pixels.left)
            .collect();
        assert_eq!((lefts, instances.report().detections.mask_store_full), (vec![100, 330], 1));
    });
}

#[test]
fn a_mask_of_which_nothing_is_left_takes_mask_store_full() {
    let hidden = detection(
        Class::Car,
        0.5,
        &PixelBox { left: 105, top: 35, width: 50, height: 50 },
        &MASK[..2500],
    );
    with(&Capacity { mask_words: 250, ..CAPACITY }, &any_size(), |instances, _| {
        instances.ingest(
            0,
            &[Detection { score: 0.8, ..car(100) }, hidden, Detection { score: 0.2, ..car(180) }],
            [WIDTH, HEIGHT],
        );
        let count = instances.report().detections;
        assert_eq!((count.accepted, count.covered, count.mask_store_full), (2, 1, 0));
    });
}

#[test]
fn a_full_mask_store_replaces_an_unseen_tracks_mask_by_its_box() {
    with(&Capacity { mask_words: 130, ..CAPACITY }, &any_size(), |instances, estimator| {
        assert_eq!(take(instances, estimator, 0, &[car(100)]), [1]);
        assert_eq!(take(instances, estimator, 1, &[car(250)]), [2]);
        assert_eq!(instances.report().tracks.masks_lost, 1);
        assert_eq!(take(instances, estimator, 2, &[car(250)]), [2]);
        assert_eq!(instances.report().tracks.masks_lost, 0, "a box takes no mask words");
        assert_eq!(take(instances, estimator, 3, &[car(100)]), [1]);
    });
}

#[test]
fn of_tracks_the_one_unseen_for_longest_goes_and_of_equals_the_older() {
    let left = |first: [&[i32]; 3]| {
        with(&Capacity { tracks: 3, ..CAPACITY }, &any_size(), |instances, estimator| {
            for (frame, lefts) in (0..).zip(first) {
                let cars: Vec<_> = lefts.iter().map(|left| car(*left)).collect();
                take(instances, estimator, frame, &cars);
            }
            assert_eq!(take(instances, estimator, 6, &[car(310)]), [4]);
            assert_eq!(instances.report().tracks.evicted, 1);
            instances.tracks().map(|track| track.id).collect::<Vec<_>>()
        })
    };
    assert_eq!(left([&[10], &[110], &[210]]), [2, 3, 4]);
    assert_eq!(left([&[10], &[110, 210], &[10]]), [1, 3, 4], "1 was seen again");
}

#[test]
fn when_one_track_goes_the_others_keep_their_detections() {
    with(&Capacity { tracks: 3, ..CAPACITY }, &any_size(), |instances, estimator| {
        take(instances, estimator, 0, &[car(10), car(110), car(210)]);
        for frame in 1..3 {
            take(instances, estimator, frame, &[car(110), car(210)]);
        }
        assert_eq!(take(instances, estimator, 3, &[car(110), car(210), car(310)]), [2, 3, 4]);
        for detection in instances.tracker.test_instances() {
            let track = instances.tracker.test_track_of(detection).unwrap();
            assert_eq!(track.mask.pixels, detection.mask.pixels, "track {}", track.id);
        }
    });
}

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
                let report = run.step(Transform::IDENTITY, &seen).objects;
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
                run.step(shift(0.0, 0.0, z), &[(&board, Some(shift(0.0, 0.0, 9.0)))])
                    .objects
                    .crops_dropped
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
                    .objects
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
    let detections = [
        DetectionCount { bad_score: 1, ..DetectionCount::default() },
        DetectionCount { bad_box: 1, ..DetectionCount::default() },
        DetectionCount { bad_mask: 1, ..DetectionCount::default() },
        DetectionCount { over_capacity: 1, ..DetectionCount::default() },
        DetectionCount { mask_store_full: 1, ..DetectionCount::default() },
    ];
    for detections in detections {
        assert_eq!(
            InstancesReport { detections, ..InstancesReport::default() }.refused(),
            1,
            "{detections:?}"
        );
    }
    let tracks = TrackCount { refused: 2, masks_lost: 16, ..TrackCount::default() };
    let objects = ObjectsReport {
        refused: 4,
        blocks_refused: 8,
        crops_dropped: 32,
        ..ObjectsReport::default()
    };
    assert_eq!(InstancesReport { tracks, objects, ..InstancesReport::default() }.refused(), 62);
    let fine = DetectionCount {
        given: 9,
        accepted: 1,
        ignored: 1,
        too_small: 1,
        tracked_only: 1,
        covered: 1,
        ..DetectionCount::default()
    };
    assert_eq!(InstancesReport { detections: fine, ..InstancesReport::default() }.refused(), 0);
}
