mod camera;
mod clip;
mod rivals;
mod slow;
mod turned;

use super::{
    Egomotion, EgomotionConfig, Estimator, MAX_REFERENCE_FRAMES, MotionEstimate, MotionHypotheses,
    MotionStatus, TimedMatches,
};
use crate::{
    geometry::{MapSegment, StereoRig, Transform},
    image::View,
    memory::{Carver, Slab},
    parallel::Serial,
    random::Random,
    scene_flow::{
        FlowMatcher, Match, SceneFlowConfig,
        test_scene::{HEIGHT, RIG, WIDTH, see},
        tests::{CAPACITY, slab},
    },
};
use nalgebra::{Point3, Vector3};
use std::{boxed::Box, vec, vec::Vec};

const BYTES: usize = Estimator::bytes(&CAPACITY);

fn estimator(slab: &mut Slab<BYTES>) -> Estimator<'_> {
    Estimator::new_in(&CAPACITY, &mut Carver::new(&mut slab.0, BYTES).unwrap())
}

/// Distance, m, and angle, degrees, between two motions.
fn between(a: &Transform, b: &Transform) -> (f64, f64) {
    let difference = a.inverse() * b;
    (difference.distance_m(), difference.angle_rad().to_degrees())
}

/// Moves a camera through the scene and returns estimate and truth of every frame after the first.
fn walk(motions: &[Transform]) -> Vec<(MotionEstimate, Transform)> {
    let (mut flow_slab, mut slab) = (slab(), Box::new(Slab([0; BYTES])));
    let mut matcher = FlowMatcher::new_in(
        &CAPACITY,
        &mut Carver::new(&mut flow_slab.0, FlowMatcher::bytes(&CAPACITY)).unwrap(),
    );
    let mut estimator = estimator(&mut slab);
    let mut camera = Egomotion::default();
    let mut t_world_camera = Transform::IDENTITY;
    let mut estimates = Vec::new();
    for frame in 0..=motions.len() {
        let [left, right] = see(&t_world_camera);
        let view = |pixels| View::new(pixels, WIDTH, HEIGHT).unwrap();
        matcher.push(&SceneFlowConfig::default(), view(&left), view(&right), &Serial);
        if frame > 0 {
            let estimate = camera.step(
                &EgomotionConfig::default(),
                &RIG,
                at_10_hz(matcher.bucketed()),
                &mut estimator,
            );
            // Estimates are motions of the scene against the camera: the inverse.
            estimates.push((estimate, motions[frame - 1].inverse()));
        }
        if let Some(motion) = motions.get(frame) {
            t_world_camera = t_world_camera * motion;
        }
    }
    let (distance, angle) = between(camera.t_world_camera(), &t_world_camera);
    assert!(
        distance < 0.05 && angle < 0.5,
        "the trajectory is the product of the motions: {distance} m, {angle} degrees"
    );
    estimates
}

#[test]
fn estimates_the_trajectory_through_a_textured_scene() {
    let motion = |metres: f64, turn: f64, tilt: f64| {
        Transform::new(
            Vector3::new(tilt, turn, 0.3 * turn),
            Vector3::new(0.1 * metres, -0.02, metres),
        )
    };
    // Ahead, in curves, backwards, turning on the spot, and standing.
    let motions = [
        motion(0.5, 0.02, 0.0),
        motion(0.5, 0.02, 0.004),
        motion(0.3, -0.05, -0.01),
        motion(-0.4, 0.01, 0.0),
        motion(0.0, 0.06, 0.01),
        motion(0.0, 0.0, 0.0),
    ];
    for (frame, (estimate, truth)) in walk(&motions).iter().enumerate() {
        assert_eq!(estimate.status, MotionStatus::Estimated, "{frame}");
        let (distance, angle) = between(&estimate.t_current_previous.unwrap(), truth);
        assert!(distance < 0.02 && angle < 0.3, "frame {frame}: {distance} m, {angle} degrees");
        assert!(estimate.residual_rms_px < 0.5 && estimate.inliers * 10 > estimate.matches * 7);
    }
}

#[test]
fn turning_on_the_spot_and_standing_still_are_motions_too() {
    let turn = Transform::new(Vector3::new(0.0, 0.05, 0.0), Vector3::zeros());
    let estimates = walk(&[turn, Transform::IDENTITY]);
    let (distance, angle) = between(&estimates[0].0.t_current_previous.unwrap(), &turn.inverse());
    assert!(distance < 0.01 && angle < 0.1, "{distance} m, {angle} degrees");
    let (distance, angle) =
        between(&estimates[1].0.t_current_previous.unwrap(), &Transform::IDENTITY);
    assert!(distance < 1e-6 && angle < 1e-5, "equal images: {distance} m, {angle} degrees");
}

