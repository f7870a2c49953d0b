//! A budget of work: rows farther apart.

use super::{scenes::surface, *};
use crate::{image::MaskedPair, parallel::TwoThreads};

const WIDTH: usize = 300;
const HEIGHT: usize = 161;

/// A road below and a wall above, both slanted.
fn truth(u: f32, v: f32) -> f32 {
    if v < 60.0 { 16.0 + 0.04 * u } else { 2.0 + 0.3 * v }
}

/// Share of the image that has a disparity, and the part of it that is within a pixel of the truth.
fn covered_and_true(found: &[u16]) -> [f32; 2] {
    let there = found.iter().enumerate().filter(|(_, d)| **d > 0);
    let (mut all, mut good) = (0, 0);
    for (i, &d) in there {
        all += 1;
        let expected = truth((i % WIDTH) as f32, (i / WIDTH) as f32);
        good += u32::from((f32::from(d) / 256.0 - expected).abs() < 1.0);
    }
    [all as f32 / found.len() as f32, good as f32 / all as f32]
}

/// The report and the disparities of a pair whose pixels are matched to a share.
fn within<E: Executor>(share: f32, pair: &[Grey; 2], executor: &E) -> (StereoReport, Vec<u16>) {
    let config = StereoConfig { second_rows_from: 100, ..StereoConfig::default() };
    let capacity = capacity(WIDTH, HEIGHT);
    let [pixels, points] = [most_pixels(&capacity, &config), max_points(&capacity)]
        .map(|most| (most as f32 * share) as usize);
    with_matcher(&capacity, |matcher| {
        let [left, right] = pair.each_ref().map(Grey::view);
        let pair = MaskedPair { left, right, invalid: None, right_moved: false };
        let most = StereoBudget { pixels, points };
        let report = matcher.compute_within(&config, &pair, most, executor);
        assert!(report.row_pixels as usize <= pixels, "{share}: {report:?}");
        assert!(report.candidates as usize <= points, "{share}: {report:?}");
        (report, matcher.disparity_q8().rows().flatten().copied().collect())
    })
}

#[test]
fn what_is_left_of_a_pair_is_as_true_and_covers_less() {
    let (left, right) = surface(WIDTH, HEIGHT, 9, truth);
    let pair = [left, right];
    let [whole, true_of_whole] = covered_and_true(&within(1.0, &pair, &Serial).1);
    for (share, least, lost) in
        [(0.75, 0.9, 0.02), (0.5, 0.9, 0.02), (0.25, 0.8, 0.04), (0.1, 0.2, 0.09)]
    {
        let (report, found) = within(share, &pair, &Serial);
        assert!(report.row_pixels as f32 > 0.7 * share * (WIDTH * HEIGHT / 2) as f32, "{report:?}");
        let [covered, true_share] = covered_and_true(&found);
        assert!(true_share > true_of_whole - lost, "{share}: {true_share} of {true_of_whole}");
        let left = covered / whole;
        assert!((least..1.0).contains(&left), "{share}: {left} of the pixels");
    }
}

#[test]
fn nothing_is_said_between_two_surfaces_and_without_a_row() {
    let (left, right) = surface(WIDTH, HEIGHT, 9, |_, v| if v < 75.0 { 8.0 } else { 40.0 });
    let (_, found) = within(0.25, &[left, right], &Serial);
    // The edge lies between two matched rows, and what is between them is either surface or none.
    let tops = found.iter().filter(|&&d| d > 0 && d.abs_diff(8 << 8) > 256);
    assert!(tops.into_iter().all(|&d| d.abs_diff(40 << 8) <= 256));
    let (left, right) = surface(WIDTH, HEIGHT, 9, truth);
    let pair = [left, right];
    let (report, none) = within(0.001, &pair, &Serial);
    assert_eq!((report.row_pixels, report.candidates, report.valid), (0, 0, 0));
    assert!(report.is_left_out() && !within(1.0, &pair, &Serial).0.is_left_out());
    assert!(none.iter().all(|&d| d == 0));
}

#[test]
fn threads_give_the_same_bits_within_any_budget() {
    let (left, right) = surface(WIDTH, HEIGHT, 10, truth);
    let pair = [left, right];
    for share in [0.75, 0.5, 0.25, 0.05] {
        assert!(within(share, &pair, &Serial) == within(share, &pair, &TwoThreads), "{share}");
    }
}
