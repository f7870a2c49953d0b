//! The covariance against the spread of estimates from noisy points, and its way along poses.

use super::*;
use crate::{
    Capacity,
    egomotion::{EgomotionConfig, Estimator, MotionHypotheses},
    memory::{Carver, Slab},
    random::Random,
    scene_flow::Match,
};
use std::{boxed::Box, vec::Vec};

const RIG: StereoRig =
    StereoRig { focal_px: 700.0, center_u_px: 600.0, center_v_px: 180.0, baseline_m: 0.5 };
const CAPACITY: Capacity = Capacity { matches: 200, ..Capacity::TINY };
const BYTES: usize = Estimator::bytes(&CAPACITY);

/// Depths of points, the noise of what is seen of them, and the seed of both.
#[derive(Clone, Copy)]
struct Scene {
    depth_m: [f64; 2],
    noise_px: f64,
    seed: u64,
}

fn motion() -> Transform {
    Transform::new([0.002, -0.01, 0.003], [0.05, 0.01, -0.6])
}

/// A number from -1 to 1.
fn signed(random: &mut Random) -> f64 {
    f64::from(random.below(20_001)) / 10_000.0 - 1.0
}

fn matches(scene: Scene) -> Vec<Match> {
    let mut random = Random::new(scene.seed);
    let [near_m, far_m] = scene.depth_m;
    (0..150)
        .map(|_| {
            let z = near_m + (far_m - near_m) * (0.5 + 0.5 * signed(&mut random));
            let point = [0.6 * z * signed(&mut random), 0.2 * z * signed(&mut random), z];
            let mut seen = |point: [f64; 3]| {
                let seen = RIG.project(point).unwrap();
                [seen.u_left_px, seen.u_right_px].map(|u| {
                    let noise =
                        [signed(&mut random), signed(&mut random)].map(|x| x * scene.noise_px);
                    [
                        (RIG.center_u_px + u + noise[0]) as f32,
                        (RIG.center_v_px + seen.v_px + noise[1]) as f32,
                    ]
                })
            };
            let [previous_left, previous_right] = seen(point);
            let [current_left, current_right] = seen(motion().transform_point(point));
            Match { previous_left, previous_right, current_left, current_right }
        })
        .collect()
}

/// The error of the position in each direction, with the sigma that belongs to it.
fn errors(scene: Scene) -> [[f64; 2]; 3] {
    errors_if_found(scene).unwrap()
}

fn errors_if_found(scene: Scene) -> Option<[[f64; 2]; 3]> {
    let mut slab = Box::new(Slab([0; BYTES]));
    let mut carver = Carver::new(&mut slab.0, BYTES).unwrap();
    let mut estimator = Estimator::new_in(&CAPACITY, &mut carver);
    let (config, mut random) = (EgomotionConfig::default(), Random::new(scene.seed));
    let hypotheses = MotionHypotheses::from_draws(&mut random);
    let found = estimator.estimate(&config, &RIG, &matches(scene), hypotheses);
    let error_m = (found.t_current_previous? * motion().inverse()).translation_m;
    let sigma_m = found.covariance?.translation_sigma_m();
    Some(core::array::from_fn(|axis| [error_m[axis], sigma_m[axis]]))
}

#[test]
fn errors_of_noisy_matches_lie_within_two_sigma() {
    for noise_px in [0.05, 0.15, 0.3] {
        for depth_m in [[4.0, 20.0], [20.0, 60.0]] {
            let runs: Vec<_> =
                (1..=60).map(|seed| errors(Scene { depth_m, noise_px, seed })).collect();
            for axis in 0..3 {
                let within = runs.iter().filter(|run| run[axis][0].abs() <= 2.0 * run[axis][1]);
                // 60 draws of 0.95 fall below 52 once in two hundred times.
                let within = within.count();
                assert!(within >= 52, "{noise_px} px, {depth_m:?} m, axis {axis}: {within} of 60");
            }
        }
    }
}