fn project(point: &Point3<f64>) -> [[f32; 2]; 2] {
    [0.0, RIG.baseline_m].map(|x| {
        let u = RIG.center_u_px + RIG.focal_px * (point.x - x) / point.z;
        [u as f32, (RIG.center_v_px + RIG.focal_px * point.y / point.z) as f32]
    })
}

/// Exact matches of random points; the first `outliers` of them get random pixels.
fn matches(count: usize, outliers: usize, motion: &Transform, random: &mut Random) -> Vec<Match> {
    let uniform = |random: &mut Random, low: f64, high: f64| low + (high - low) * random.fraction();
    (0..count)
        .map(|i| {
            let z = uniform(random, 4.0, 30.0);
            let point =
                Point3::new(uniform(random, -0.7, 0.7) * z, uniform(random, -0.3, 0.3) * z, z);
            let ([previous_left, previous_right], [mut current_left, mut current_right]) =
                (project(&point), project(&motion.transform_point(point)));
            if i < outliers {
                // Both images are wrong, and not in the same way.
                for pixel in [&mut current_left, &mut current_right] {
                    *pixel =
                        [uniform(random, 0.0, 400.0) as f32, uniform(random, 0.0, 160.0) as f32];
                }
            }
            Match { previous_left, previous_right, current_left, current_right }
        })
        .collect()
}

/// Matches of a frame that is a tenth of a second after the last one.
fn at_10_hz<M>(matches: M) -> TimedMatches<M> {
    TimedMatches { interval_s: 0.1, matches }
}

fn motion() -> Transform {
    Transform::new(Vector3::new(0.01, -0.03, 0.02), Vector3::new(0.1, 0.05, -1.1))
}

fn estimate(matches: &[Match], rig: &StereoRig, seed: u64) -> (MotionEstimate, Vec<u32>) {
    let mut slab = Box::new(Slab([0; BYTES]));
    let mut estimator = estimator(&mut slab);
    let estimate = estimator.estimate(
        &EgomotionConfig::default(),
        rig,
        matches,
        MotionHypotheses::from_draws(&mut Random::new(seed)),
    );
    (estimate, estimator.inliers().collect())
}

#[test]
fn two_outliers_in_five_are_found() {
    let matches = matches(500, 200, &motion(), &mut Random::new(3));
    let (estimate, inliers) = estimate(&matches, &RIG, 1);
    let (distance, angle) = between(&estimate.t_current_previous.unwrap(), &motion());
    assert!(distance < 1e-4 && angle < 1e-3, "{distance} m, {angle} degrees");
    assert_eq!(inliers, (200..500).collect::<Vec<u32>>());
    assert_eq!((estimate.matches, estimate.inliers), (500, 300));
    assert!(estimate.residual_rms_px < 1e-3 && estimate.samples < 500, "{estimate:?}");
}

#[test]
fn inliers_that_are_off_together_pull_a_robust_refinement_less() {
    let mut random = Random::new(4);
    let mut matches = matches(600, 0, &motion(), &mut random);
    for (n, m) in matches.iter_mut().enumerate() {
        // One in five lies a pixel off to one side, within what counts as an inlier.
        let off_px = if n % 5 == 0 { 1.0 } else { 0.0 };
        for column in [&mut m.current_left[0], &mut m.current_right[0]] {
            *column += off_px + 0.1 * (random.below(200) as f32 / 100.0 - 1.0);
        }
    }
    let turn_off = |robust_px: f64| {
        let mut slab = Box::new(Slab([0; BYTES]));
        let config = EgomotionConfig { robust_px, side_knee: 10.0, ..EgomotionConfig::default() };
        let found = estimator(&mut slab).estimate(
            &config,
            &RIG,
            &matches,
            MotionHypotheses::from_draws(&mut Random::new(1)),
        );
        assert!(found.inliers > 590, "{found:?}");
        between(&found.t_current_previous.unwrap(), &motion()).1
    };
    let (alike, robust) = (turn_off(100.0), turn_off(EgomotionConfig::default().robust_px));
    assert!(robust < 0.3 * alike, "{robust} of {alike} degrees");
}

