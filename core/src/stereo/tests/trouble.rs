//! Input without an answer, input that fits nothing, and configurations at their limits: values,
//! never panics.

use super::{scenes::surface, *};
use crate::{parallel::TwoThreads, random::Random, settings::Problems};

fn noise(width: usize, height: usize, seed: u64) -> Grey {
    let mut random = Random::new(seed);
    Grey {
        width,
        height,
        pixels: (0..width * height).map(|_| random.below(256) as u8).collect(),
    }
}

fn flat(width: usize, height: usize, grey: u8) -> Grey {
    Grey { width, height, pixels: vec![grey; width * height] }
}

#[test]
fn threads_change_nothing() {
    let config = StereoConfig { median: true, ..StereoConfig::default() };
    let (left, right) = surface(331, 117, 6, |u, v| 20.0 + 0.03 * u + 0.1 * v);
    let alone = disparity(&config, &left, &right, &Serial);
    assert!(alone.0.valid > 20_000);
    assert!(alone == disparity(&config, &left, &right, &TwoThreads));
}

#[test]
fn a_matcher_remembers_nothing_of_the_pair_before() {
    let (left, right) = surface(200, 80, 7, |_, _| 12.0);
    let (config, fresh) =
        // What a matcher answers that has seen nothing else and whose buffer has just this size.
        (StereoConfig::default(), disparity(&StereoConfig::default(), &left, &right, &Serial));
    with_matcher(&capacity(333, 100), |matcher| {
        for seed in 0..2 {
            matcher.compute(
                &config,
                noise(333, 100, seed).view(),
                noise(333, 100, seed).view(),
                &Serial,
            );
            let report = matcher.compute(&config, left.view(), right.view(), &Serial);
            let disparity: Vec<u16> = matcher.disparity_q8().rows().flatten().copied().collect();
            assert!((report, disparity) == fresh, "a larger buffer and another pair before");
            // One pair that has no texture, and one whose images differ in size.
            for unlike in [flat(200, 80, 0), flat(199, 80, 0)] {
                matcher.compute(&config, left.view(), right.view(), &Serial);
                matcher.compute(&config, left.view(), unlike.view(), &Serial);
                assert!(
                    matcher.disparity_q8().rows().flatten().all(|&d| d == 0),
                    "without an answer nothing of it is left"
                );
            }
        }
    });
}

#[test]
fn a_black_pair_has_no_support_and_no_disparity() {
    // Black and white: overexposed is as bad as dark.
    for grey in [0, 255] {
        let (report, disparity) = disparity(
            &StereoConfig::default(),
            &flat(320, 96, grey),
            &flat(320, 96, grey),
            &Serial,
        );
        assert_eq!(
            (report.status, report.support_points, report.valid),
            (StereoStatus::TooFewSupportPoints, 0, 0)
        );
        assert!(disparity.iter().all(|&d| d == 0));
    }
    // One camera is dark.
    let (report, _) =
        disparity(&StereoConfig::default(), &noise(320, 96, 1), &flat(320, 96, 0), &Serial);
    assert_eq!(report.status, StereoStatus::TooFewSupportPoints);
}

