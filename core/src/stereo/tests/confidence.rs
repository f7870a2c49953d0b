//! Confidences of whole pairs, and the rim of the image.

use super::scenes::{share_within_one_px, surface};
use super::*;
use crate::parallel::TwoThreads;

const WIDTH: usize = 400;

/// A road that comes nearer with each row, and its disparity.
fn road() -> (Grey, Grey) {
    surface(WIDTH, 120, 8, truth)
}

fn truth(_: f32, v: f32) -> f32 {
    4.0 + 0.3 * v
}

/// Disparities and confidences at a least confidence; the report.
fn computed<E: Executor>(
    min_confidence: u8,
    pair: &(Grey, Grey),
    executor: &E,
) -> (StereoReport, Vec<u16>, Option<Vec<u8>>) {
    let (left, right) = pair;
    let config = StereoConfig { min_confidence, ..StereoConfig::default() };
    with_matcher(&capacity(WIDTH, 120), |matcher| {
        let report = matcher.compute(&config, left.view(), right.view(), executor);
        let disparity = matcher.disparity_q8().rows().flatten().copied().collect();
        let confidence = matcher.confidence().map(|view| view.rows().flatten().copied().collect());
        (report, disparity, confidence)
    })
}

#[test]
fn a_least_confidence_of_one_keeps_every_bit_and_says_how_sure_each_is() {
    let pair = road();
    let (plain, all, none) = computed(0, &pair, &Serial);
    assert!(none.is_none() && plain.doubtful == 0);
    let (report, same, confidence) = computed(1, &pair, &Serial);
    let confidence = confidence.unwrap();
    assert_eq!((report, &same), (plain, &all));
    assert!(all.iter().zip(&confidence).all(|(&d, &of)| (d == 0) == (of == 0)));
    // Nearly all is measured in the middle; at the rim a part of the window is outside.
    let at = |u: usize, v: usize| confidence[v * WIDTH + u];
    assert!(at(200, 60) > 200 && (60..190).contains(&at(200, 115)), "{}", at(200, 115));
    assert_eq!(computed(1, &pair, &TwoThreads).2, Some(confidence));
}

#[test]
fn what_is_less_sure_than_asked_is_removed_and_counted() {
    let pair = road();
    let (_, all, confidence) = computed(1, &pair, &Serial);
    let (report, left, sure) = computed(180, &pair, &Serial);
    assert!(report.doubtful > 100 && report.valid > 10_000, "{report:?}");
    assert_eq!(report.valid as usize, left.iter().filter(|&&d| d > 0).count());
    let (confidence, sure) = (confidence.unwrap(), sure.unwrap());
    for (i, &d) in left.iter().enumerate() {
        let kept = confidence[i] >= 180;
        assert_eq!((d, sure[i]), if kept { (all[i], confidence[i]) } else { (0, 0) });
    }
}

#[test]
fn given_disparities_and_refused_pairs_have_no_confidence() {
    let (left, right) = road();
    let config = StereoConfig { min_confidence: 1, ..StereoConfig::default() };
    with_matcher(&capacity(WIDTH, 120), |matcher| {
        assert!(matcher.confidence().is_none());
        matcher.compute(&config, left.view(), right.view(), &Serial);
        assert!(matcher.confidence().is_some());
        matcher.take(View::new(&[256; 64], 8, 8).unwrap(), None);
        assert!(matcher.confidence().is_none());
        matcher.compute(&config, left.view(), right.view(), &Serial);
        let small = View::new(&[0; 64], 8, 8).unwrap();
        matcher.compute(&config, small, small, &Serial);
        assert!(matcher.confidence().is_none());
    });
}

#[test]
fn a_road_is_matched_up_to_the_last_row_with_a_window() {
    let (left, right) = road();
    let found = |rim_reach: usize| {
        let config = StereoConfig { rim_reach, ..StereoConfig::default() };
        let (report, disparity) = disparity(&config, &left, &right, &Serial);
        // Rows 112 to 116: below the last support points, and within the last windows.
        let rows = 112 * WIDTH..117 * WIDTH;
        let right_ones = (rows.clone())
            .filter(|&i| i % WIDTH > 60)
            .filter(|&i| {
                let off = f32::from(disparity[i]) / 256.0 - truth(0.0, (i / WIDTH) as f32);
                off * off < 1.0
            })
            .count();
        assert!(share_within_one_px(&disparity, WIDTH, truth) > 0.9);
        (report.rim_points, right_ones as f32 / (rows.len() * (WIDTH - 61) / WIDTH) as f32)
    };
    let ((none, before), (added, after)) = (found(0), found(4));
    assert!(none == 0 && added > 50, "{added} points");
    assert!(before < 0.3 && after > 0.9, "{before} of the last rows, then {after}");
}
