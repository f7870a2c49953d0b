//! A camera that moves by millimetres a frame: pictures are sums of waves, exact at any position
//! below the pixel.

use super::*;
use crate::egomotion::{Anchor, MotionCovariance, SlowFrame};
use std::{f64::consts::TAU, println};

/// Focal length of the scene, px, and its panels: left end, right end and depth, m.
const FOCAL_PX: f64 = RIG.focal_px;
const PANELS: [[f64; 3]; 4] =
    [[-4.0, -2.2, 5.0], [-3.4, -0.2, 9.0], [0.3, 5.0, 14.0], [2.2, 5.0, 6.0]];
const WAVES: usize = 24;
const ANCHOR_BYTES: usize = Anchor::bytes(&CAPACITY);

/// A wave on a panel: along and down, 1/m, its phase and its height.
type Wave = [f64; 4];

/// Panels with a pattern of their own.
struct Scene([[Wave; WAVES]; 4]);

impl Scene {
    fn new() -> Self {
        let mut random = Random::new(7);
        let mut uniform = |low: f64, high: f64| {
            low + (high - low) * f64::from(random.below(1 << 24)) / f64::from(1 << 24)
        };
        Self(PANELS.map(|[_, _, depth]| {
            [(); WAVES].map(|()| {
                // Waves of 3.2 to 40 px in the first image: nothing is lost between two pixels.
                let length_m = uniform(3.2f64.ln(), 40f64.ln()).exp() * depth / FOCAL_PX;
                let angle = uniform(0.0, TAU / 2.0);
                let along = [angle.cos() / length_m, angle.sin() / length_m];
                [along[0], along[1], uniform(0.0, TAU), uniform(4.0, 8.0)]
            })
        }))
    }

    /// Both images from `ahead_m` along the axis, with up to two grey levels of noise.
    fn see(&self, ahead_m: f64, noise: &mut Random) -> [Vec<u8>; 2] {
        [0.0, RIG.baseline_m].map(|eye_m| {
            let mut pixels = Vec::with_capacity(WIDTH * HEIGHT);
            for v in 0..HEIGHT {
                for u in 0..WIDTH {
                    let x = (u as f64 - RIG.center_u_px) / FOCAL_PX;
                    let y = (v as f64 - RIG.center_v_px) / FOCAL_PX;
                    let grey = 110.0 + self.pattern([x, y], ahead_m, eye_m);
                    pixels.push((grey + f64::from(noise.below(5)) - 2.0).round() as u8);
                }
            }
            pixels
        })
    }

    fn pattern(&self, [x, y]: [f64; 2], ahead_m: f64, eye_m: f64) -> f64 {
        let mut sum = 0.0;
        for ([left_m, right_m, depth_m], waves) in PANELS.iter().zip(&self.0) {
            let z = depth_m - ahead_m;
            let at = [eye_m + x * z, y * z];
            // Ends are as soft as the waves.
            let end_m = 0.008 * depth_m;
            let inside = |way_m: f64| 1.0 / (1.0 + (-way_m / end_m).exp());
            let share = inside(at[0] - left_m) * inside(right_m - at[0]);
            if share > 1e-3 {
                let wave = |w: &Wave| w[3] * (TAU * (w[0] * at[0] + w[1] * at[1]) + w[2]).cos();
                sum += share * waves.iter().map(wave).sum::<f64>();
            }
        }
        sum
    }
}

/// Poses of a camera at `ways_m` along its axis, with an anchor or without.
fn travel(ways_m: &[f64], anchored: bool) -> Vec<Transform> {
    travel_noisily(ways_m, anchored, 3).into_iter().map(|frame| frame.t_world_camera).collect()
}

/// Pose of a frame, and the estimate that led to it; the first one has none.
struct Travelled {
    t_world_camera: Transform,
    estimate: Option<MotionEstimate>,
}