#[test]
fn sigma_holds_where_noise_reaches_far_beyond_the_robust_weights() {
    // Most errors exceed `robust_px`.
    let scene = |seed| Scene { depth_m: [4.0, 20.0], noise_px: 0.6, seed };
    let runs: Vec<_> = (1..=90).filter_map(|seed| errors_if_found(scene(seed))).collect();
    assert!(runs.len() >= 60, "{} of 90 are found", runs.len());
    for axis in 0..3 {
        let within = runs.iter().filter(|run| run[axis][0].abs() <= 2.0 * run[axis][1]).count();
        assert!(100 * within >= 87 * runs.len(), "axis {axis}: {within} of {}", runs.len());
    }
}

#[test]
fn sigma_grows_with_noise_and_with_distance() {
    let ahead_m = |depth_m: [f64; 2], noise_px: f64| {
        (1..=10).map(|seed| errors(Scene { depth_m, noise_px, seed })[2][1]).sum::<f64>() / 10.0
    };
    let near_m = ahead_m([4.0, 20.0], 0.1);
    // What all matches share does not grow with it.
    assert!(ahead_m([4.0, 20.0], 0.4) > 1.1 * near_m, "four times the noise");
    assert!(ahead_m([100.0, 150.0], 0.1) > 2.0 * near_m, "far points alone tell little of the way");
}

#[test]
fn a_standing_camera_keeps_its_covariance() {
    let matrix = core::array::from_fn(|row| {
        core::array::from_fn(|column| if row == column { 1.0 + row as f64 } else { 0.1 })
    });
    let pose = MotionCovariance::from_matrix(&matrix);
    assert_eq!(pose.matrix(), matrix);
    assert_eq!(MotionCovariance::ZERO.after(&pose, &Transform::IDENTITY), pose);
    // Independent errors add up in their squares.
    let twice = pose.after(&pose, &Transform::IDENTITY);
    assert_eq!(twice.matrix(), matrix.map(|row| row.map(|x| 2.0 * x)));
}

#[test]
fn a_turn_carries_the_uncertain_direction_along() {
    let mut matrix = [[0.0; 6]; 6];
    matrix[5][5] = 0.04;
    // What was ahead lies to the right after a quarter turn to the left.
    let turn = Transform::new([0.0, core::f64::consts::FRAC_PI_2, 0.0], [0.0; 3]);
    let pose = MotionCovariance::ZERO.after(&MotionCovariance::from_matrix(&matrix), &turn);
    let [right_m, down_m, ahead_m] = pose.translation_sigma_m();
    assert!((right_m - 0.2).abs() < 1e-9 && down_m < 1e-9 && ahead_m < 1e-9);
    assert!((pose.distance_sigma_m() - 0.2).abs() < 1e-9);
}

#[test]
fn a_turn_measured_otherwise_moves_the_way_that_errs_with_it() {
    // Yaw and the way to the right err together, as far points make them.
    let mut matrix = [[0.0; N]; N];
    for (axis, sigma) in [0.01, 0.01, 0.01, 0.1, 0.1, 0.1].into_iter().enumerate() {
        matrix[axis][axis] = sigma * sigma;
    }
    (matrix[1][3], matrix[3][1]) = (0.0009, 0.0009);
    let covariance = MotionCovariance::from_matrix(&matrix);
    let (step, joined) = covariance.with_turn([0.0, 0.004, 0.0], 0.01 * 0.01);
    // Both errors are alike, so that half of the difference is each one's.
    assert!((step[1] - 0.002).abs() < 1e-12 && (step[3] - 0.018).abs() < 1e-12, "{step:?}");
    assert!([0, 2, 4, 5].iter().all(|&axis| step[axis] == 0.0), "{step:?}");
    let [_, yaw, _] = joined.rotation_sigma_rad();
    let [right, down, _] = joined.translation_sigma_m();
    assert!((yaw - 0.01 / 2f64.sqrt()).abs() < 1e-12, "{yaw}");
    assert!(right < 0.08 && (down - 0.1).abs() < 1e-12, "{right} {down}");
    // One that tells nothing changes nothing.
    let (step, same) = covariance.with_turn([0.0, 0.004, 0.0], 1e9);
    assert!(step.iter().all(|step| step.abs() < 1e-9), "{step:?}");
    assert!((same.rotation_sigma_rad()[1] - 0.01).abs() < 1e-9);
}
