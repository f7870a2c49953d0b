//! Which detections are let in.

mod delete_masks;

use super::*;
use crate::tracking::tests::*;
use std::{vec, vec::Vec};

fn accepted_of(
    config: &TrackingConfig,
    size: [usize; 2],
    detections: &[Detection<'_>],
) -> (DetectionCount, Vec<f32>, u64) {
    let capacity =
        Capacity { image_width: 1242, image_height: 375, mask_words: 20_000, ..CAPACITY };
    with(&capacity, config, |tracker, _| {
        ingest(tracker, 0, detections, size);
        let scores = tracker.instances.all().iter().map(|instance| instance.score).collect();
        (tracker.report.detections, scores, digest(tracker))
    })
}

#[test]
fn a_box_must_be_larger_than_45_by_45_at_kittis_width() {
    let mask = vec![1; 3000];
    let accepted = |width, height, image: usize| {
        let car = detection(Class::Car, 0.9, &pixels(10, 10, width, height), &mask);
        accepted_of(&TrackingConfig::default(), [image, 200], &[car]).0.accepted
    };
    // 2024, 2025 and 2026 px.
    assert_eq!(
        [accepted(46, 44, 1242), accepted(45, 45, 1242), accepted(1013, 2, 1242)],
        [0, 0, 1]
    );
    // Half the width, a quarter of the area: 506.25 px.
    assert_eq!([accepted(23, 22, 621), accepted(39, 13, 621)], [0, 1]);
}

#[test]
fn nonsense_is_refused_by_name_and_counted_once() {
    let mask = vec![1; 10_000];
    let good = pixels(10, 10, 60, 60);
    let with_score = |score| detection(Class::Car, score, &good, &mask);
    let at = |left, top, width, height| Detection { left, top, width, height, ..with_score(0.5) };
    let empty = vec![0; 3600];
    let all = [
        with_score(f32::NAN),
        with_score(-0.1),
        with_score(1.5),
        with_score(f32::INFINITY),
        at(10, 10, 0, 60),
        at(10, 10, 60, 0),
        at(400, 10, 60, 60),
        at(-60, 10, 60, 60),
        at(i32::MIN, i32::MAX, 60, 60),
        at(10, 10, u32::MAX, u32::MAX),
        Detection { mask: &mask[..3599], ..with_score(0.5) },
        Detection { mask: &empty, ..with_score(0.5) },
        detection(Class::Other, 0.5, &good, &mask),
        at(10, 10, 5, 5),
        with_score(0.7),
    ];
    let (count, scores, _) = accepted_of(&TrackingConfig::default(), [WIDTH, HEIGHT], &all);
    let expected = DetectionCount {
        given: 15,
        accepted: 1,
        bad_score: 4,
        bad_box: 6,
        bad_mask: 2,
        ignored: 1,
        too_small: 1,
        ..DetectionCount::default()
    };
    assert_eq!((count, scores), (expected, vec![0.7]));
}

#[test]
fn of_ten_thousand_the_best_are_accepted_in_any_order() {
    let mask = vec![1; 3600];
    let mut random = Random::new(1);
    let mut all: Vec<_> = (0..10_000)
        .map(|_| {
            let (left, top) = (random.below(300) as i32, random.below(50) as i32);
            detection(
                Class::Car,
                random.below(1000) as f32 / 1000.0,
                &pixels(left, top, 60, 60),
                &mask,
            )
        })
        .collect();
    let (count, scores, digest) = accepted_of(&TrackingConfig::default(), [WIDTH, HEIGHT], &all);
    assert_eq!(count.accepted + count.covered + count.over_capacity, 10_000);
    assert_eq!(count.over_capacity, 9_996, "four are the bound");
    assert!(scores.iter().all(|&score| score > 0.99), "{scores:?}");
    for i in (1..all.len()).rev() {
        all.swap(i, random.below(i as u32 + 1) as usize);
    }
    assert_eq!(
        accepted_of(&TrackingConfig::default(), [WIDTH, HEIGHT], &all),
        (count, scores, digest)
    );
}

#[test]
fn where_masks_overlap_the_higher_score_is_on_top() {
    let mask = vec![1; 3600];
    let (low, high) = (
        detection(Class::Car, 0.5, &pixels(10, 10, 60, 60), &mask),
        detection(Class::Van, 0.8, &pixels(40, 10, 60, 60), &mask),
    );
    let hidden = detection(Class::Car, 0.1, &pixels(15, 12, 50, 50), &mask);
    for order in [[low, high, hidden], [hidden, high, low]] {
        with(&CAPACITY, &any_size(), |tracker, _| {
            ingest(tracker, 0, &order, [WIDTH, HEIGHT]);
            let accepted = tracker.instances.all();
            assert_eq!((accepted.len(), tracker.report.detections.covered), (2, 1));
            let on = |n: usize, u| tracker.masks().contains(&accepted[n].mask, u, 20);
            assert_eq!([on(0, 39), on(0, 40), on(1, 39), on(1, 40)], [false, true, true, false]);
        });
    }
}

#[test]
fn small_detections_are_tracked_with_the_space_that_is_left() {
    let mask = vec![1; 3600];
    let config = TrackingConfig::default();
    let car = |score, pixels: &PixelBox| {
        detection(Class::Car, score, pixels, &mask[..pixels.area() as usize])
    };
    let [least, most] =
        [(30, 30), (31, 30)].map(|(width, height)| car(0.9, &pixels(200, 10, width, height)));
    let count = |all: &[Detection<'_>]| accepted_of(&config, [1242, 375], all).0;
    let counted = |accepted, too_small, tracked_only, over_capacity, given| DetectionCount {
        given,
        accepted,
        too_small,
        tracked_only,
        over_capacity,
        ..DetectionCount::default()
    };
    assert_eq!(count(&[least]), counted(0, 1, 0, 0, 1));
    assert_eq!(count(&[most]), counted(0, 1, 1, 0, 1));
    // A table of four: the one that is tracked only leaves first, despite its score, and is counted
    // as such.
    let large: Vec<_> = (0..5).map(|n| pixels(300 + 70 * n, 10, 60, 60)).collect();
    let mut all: Vec<_> = large.iter().map(|pixels| car(0.3, pixels)).collect();
    all.insert(0, most);
    assert_eq!(count(&all[..5]), counted(4, 1, 0, 0, 5));
    assert_eq!(count(&all), counted(4, 1, 0, 1, 6));
    // A larger one keeps its pixels.
    let over = car(0.3, &pixels(190, 5, 60, 60));
    assert_eq!(count(&[most, over]), counted(1, 1, 0, 0, 2), "no pixel of the smaller car is left");
}

#[test]
fn of_more_equals_than_fit_the_same_are_accepted_in_any_order() {
    let mask = vec![1; 3600];
    let boxes: Vec<_> = (0..7).map(|n| pixels(10 + 40 * n, 10, 60, 60)).collect();
    let mut all: Vec<_> =
        boxes.iter().map(|pixels| detection(Class::Car, 0.5, pixels, &mask)).collect();
    let first = accepted_of(&TrackingConfig::default(), [WIDTH, HEIGHT], &all);
    for _ in 0..7 {
        all.rotate_left(1);
        assert_eq!(accepted_of(&TrackingConfig::default(), [WIDTH, HEIGHT], &all), first);
    }
    all.reverse();
    assert_eq!(accepted_of(&TrackingConfig::default(), [WIDTH, HEIGHT], &all), first);
}

#[test]
fn a_box_of_absurd_width_is_refused_though_its_mask_is_as_wide() {
    let mask = vec![1; 160_000];
    let wide = |width: u32| Detection {
        left: 0,
        top: 10,
        width,
        height: 4,
        ..detection(Class::Car, 0.9, &pixels(0, 0, 1, 1), &mask)
    };
    let count = |width| accepted_of(&TrackingConfig::default(), [WIDTH, HEIGHT], &[wide(width)]).0;
    assert_eq!((count(32_768).accepted, count(32_769).bad_box, count(40_000).bad_box), (1, 1, 1));
}

#[test]
fn of_a_box_half_beside_the_image_the_half_within_counts() {
    let mask = vec![1; 3600];
    for (left, within) in [(-30, 0), (370, 370)] {
        with(&CAPACITY, &any_size(), |tracker, _| {
            ingest(
                tracker,
                0,
                &[detection(Class::Car, 0.9, &pixels(left, 100, 60, 60), &mask)],
                [WIDTH, HEIGHT],
            );
            let accepted = tracker.instances.all()[0];
            assert_eq!(accepted.mask.pixels, pixels(within, 100, 30, 20));
            assert_eq!(tracker.masks().area(&accepted.mask), 30 * 20, "and no pixel beside it");
        });
    }
}

#[test]
fn a_score_below_the_least_is_ignored() {
    let mask = vec![1; 3600];
    let car = |score| detection(Class::Car, score, &pixels(10, 10, 60, 60), &mask);
    let mut config = any_size();
    config.instances.score_min = 0.4;
    let count = |score| accepted_of(&config, [WIDTH, HEIGHT], &[car(score)]).0;
    assert_eq!(
        [count(0.39), count(0.4)].map(|count| (count.accepted, count.ignored)),
        [(0, 1), (1, 0)]
    );
}

#[test]
fn a_score_of_minus_nothing_is_nothing() {
    let mask = vec![1; 3600];
    let cars =
        [-0.0, 0.5].map(|score| detection(Class::Car, score, &pixels(10, 10, 60, 60), &mask));
    let (count, scores, _) = accepted_of(&any_size(), [WIDTH, HEIGHT], &cars);
    assert_eq!((count.covered, scores), (1, vec![0.5]), "the better one is on top");
}

#[test]
fn of_two_alike_the_same_is_on_top_in_either_order() {
    let whole = vec![1; 3600];
    let left: Vec<u8> = (0..3600).map(|i| u8::from(i % 60 < 40)).collect();
    let right: Vec<u8> = (0..3600).map(|i| u8::from(i % 60 >= 20)).collect();
    let car = detection(Class::Car, 0.5, &pixels(10, 10, 60, 60), &whole);
    let pairs = [
        [car, Detection { class: Class::Van, ..car }],
        [car, Detection { left: 11, ..car }],
        [Detection { mask: &left, ..car }, Detection { mask: &right, ..car }],
    ];
    for [a, b] in pairs {
        let seen = |order: [Detection<'_>; 2]| {
            with(&CAPACITY, &any_size(), |tracker, _| {
                ingest(tracker, 0, &order, [WIDTH, HEIGHT]);
                let (masks, accepted) = (tracker.masks(), tracker.instances.all());
                accepted
                    .iter()
                    .map(|accepted| {
                        (accepted.class(), accepted.mask.pixels, masks.area(&accepted.mask))
                    })
                    .collect::<Vec<_>>()
            })
        };
        let digest =
            |order: [Detection<'_>; 2]| accepted_of(&any_size(), [WIDTH, HEIGHT], &order).2;
        assert_eq!(seen([a, b]), seen([b, a]));
        assert_eq!(digest([a, b]), digest([b, a]));
    }
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
    with(&Capacity { mask_words: 150, ..CAPACITY }, &any_size(), |tracker, _| {
        ingest(tracker, 0, &all, [WIDTH, HEIGHT]);
        let lefts: Vec<i32> =
            tracker.instances.all().iter().map(|instance| instance.mask.pixels.left).collect();
        assert_eq!((lefts, tracker.report.detections.mask_store_full), (vec![100, 330], 1));
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
    with(&Capacity { mask_words: 250, ..CAPACITY }, &any_size(), |tracker, _| {
        ingest(
            tracker,
            0,
            &[Detection { score: 0.8, ..car(100) }, hidden, Detection { score: 0.2, ..car(180) }],
            [WIDTH, HEIGHT],
        );
        let count = tracker.report.detections;
        assert_eq!((count.accepted, count.covered, count.mask_store_full), (2, 1, 0));
    });
}