/// Camera like that of [`travel`], with noise drawn from a seed.
fn travel_noisily(ways_m: &[f64], anchored: bool, seed: u64) -> Vec<Travelled> {
    let (mut flow_slab, mut slab) = (slab(), Box::new(Slab([0; BYTES])));
    let mut anchor_slab = Box::new(Slab([0; ANCHOR_BYTES]));
    let mut matcher = FlowMatcher::new_in(
        &CAPACITY,
        &mut Carver::new(&mut flow_slab.0, FlowMatcher::bytes(&CAPACITY)).unwrap(),
    );
    let mut estimator = estimator(&mut slab);
    let mut anchor =
        Anchor::new_in(&CAPACITY, &mut Carver::new(&mut anchor_slab.0, ANCHOR_BYTES).unwrap());
    let (scene, mut noise, mut camera) = (Scene::new(), Random::new(seed), Egomotion::default());
    let config = EgomotionConfig::default();
    let mut travelled = vec![Travelled { t_world_camera: Transform::IDENTITY, estimate: None }];
    for (frame, &way_m) in ways_m.iter().enumerate() {
        let [left, right] = scene.see(way_m, &mut noise);
        let view = |pixels| View::new(pixels, WIDTH, HEIGHT).unwrap();
        matcher.push(&SceneFlowConfig::default(), view(&left), view(&right), &Serial);
        if frame > 0 {
            let matches = matcher.bucketed();
            let mut estimate =
                camera.step(&config, &RIG, at_10_hz(matches.clone()), &mut estimator);
            assert_eq!(estimate.status, MotionStatus::Estimated, "{frame}");
            if anchored {
                let frame = SlowFrame { config: &config, rig: &RIG, matcher: &matcher, matches };
                anchor.step(&frame, &mut camera, &mut estimate, &mut estimator);
            }
            let t_world_camera = *camera.t_world_camera();
            travelled.push(Travelled { t_world_camera, estimate: Some(estimate) });
        }
    }
    travelled
}

/// Covariances of the poses against the first one.
fn integrated(travelled: &[Travelled]) -> Vec<MotionCovariance> {
    let first = (MotionCovariance::ZERO, Transform::IDENTITY);
    let (mut anchor, mut last, mut all) = (first, first, vec![first.0]);
    for Travelled { t_world_camera, estimate } in travelled {
        let Some(estimate) = estimate else { continue };
        if !estimate.anchored {
            anchor = last;
        }
        let motion = t_world_camera.inverse() * anchor.1;
        let covariance = estimate.covariance.unwrap().after(&anchor.0, &motion);
        last = (covariance, *t_world_camera);
        all.push(covariance);
    }
    all
}

/// Frames `step_m` apart.
fn steady(step_m: f64, frames: usize) -> Vec<f64> {
    (0..frames).map(|frame| step_m * frame as f64).collect()
}

#[dynvox_needs::long]
#[test]
fn the_way_of_a_slow_camera_is_right_within_a_hundredth() {
    for (step_m, frames) in [(0.005, 60), (0.015, 30)] {
        let way_m = step_m * (frames - 1) as f64;
        let ways = steady(step_m, frames);
        let [with, without] = [true, false].map(|anchored| {
            let pose = *travel(&ways, anchored).last().unwrap();
            pose.translation_m[2] / way_m - 1.0
        });
        println!("{step_m} m a frame: {with:+.4} of the way with an anchor, {without:+.4} without");
        assert!(with.abs() < 0.01, "{step_m} m a frame: {with}");
        assert!(without.abs() > 2.0 * with.abs(), "{without} without an anchor");
    }
}

#[test]
fn a_camera_that_stands_keeps_its_place() {
    let poses = travel(&[0.0; 40], true);
    let drift_m = |pose: &Transform| pose.distance_m();
    let farthest_m = poses.iter().map(drift_m).fold(0.0, crate::geometry::scalar::max_f64);
    let without_m = drift_m(travel(&[0.0; 40], false).last().unwrap());
    println!("standing: {farthest_m:.5} m at most, {without_m:.5} m without an anchor");
    assert!(farthest_m < 0.003, "{farthest_m}");
}