#[test]
fn refused_pairs_are_named_and_leave_no_disparity() {
    with_matcher(&capacity(100, 50), |matcher| {
        assert_eq!(
            matcher.disparity_q8().rows().flatten().count(),
            1,
            "before the first pair there is one pixel, without disparity"
        );
        let config = StereoConfig::default();
        let mut status = |config: &StereoConfig, left: Grey, right: Grey| {
            let report = matcher.compute(config, left.view(), right.view(), &Serial);
            assert!(matcher.disparity_q8().rows().flatten().all(|&d| d == 0));
            report.status
        };
        assert_eq!(status(&config, noise(100, 50, 1), noise(99, 50, 1)), StereoStatus::SizesDiffer);
        assert_eq!(status(&config, noise(101, 50, 1), noise(101, 50, 1)), StereoStatus::TooLarge);
        assert_eq!(status(&config, noise(100, 51, 1), noise(100, 51, 1)), StereoStatus::TooLarge);
        assert_eq!(status(&config, noise(15, 50, 1), noise(15, 50, 1)), StereoStatus::TooSmall);
        let cells = StereoConfig { grid_size: 9, ..config };
        assert_eq!(
            status(&cells, noise(100, 50, 1), noise(100, 50, 1)),
            StereoStatus::ConfigRefused
        );
        let gamma = StereoConfig { gamma: f32::NAN, ..config };
        assert_eq!(
            status(&gamma, noise(100, 50, 1), noise(100, 50, 1)),
            StereoStatus::ConfigRefused
        );
        // The least size is computed, however little there is to find.
        assert_ne!(status(&config, noise(16, 16, 1), noise(16, 16, 1)), StereoStatus::TooSmall);
    });
}

#[test]
fn a_buffer_without_width_or_height_refuses_every_pair() {
    for (width, height) in [(0, 0), (40, 0), (0, 40)] {
        with_matcher(&capacity(width, height), |matcher| {
            let report = matcher.compute(
                &StereoConfig::default(),
                noise(40, 40, 1).view(),
                noise(40, 40, 1).view(),
                &Serial,
            );
            assert_eq!((report.status, report.valid), (StereoStatus::TooLarge, 0));
            assert!(matcher.disparity_q8().rows().flatten().all(|&d| d == 0));
        });
    }
}

/// Configurations at the limits of what `validate` lets pass.
fn extremes() -> Vec<StereoConfig> {
    let base = StereoConfig { median: true, ..StereoConfig::default() };
    vec![
        base,
        StereoConfig { disparity_max: 10, gap_width: 4_096, ..base },
        StereoConfig {
            support_ratio: 1.0,
            redundant_distance: 0,
            consistency_threshold: u16::MAX,
            ..base
        },
        StereoConfig { redundant_distance: 64, grid_size: 256, ..base },
        StereoConfig { grid_size: 10, gamma: 1e-30, plane_radius_sigmas: 16.0, ..base },
        StereoConfig { gamma: 1e30, plane_radius_sigmas: 16.0, ..base },
        StereoConfig { plane_radius_sigmas: 0.0, speckle_similarity: u16::MAX, ..base },
        StereoConfig { speckle_size: u32::MAX, ..base },
        StereoConfig {
            lone_share: 1.0,
            lone_gap: 4_096,
            gap_width: 4_096,
            adaptive_mean: 4,
            ..base
        },
        StereoConfig { speckle_size: 0, gap_width: 0, adaptive_mean: 0, ..base },
    ]
}

#[test]
fn no_noise_and_no_valid_configuration_makes_it_panic() {
    let mut random = Random::new(8);
    for config in extremes() {
        let mut problems = Problems::new();
        config.validate(&mut problems);
        assert!(problems.is_empty(), "{problems:?}");
        for seed in 0..4 {
            let (width, height) = (16 + random.below(150) as usize, 16 + random.below(60) as usize);
            let (left, right) = (noise(width, height, seed), noise(width, height, seed / 2));
            let (report, disparity) = disparity(&config, &left, &right, &Serial);
            assert_eq!(report.valid as usize, disparity.iter().filter(|&&d| d > 0).count());
            assert!(disparity.iter().all(|&d| d <= config.disparity_max * 256));
        }
        let (left, right) = surface(160, 60, 9, |u, _| 8.0 + 0.1 * u);
        disparity(&config, &left, &right, &Serial);
    }
}

#[test]
fn the_slab_share_stays_within_twenty_bytes_a_pixel() {
    for (name, capacity) in Capacity::PROFILES {
        let each = StereoMatcher::bytes(&capacity) as f64 / capacity.pixels() as f64;
        assert!(each <= 20.0, "{name}: {each} bytes a pixel");
    }
}
