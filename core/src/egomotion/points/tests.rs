//! Scoring in single precision against counting by the rig's own projection.

use super::*;
use crate::{memory::Slab, random::Random};
use std::{boxed::Box, vec::Vec};

const RIG: StereoRig =
    StereoRig { focal_px: 300.0, center_u_px: 200.0, center_v_px: 80.0, baseline_m: 0.5 };
const MATCHES: usize = 700;
const BYTES: usize = Points::bytes(MATCHES);

fn motion() -> Transform {
    Transform::new([0.01, -0.03, 0.02], [0.1, 0.05, -1.1])
}

/// Matches of points around; every third is off by up to some pixels in one of its four
/// coordinates.
fn matches(count: usize) -> Vec<Match> {
    let mut random = Random::new(12);
    let mut within = |low: f64, high: f64| low + (high - low) * random.fraction();
    (0..count)
        .map(|index| {
            // Within the field of view: shares of the depth.
            let z = within(3.0, 30.0);
            let point = [within(-0.6, 0.6) * z, within(-0.25, 0.25) * z, z];
            let seen = |point: [f64; 3]| {
                let seen = RIG.project(point).unwrap();
                let row = RIG.center_v_px + seen.v_px;
                [seen.u_left_px, seen.u_right_px]
                    .map(|u| [(RIG.center_u_px + u) as f32, row as f32])
            };
            let ([previous_left, previous_right], [mut current_left, mut current_right]) =
                (seen(point), seen(motion().transform_point(point)));
            // Off in one coordinate alone, each of the four in turn.
            if index % 3 == 0 {
                let off = within(-6.0, 6.0) as f32;
                let [left_u, left_v] = &mut current_left;
                let [right_u, right_v] = &mut current_right;
                *[left_u, left_v, right_u, right_v][index / 3 % 4] += off;
            }
            Match { previous_left, previous_right, current_left, current_right }
        })
        .collect()
}