#[test]
fn a_fast_camera_has_the_bits_of_one_without_an_anchor() {
    let ways = steady(0.2, 5);
    assert_eq!(travel(&ways, true), travel(&ways, false));
}

#[test]
fn a_camera_that_speeds_up_and_slows_down_again_is_followed() {
    // Steps from 4 mm to 0.2 m and back.
    let steps = [0.004; 20].into_iter().chain([0.05, 0.12, 0.2, 0.2, 0.1, 0.03]).chain([0.004; 20]);
    let ways: Vec<f64> = steps
        .scan(0.0, |way, step| {
            *way += step;
            Some(*way)
        })
        .collect();
    let poses = travel(&ways, true);
    let (last, way_m) = (poses.last().unwrap(), ways.last().unwrap() - ways[0]);
    let error_m = last.translation_m[2] - way_m;
    println!("{error_m:+.5} m of {way_m} m");
    assert!(error_m.abs() < 0.01 * way_m, "{error_m}");
}

/// Errors of position along the camera's axes against two sigma, over all frames but the first.
#[derive(Clone, Copy, Debug, Default)]
struct Within {
    count: u32,
    within: u32,
    squared: f64,
    variance: f64,
}

impl Within {
    fn add(&mut self, error_m: f64, sigma_m: f64) {
        self.count += 1;
        self.within += u32::from(error_m.abs() <= 2.0 * sigma_m);
        self.squared += error_m * error_m;
        self.variance += sigma_m * sigma_m;
    }

    fn share(&self) -> f64 {
        f64::from(self.within) / f64::from(self.count)
    }

    /// Sigma per error, as a ratio of their root mean squares.
    fn excess(&self) -> f64 {
        (self.variance / self.squared).sqrt()
    }
}

/// Certainty to the right, downwards and ahead, of cameras with a noise of their own each.
fn certainty(ways_m: &[f64], anchored: bool) -> [Within; 3] {
    let mut axes = [Within::default(); 3];
    for seed in 1..=2 {
        let travelled = travel_noisily(ways_m, anchored, seed);
        let sigmas = integrated(&travelled);
        for ((frame, covariance), way_m) in travelled.iter().zip(sigmas).zip(ways_m).skip(1) {
            let [right, down, ahead] = frame.t_world_camera.translation_m;
            let errors_m = [right, down, ahead - (way_m - ways_m[0])];
            for (axis, (error_m, sigma_m)) in
                axes.iter_mut().zip(errors_m.into_iter().zip(covariance.translation_sigma_m()))
            {
                axis.add(error_m, sigma_m);
            }
        }
    }
    axes
}

#[dynvox_needs::long]
#[test]
fn errors_of_a_slow_camera_lie_within_two_sigma() {
    let mut all = Vec::new();
    for (step_m, frames) in [(0.003, 36), (0.01, 30), (0.03, 20)] {
        let axes = certainty(&steady(step_m, frames), true);
        let shown = axes.map(|axis| [axis.share(), axis.excess()]);
        println!("{step_m} m a frame: shares within and sigma per error {shown:.2?}");
        for (axis, within) in ["right", "down", "ahead"].iter().zip(axes) {
            let (share, excess) = (within.share(), within.excess());
            // Errors of one way are alike from frame to frame: a single axis may be unlucky.
            assert!(share > 0.5, "{step_m} m a frame, {axis}: {share} within two sigma");
            assert!(excess < 5.0, "{step_m} m a frame, {axis}: sigma {excess} times the error");
        }
        all.extend(axes);
    }
    let share = all.iter().map(Within::share).sum::<f64>() / all.len() as f64;
    assert!((0.9..=0.99).contains(&share), "{share} within two sigma");
}

#[test]
fn errors_that_motions_share_are_in_no_sigma_without_an_anchor() {
    let [.., ahead] = certainty(&steady(0.005, 30), false);
    println!("without an anchor {:.2} within, sigma {:.2}", ahead.share(), ahead.excess());
    assert!(ahead.share() < 0.7, "{}", ahead.share());
}
