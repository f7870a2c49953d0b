//! Who is who from frame to frame.

mod full;
mod gaps;
mod masks;

use super::*;
use crate::tracking::tests::*;
use std::{vec, vec::Vec};

fn with_tracks(tracks: TracksConfig) -> TrackingConfig {
    TrackingConfig { tracks, ..any_size() }
}

fn take(tracker: &mut Tracker<'_>, frame: u32, detections: &[Detection<'_>]) -> Vec<u32> {
    ingest(tracker, frame, detections, [WIDTH, HEIGHT]);
    tracker.commit();
    tracker.tracks().filter(|track| track.detected).map(|track| track.id).collect()
}

#[test]
fn two_cars_that_pass_each_other_keep_their_numbers() {
    with(&CAPACITY, &any_size(), |tracker, _| {
        for frame in 0..5 {
            let step = 20 * frame as i32;
            assert_eq!(
                take(tracker, frame, &[car(20 + step), car(280 - step)]),
                [1, 2],
                "frame {frame}"
            );
        }
        let lefts: Vec<i32> = tracker.tracks().map(|track| track.pixels.left).collect();
        assert_eq!(lefts, [100, 200]);
    });
}

#[test]
fn the_best_pair_is_associated_first_in_any_order() {
    with(&CAPACITY, &any_size(), |tracker, _| {
        take(tracker, 0, &[car(100)]);
        // The nearer one is the old one, though the other has the higher score and overlaps as
        // well.
        let other = Detection { score: 1.0, ..car(135) };
        take(tracker, 1, &[other, car(102)]);
        let nearest = tracker.tracks().find(|track| track.id == 1).unwrap();
        // Its mask is cut by the other's, its box is not.
        assert_eq!((nearest.pixels.left, nearest.sightings), (102, 2));
    });
}

#[test]
fn frames_missed_cost_a_half_then_three_quarters() {
    // Overlap 2/3 at 12 px... of 60: (60 - 12) / (60 + 12); times 0.9, the scores' mean: 0.6.
    let score = 48.0 / 72.0 * 0.9;
    for (gap, discount) in [(1, 1.0), (2, 0.5), (3, 0.25), (9, 0.25)] {
        for (margin, expected) in [(0.99, 1), (1.01, 2)] {
            let tracks = TracksConfig {
                association_min: score * discount * margin,
                extent_frames: 0,
                ..TracksConfig::default()
            };
            let config = with_tracks(tracks);
            with(&CAPACITY, &config, |tracker, _| {
                take(tracker, 0, &[car(100)]);
                assert_eq!(take(tracker, gap, &[car(112)]), [expected], "gap {gap}");
            });
        }
    }
}

#[test]
fn a_car_may_be_called_a_truck_for_a_while_but_never_a_person() {
    with(&CAPACITY, &any_size(), |tracker, _| {
        let called = |class| Detection { class, ..car(100) };
        for (frame, class) in
            [Class::Car, Class::Car, Class::Truck, Class::Van, Class::Car].into_iter().enumerate()
        {
            assert_eq!(take(tracker, frame as u32, &[called(class)]), [1]);
        }
        assert_eq!(tracker.tracks().next().unwrap().class, Class::Car);
        assert_eq!(take(tracker, 5, &[called(Class::Person)]), [2]);
    });
}

#[test]
fn a_track_unseen_for_more_than_fifty_frames_is_forgotten() {
    for (gap, id) in [(50, 1), (51, 2)] {
        with(&CAPACITY, &any_size(), |tracker, _| {
            take(tracker, 0, &[car(100)]);
            for frame in 1..gap {
                take(tracker, frame, &[]);
            }
            assert_eq!(take(tracker, gap, &[car(100)]), [id], "gap {gap}");
            assert_eq!(tracker.report.tracks.forgotten, id - 1);
        });
    }
}