fn with_points(count: usize, test: impl FnOnce(&mut Points<'_>, &[Match])) {
    let mut slab = Box::new(Slab([0; BYTES]));
    let mut carver = Carver::new(&mut slab.0, BYTES).unwrap();
    let mut points = Points::new_in(MATCHES, &mut carver);
    assert_eq!((carver.check(), carver.footprint().bytes()), (Ok(()), BYTES));
    let matches = matches(count);
    assert_eq!(points.fill(&matches, &RIG), count);
    test(&mut points, &matches);
}

/// The length of a point's error under a motion, px.
fn error_px(point: &Point, motion: &Transform) -> Option<f64> {
    let seen = RIG.project(motion.transform_point(point.xyz))?;
    let parts = [
        seen.u_left_px - point.left[0],
        seen.v_px - point.left[1],
        seen.u_right_px - point.right[0],
        seen.v_px - point.right[1],
    ];
    Some(libm::sqrt(parts.iter().map(|part| part * part).sum()))
}

fn within_px(points: &Points<'_>, motion: &Transform, px: f64) -> Vec<u32> {
    let near = |index: &usize| {
        error_px(&points.get(*index).unwrap(), motion).is_some_and(|error| error < px)
    };
    (0..points.len()).filter(near).map(|index| index as u32).collect()
}

#[test]
fn takes_thirty_two_bytes_a_match() {
    assert_eq!(BYTES, (28 * MATCHES).next_multiple_of(64) + (4 * MATCHES).next_multiple_of(64));
}

#[test]
fn a_match_is_a_point_before_and_two_observations_now() {
    with_points(3, |points, matches| {
        for (index, m) in matches.iter().enumerate() {
            let point = points.get(index).unwrap();
            let near = |found: f64, expected: f64| (found - expected).abs() < 1e-3;
            let [left, right] = [m.current_left, m.current_right]
                .map(|at| [f64::from(at[0]) - 200.0, f64::from(at[1]) - 80.0]);
            assert!(
                (0..2).all(|axis| near(point.left[axis], left[axis])
                    && near(point.right[axis], right[axis]))
            );
            let disparity = f64::from(m.previous_left[0]) - f64::from(m.previous_right[0]);
            let z = 150.0 / disparity;
            let expected = [
                (f64::from(m.previous_left[0]) - 200.0) * z / 300.0,
                (f64::from(m.previous_left[1]) - 80.0) * z / 300.0,
                z,
            ];
            assert!(
                (0..3).all(|axis| near(point.xyz[axis], expected[axis])),
                "{point:?} {expected:?}"
            );
        }
        assert!(points.get(MATCHES).is_none() && points.source(MATCHES).is_none());
    });
}

#[test]
fn points_without_depth_are_left_out_and_the_others_keep_numbers() {
    with_points(5, |points, matches| {
        let mut some = Vec::from(matches);
        // No disparity, not a number, and infinite.
        some[0].previous_right = some[0].previous_left;
        some[2].current_left[1] = f32::NAN;
        some[3].current_right[0] = f32::INFINITY;
        assert_eq!(
            (points.fill(&some, &RIG), points.len()),
            (5, 2),
            "a fill forgets the one before"
        );
        // The sources of the two that are left.
        assert_eq!([0, 1].map(|index| points.source(index)), [Some(1), Some(4)]);
        let many = [some[1]; MATCHES + 9];
        assert_eq!(
            (points.fill(&many, &RIG), points.len()),
            (MATCHES + 9, MATCHES),
            "no more than fit"
        );
    });
}

#[test]
fn scores_and_selections_are_the_points_within_the_distance() {
    with_points(MATCHES, |points, _| {
        // A motion that is nearly right, so that fewer are within the distance.
        let nearly = motion() * Transform::new([0.0, 0.002, 0.0], [0.01, 0.0, 0.005]);
        for (motion, px) in
            [(motion(), 0.5), (motion(), 2.0), (motion(), 4.0), (nearly, 2.0), (nearly, 4.0)]
        {
            let expected = within_px(points, &motion, px);
            assert!(expected.len() > 100 && expected.len() < MATCHES, "{}", expected.len());
            assert_eq!(points.score(&motion, &RIG, px as f32, 0), expected.len() as u32, "{px} px");
            let mut inliers = [0; MATCHES];
            let count = points.select(&motion, &RIG, px as f32, &mut inliers);
            assert_eq!(inliers[..count], expected);
            assert_eq!(
                // A list too short for all keeps the first ones.
                points.select(&motion, &RIG, px as f32, &mut inliers[..7]),
                7,
                "no more than fit"
            );
        }
        // Moved back by more than the farthest point's depth.
        let behind = Transform::from_translation([0.0, 0.0, -31.0]);
        assert_eq!(points.score(&behind, &RIG, 1e6, 0), 0, "points behind the camera are nowhere");
    });
}

#[test]
fn a_score_is_exact_if_it_beats_another_and_else_not_above_it() {
    with_points(MATCHES, |points, _| {
        let whole = points.score(&motion(), &RIG, 2.0, 0);
        for to_beat in [1, 100, whole - 1] {
            assert_eq!(points.score(&motion(), &RIG, 2.0, to_beat), whole, "more than {to_beat}");
        }
        for to_beat in [whole, whole + 1, MATCHES as u32 - 1] {
            assert!(
                points.score(&motion(), &RIG, 2.0, to_beat) <= to_beat,
                "not more than {to_beat}"
            );
        }
        assert_eq!(
            points.score(&motion(), &RIG, 2.0, MATCHES as u32),
            0,
            "not one is looked at in vain"
        );
        // After 256 points that miss, fewer than 500 are left.
        let elsewhere = Transform::from_translation([5.0, 0.0, 0.0]);
        assert_eq!(points.score(&elsewhere, &RIG, 0.1, 500), 0);
    });
}
