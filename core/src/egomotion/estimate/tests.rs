//! The estimate's parts: how many hypotheses, which points, what weighs how much.

use super::*;
use crate::egomotion::weights::side_weight;
use crate::memory::Slab;
use std::boxed::Box;

const RIG: StereoRig =
    StereoRig { focal_px: 300.0, center_u_px: 200.0, center_v_px: 80.0, baseline_m: 0.5 };
const CAPACITY: Capacity = Capacity { matches: 50, ..Capacity::TINY };
const BYTES: usize = Estimator::bytes(&CAPACITY);

fn motion() -> Transform {
    Transform::new([0.01, -0.02, 0.01], [0.1, 0.05, -0.4])
}

/// The match of a point under the motion.
fn matched(point: [f64; 3]) -> Match {
    let seen = |point: [f64; 3]| {
        let seen = RIG.project(point).unwrap();
        [seen.u_left_px, seen.u_right_px]
            .map(|u| [(RIG.center_u_px + u) as f32, (RIG.center_v_px + seen.v_px) as f32])
    };
    let ([previous_left, previous_right], [current_left, current_right]) =
        (seen(point), seen(motion().transform_point(point)));
    Match { previous_left, previous_right, current_left, current_right }
}

const POINTS_M: [[f64; 3]; 4] =
    [[1.0, -0.7, 6.0], [-3.0, 1.2, 9.0], [0.4, 0.9, 4.0], [2.0, 0.5, 12.0]];