#[test]
fn a_full_table_evicts_the_track_unseen_for_longest_and_none_seen_lately() {
    with(&Capacity { tracks: 2, ..CAPACITY }, &any_size(), |tracker, _| {
        take(tracker, 0, &[car(20)]);
        take(tracker, 1, &[car(120)]);
        assert_eq!(take(tracker, 2, &[car(220)]), [3]);
        assert_eq!(tracker.tracks().map(|track| track.id).collect::<Vec<_>>(), [2, 3], "1 went");
        assert_eq!(tracker.report.tracks.evicted, 1);
        // 2 was seen one frame before 3 was: both may come back any moment.
        assert_eq!(take(tracker, 3, &[car(220), car(320)]), [3, 4]);
        assert_eq!(take(tracker, 4, &[car(20)]), [0; 0]);
        assert_eq!(tracker.report.tracks.refused, 1);
    });
}

#[test]
fn a_mask_that_stops_filling_its_box_still_overlaps_by_what_it_fills() {
    // Two diagonal halves of one box: full overlap as boxes, almost none as masks.
    let half = |upper: bool| -> Vec<u8> {
        (0..3600).map(|i| u8::from((i % 60 > i / 60) == upper)).collect()
    };
    let (upper, lower) = (half(true), half(false));
    for (overlap, id) in [(Overlap::Mask, 2), (Overlap::Box, 1)] {
        with(
            &CAPACITY,
            &with_tracks(TracksConfig { overlap, ..TracksConfig::default() }),
            |tracker, _| {
                take(tracker, 0, &[Detection { mask: &upper, ..car(100) }]);
                assert_eq!(take(tracker, 1, &[Detection { mask: &lower, ..car(100) }]), [id]);
            },
        );
    }
}

#[test]
fn a_car_that_speeds_up_is_looked_for_where_it_goes() {
    with(&CAPACITY, &any_size(), |tracker, _| {
        for (frame, left) in [(0, 20), (1, 40), (2, 80), (3, 130), (4, 180)] {
            assert_eq!(
                take(tracker, frame, &[car(left)]),
                [1],
                "{left} px: the last two steps are nearly the car's width"
            );
        }
    });
}

#[test]
fn a_movement_goes_on_over_a_gap_by_its_frames_up_to_four_of_them() {
    let config = with_tracks(TracksConfig { extent_frames: 0, ..TracksConfig::default() });
    let found = |gap: u32, left: i32| {
        with(&CAPACITY, &config, |tracker, _| {
            take(tracker, 0, &[car(20)]);
            take(tracker, 1, &[car(40)]);
            take(tracker, 1 + gap, &[car(left)]) == [1]
        })
    };
    assert_eq!([found(3, 100), found(3, 60)], [true, false], "three times 20 px");
    assert_eq!([found(9, 120), found(9, 220)], [true, false], "four times at most");
}

#[test]
fn a_movement_over_a_gap_is_shared_among_its_frames() {
    let tracks = TracksConfig { association_min: 0.01, ..TracksConfig::default() };
    with(&CAPACITY, &with_tracks(tracks), |tracker, _| {
        take(tracker, 0, &[car(100)]);
        assert_eq!(take(tracker, 3, &[car(130)]), [1]);
        assert_eq!(tracker.tracks.all_mut()[0].velocity_px, [10, 0]);
    });
}

#[test]
fn of_equals_the_first_detection_and_the_older_track_are_joined() {
    with(&CAPACITY, &any_size(), |tracker, _| {
        take(tracker, 0, &[car(100)]);
        // As near on either side.
        assert_eq!(take(tracker, 1, &[car(70), car(130)]), [1, 2]);
        let lefts: Vec<i32> = tracker.tracks().map(|track| track.pixels.left).collect();
        assert_eq!(lefts, [70, 130]);
    });
    with(&CAPACITY, &any_size(), |tracker, _| {
        take(tracker, 0, &[car(70), car(130)]);
        assert_eq!(take(tracker, 1, &[car(100)]), [1], "and not both of them");
    });
}