#[test]
fn equal_seeds_give_equal_bits_and_a_warm_start_the_same_answer() {
    let matches = matches(300, 120, &motion(), &mut Random::new(4));
    // The bits: the search must not depend on anything but the seed.
    assert_eq!(estimate(&matches, &RIG, 7), estimate(&matches, &RIG, 7));
    let mut slab = Box::new(Slab([0; BYTES]));
    let mut estimator = estimator(&mut slab);
    let warm = estimator.estimate(
        &EgomotionConfig::default(),
        &RIG,
        &matches,
        MotionHypotheses { random: &mut Random::new(7), initial: Some(&motion()) },
    );
    let cold = estimate(&matches, &RIG, 7).0;
    let (distance, angle) =
        between(&warm.t_current_previous.unwrap(), &cold.t_current_previous.unwrap());
    assert!(distance < 1e-9 && angle < 1e-9);
    assert!(warm.samples <= cold.samples, "the first hypothesis is already right");
}

#[test]
fn too_little_gives_a_status_and_no_motion() {
    let good = matches(5, 0, &motion(), &mut Random::new(5));
    let (estimate_of_few, _) = estimate(&good, &RIG, 1);
    assert_eq!(
        (estimate_of_few.status, estimate_of_few.t_current_previous),
        (MotionStatus::TooFewMatches, None)
    );
    assert_eq!(estimate(&[], &RIG, 1).0.status, MotionStatus::TooFewMatches);
    let (lost, inliers) = estimate(&matches(60, 60, &motion(), &mut Random::new(6)), &RIG, 1);
    // Outliers alone may agree by chance, but then with as many as the least.
    assert_ne!(lost.status, MotionStatus::TooFewMatches);
    assert!(lost.t_current_previous.is_none() || lost.inliers >= 6);
    assert_eq!(inliers.len(), lost.inliers as usize);
    let same_point = vec![good[0]; 50];
    assert_eq!(
        estimate(&same_point, &RIG, 1).0.t_current_previous,
        None,
        "one point determines no motion"
    );
    for rig in [StereoRig { baseline_m: 0.0, ..RIG }, StereoRig { focal_px: f64::NAN, ..RIG }] {
        assert_eq!(
            estimate(&matches(60, 0, &motion(), &mut Random::new(6)), &rig, 1).0.status,
            MotionStatus::BadRig
        );
    }
}

#[test]
fn what_is_not_finite_or_behind_is_left_out() {
    let mut matches = matches(80, 0, &motion(), &mut Random::new(9));
    // In each of the four positions, and values whose squares overflow.
    for (i, value) in
        [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1e30].into_iter().enumerate()
    {
        matches[i].previous_left[0] = value;
        matches[i + 10].previous_right[1] = value;
        matches[i + 20].current_left[1] = value;
        matches[i + 30].current_right[0] = value;
    }
    // Disparity below 0: behind the camera.
    matches[45].previous_right[0] = matches[45].previous_left[0] + 3.0;
    let (estimate, inliers) = estimate(&matches, &RIG, 1);
    let (distance, angle) = between(&estimate.t_current_previous.unwrap(), &motion());
    assert!(distance < 1e-4 && angle < 1e-3);
    assert!(!inliers.contains(&45) && inliers.iter().all(|&i| i >= 5), "{inliers:?}");
}

#[test]
fn matches_beyond_the_capacity_are_ignored() {
    let matches = matches(CAPACITY.matches + 50, 0, &motion(), &mut Random::new(2));
    let (estimate, _) = estimate(&matches, &RIG, 1);
    assert_eq!(estimate.matches as usize, CAPACITY.matches);
}

#[test]
fn allocates_exactly_the_bytes_it_names() {
    let mut slab = Box::new(Slab([0; BYTES]));
    let mut carver = Carver::new(&mut slab.0, BYTES).unwrap();
    Estimator::new_in(&CAPACITY, &mut carver);
    assert_eq!(carver.footprint().bytes(), BYTES);
}

impl Egomotion {
    /// Flips a bit of a component of the pose: x, y, z, w of the rotation, x, y, z of the
    /// translation.
    pub(crate) fn flip(&mut self, component: usize, bit: u32) {
        let pose = self.pose_mut();
        let number = match component {
            0..4 => &mut pose.rotation[component],
            _ => &mut pose.translation_m[component - 4],
        };
        *number = f64::from_bits(number.to_bits() ^ 1 << bit);
    }
}