fn with_estimator(test: impl FnOnce(&mut Estimator<'_>)) {
    let mut slab = Box::new(Slab([0; BYTES]));
    let mut carver = Carver::new(&mut slab.0, BYTES).unwrap();
    let mut estimator = Estimator::new_in(&CAPACITY, &mut carver);
    assert_eq!((carver.check(), carver.footprint().bytes()), (Ok(()), BYTES));
    test(&mut estimator);
}

fn is_near(found: &Transform, to: &Transform) -> bool {
    let difference = found.inverse() * to;
    difference.distance_m() < 1e-3 && difference.angle_rad() < 1e-3
}

#[test]
fn hypotheses_are_as_many_as_make_one_without_outliers_likely() {
    let config = EgomotionConfig { samples: 500, confidence: 0.9999, ..EgomotionConfig::default() };
    // ln(1 - confidence) / ln(1 - share^3), rounded up.
    for (inliers, required) in
        [(100, 1), (90, 8), (80, 13), (50, 69), (30, 337), (25, 500), (1, 500), (0, 500)]
    {
        assert_eq!(required_iterations(&config, inliers, 100), required, "{inliers} of 100");
    }
    let patient = EgomotionConfig { samples: 10_000, ..config };
    assert_eq!(required_iterations(&patient, 25, 100), 585);
    assert_eq!(required_iterations(&patient, 1, 2_000), 10_000, "too few to tell");
    let unsure = EgomotionConfig { confidence: 0.5, ..config };
    assert_eq!(required_iterations(&unsure, 50, 100), 6);
}

#[test]
fn a_match_at_the_knee_weighs_half() {
    let config = EgomotionConfig { side_knee: 0.25, ..EgomotionConfig::default() };
    let weight = |rig: &StereoRig, u_px: f64| {
        side_weight(&config, rig, &Point { xyz: [0.0; 3], left: [u_px, 3.0], right: [0.0; 2] })
    };
    // A quarter of the 200 px to the middle column.
    for sign in [1.0, -1.0] {
        assert_eq!(weight(&RIG, 50.0 * sign), 0.5);
        assert_eq!(weight(&RIG, 100.0 * sign), 1.0 / 257.0);
        assert_eq!(weight(&StereoRig { center_u_px: -200.0, ..RIG }, 100.0 * sign), 1.0 / 257.0);
    }
    assert_eq!(weight(&RIG, 0.0), 1.0);
    assert_eq!(
        weight(&StereoRig { center_u_px: 0.0, ..RIG }, 100.0),
        1.0,
        "no middle to be far from"
    );
}

#[test]
fn the_largest_part_of_a_step_is_told_without_its_sign() {
    assert_eq!(largest([0.1, -0.7, 0.3, 0.0, 0.2, -0.1]), 0.7);
    assert_eq!(largest([0.0, 0.1, 0.2, 0.3, 0.4, 0.5]), 0.5);
    assert_eq!(largest([0.0; 6]), 0.0);
}

#[test]
fn hypotheses_are_of_three_different_points() {
    with_estimator(|estimator| {
        let three = [0, 1, 2].map(|index: usize| matched(POINTS_M[index]));
        estimator.points.fill(&three, &RIG);
        let (config, mut random) = (EgomotionConfig::default(), Random::new(1));
        for _ in 0..300 {
            // Any point drawn twice would leave the motion open.
            let found =
                estimator.hypothesis(&config, &RIG, &mut random, &Transform::IDENTITY).unwrap();
            assert!(is_near(&found, &motion()), "{found:?}");
        }
        let hasty = EgomotionConfig { sample_steps: 1, ..config };
        assert_eq!(
            estimator.hypothesis(&hasty, &RIG, &mut random, &Transform::IDENTITY),
            None,
            "one step does not come to rest"
        );
        assert!(
            estimator
                .hypothesis(&hasty, &RIG, &mut random, &motion())
                .is_none_or(|found| is_near(&found, &motion()))
        );
    });
}

#[test]
fn every_point_is_drawn() {
    with_estimator(|estimator| {
        // Three points that agree and one that is off: a hypothesis is right in one of four draws,
        // if all are as likely.
        let mut four = POINTS_M.map(matched);
        for off in 0..4 {
            four[off].current_left[1] += 30.0;
            estimator.points.fill(&four, &RIG);
            let (config, mut random) = (EgomotionConfig::default(), Random::new(2));
            let right = (0..1_000)
                .filter(|_| {
                    let found =
                        estimator.hypothesis(&config, &RIG, &mut random, &Transform::IDENTITY);
                    found.is_some_and(|found| is_near(&found, &motion()))
                })
                .count();
            assert!((190..=310).contains(&right), "{right} of 1000 without point {off}");
            four[off].current_left[1] -= 30.0;
        }
    });
}

#[test]
fn an_estimate_says_what_it_was_made_of() {
    with_estimator(|estimator| {
        let mut some: std::vec::Vec<Match> = (0..40)
            .map(|index| {
                matched([
                    f64::from(index % 7) - 3.0,
                    f64::from(index % 3) - 1.0,
                    4.0 + f64::from(index % 11),
                ])
            })
            .collect();
        // Rows half a pixel apart in both images: an error that no motion explains, of a quarter
        // pixel in two of four coordinates.
        some.iter_mut().for_each(|m| m.current_right[1] += 0.5);
        some[5].current_left[0] += 50.0;
        let config = EgomotionConfig { side_knee: 10.0, ..EgomotionConfig::default() };
        let estimate = estimator.estimate(
            &config,
            &RIG,
            &some,
            MotionHypotheses::from_draws(&mut Random::new(3)),
        );
        assert_eq!(
            (estimate.status, estimate.matches, estimate.inliers),
            (MotionStatus::Estimated, 40, 39)
        );
        // Root of 2 / 4 of a quarter squared.
        assert!(
            (estimate.residual_rms_px - 0.25 / core::f64::consts::SQRT_2).abs() < 5e-3,
            "{estimate:?}"
        );
        assert!(estimate.steps >= 3 && estimate.steps < 40, "three rounds: {estimate:?}");
        assert_eq!(
            estimator.count_inliers(&RIG, &some, &estimate.t_current_previous.unwrap(), 1.0),
            [39, 40]
        );
        assert_eq!(
            estimator.count_inliers(&RIG, &some, &estimate.t_current_previous.unwrap(), 0.2),
            [0, 40]
        );
        assert_eq!(estimator.inliers().count(), 0, "counting chooses none");
        let restless = EgomotionConfig { refine_steps: 1, ..config };
        let estimate = estimator.estimate(
            &restless,
            &RIG,
            &some,
            MotionHypotheses::from_draws(&mut Random::new(3)),
        );
        assert_eq!(
            (estimate.status, estimate.t_current_previous, estimate.steps),
            (MotionStatus::NotConverged, None, 1)
        );
    });
}

#[test]
fn as_many_inliers_as_asked_for_are_enough_and_one_fewer_is_not() {
    with_estimator(|estimator| {
        let mut some: std::vec::Vec<Match> = (0..20)
            .map(|index| {
                matched([
                    f64::from(index % 7) - 3.0,
                    f64::from(index % 3) - 1.0,
                    4.0 + f64::from(index % 11),
                ])
            })
            .collect();
        // The first ten are off by 20 px and more, each by another amount, so that they agree with
        // nothing.
        some.iter_mut()
            .take(10)
            .enumerate()
            .for_each(|(at, m)| m.current_left[1] += 20.0 + 9.0 * at as f32);
        let mut status = |share: f32, least: u16| {
            let config = EgomotionConfig {
                inlier_share_min: share,
                matches_min: least,
                ..EgomotionConfig::default()
            };
            let estimate = estimator.estimate(
                &config,
                &RIG,
                &some,
                MotionHypotheses::from_draws(&mut Random::new(3)),
            );
            (estimate.status, estimate.inliers)
        };
        // Half of the matches are inliers: by share and by number, at the bound and beyond it.
        assert_eq!(status(0.5, 3), (MotionStatus::Estimated, 10));
        assert_eq!(status(0.51, 3), (MotionStatus::TooFewInliers, 10));
        assert_eq!(status(0.0, 10), (MotionStatus::Estimated, 10));
        assert_eq!(status(0.0, 11), (MotionStatus::TooFewInliers, 10));
        assert_eq!(status(0.0, 20).0, MotionStatus::TooFewInliers);
        assert_eq!(status(0.0, 21), (MotionStatus::TooFewMatches, 0));
    });
}