#[test]
fn a_class_holds_until_others_were_seen_more_often() {
    let voted = |classes: &[Class]| {
        with(&CAPACITY, &any_size(), |tracker, _| {
            let vote_class = |(frame, class): (u32, &Class)| {
                take(tracker, frame, &[Detection { class: *class, ..car(100) }]);
                tracker.tracks().next().unwrap().class
            };
            (0..).zip(classes).map(vote_class).collect::<Vec<_>>()
        })
    };
    use Class::{Car, Truck, Van};
    assert_eq!(voted(&[Car, Car, Truck, Car, Van, Truck]), [Car, Car, Car, Car, Car, Truck]);
    assert_eq!(voted(&[Truck, Car, Car]), [Truck, Car, Car]);
}

#[test]
fn a_small_object_that_grows_is_reported_though_no_motion_was_measured() {
    let small = detection(
        Class::Car,
        0.9,
        &PixelBox { left: 100, top: 30, width: 12, height: 12 },
        &MASK[..144],
    );
    let grown = detection(
        Class::Car,
        0.9,
        &PixelBox { left: 98, top: 28, width: 16, height: 16 },
        &MASK[..256],
    );
    with(&CAPACITY, &TrackingConfig::default(), |tracker, _| {
        assert_eq!([take(tracker, 0, &[small]), take(tracker, 1, &[grown])], [vec![], vec![1]]);
    });
}

#[test]
fn a_pixel_shows_the_best_instance_whose_mask_contains_it() {
    with(&Capacity { tracks: 1, ..CAPACITY }, &any_size(), |tracker, _| {
        let half: Vec<u8> = (0..3600).map(|i| u8::from(i % 60 < 30)).collect();
        let walker = Detection { class: Class::Person, score: 0.5, ..car(100) };
        take(tracker, 0, &[walker, Detection { mask: &half, ..car(100) }]);
        let shown = |u| tracker.instance_at(u, 50).map(|instance| (instance.class, instance.track));
        assert_eq!(
            [shown(110), shown(140), shown(99)],
            [Some((Class::Car, Some(1))), Some((Class::Person, None)), None]
        );
    });
}

/// A match under the mask of `car(left)` that moves to the right.
fn moving_right(left: i32, n: u32, by_px: f32) -> Match {
    let previous_left = [left as f32 + 6.0 + 10.0 * (n % 5) as f32, 40.0 + 8.0 * (n / 5) as f32];
    Match {
        previous_left,
        current_left: [previous_left[0] + by_px, previous_left[1]],
        ..Match::default()
    }
}

#[test]
fn a_car_is_looked_for_where_its_matches_went() {
    let found = |count: u32| {
        with(&CAPACITY, &any_size(), |tracker, _| {
            take(tracker, 0, &[car(100)]);
            let matches: Vec<Match> = (0..count).map(|n| moving_right(100, n, 58.0)).collect();
            let refined = FrameMatches { refined: &matches, sparse: &[] };
            let _ = tracker.detect(1, &[car(158)], [WIDTH, HEIGHT], refined);
            tracker.commit();
            tracker
                .tracks()
                .filter(|track| track.detected)
                .map(|track| track.id)
                .collect::<Vec<_>>()
        })
    };
    assert_eq!([found(5), found(4)], [vec![1], vec![2]], "its box alone lies beside the last one");
}

#[test]
fn a_car_that_something_passes_in_front_of_stays_one_track() {
    let seen = |left: i32, width: i32| {
        detection(
            Class::Car,
            0.9,
            &PixelBox { left, top: 30, width, height: 60 },
            &MASK[..(60 * width) as usize],
        )
    };
    with(&CAPACITY, &any_size(), |tracker, _| {
        // Seen whole, cut on the right, not at all, cut on the left, whole.
        for (frame, detections) in
            [vec![car(100)], vec![seen(100, 15)], vec![], vec![seen(145, 15)], vec![car(100)]]
                .iter()
                .enumerate()
        {
            let tracks = take(tracker, frame as u32, detections);
            assert_eq!(tracks, vec![1; detections.len()], "frame {frame}");
        }
        // What is seen beside it is another car.
        assert_eq!(take(tracker, 5, &[car(100), seen(165, 15)]), [1, 2]);
    });
}
