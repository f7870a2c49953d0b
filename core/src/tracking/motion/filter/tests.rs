//! The filter, on points of a car with closed answers.

use super::*;
use crate::random::Random;
use std::vec::Vec;

const RIG: StereoRig =
    StereoRig { focal_px: 721.5, center_u_px: 609.6, center_v_px: 172.9, baseline_m: 0.54 };
const INTERVAL_S: f64 = 0.1;

/// A camera at the world's origin.
fn view(noise_px: f64) -> FilterView<'static> {
    let t_world_camera = &Transform::IDENTITY;
    FilterView { rig: &RIG, t_world_camera, interval_s: INTERVAL_S, noise_px }
}

/// A number about 0 with a standard deviation of 1: the sum of twelve uniform ones.
fn normal(random: &mut Random) -> f64 {
    (0..12).map(|_| f64::from(random.below(1 << 20)) / f64::from(1 << 20)).sum::<f64>() - 6.0
}

/// Points on a car's back, `depth_m` before the camera, that moved by `rate` and are seen with
/// an error; those before as well.
fn frame(random: &mut Random, depth_m: f64, rate: [f64; 6], noise_px: f64) -> Vec<Observation> {
    let center = Vector3::new(1.0, 0.5, depth_m);
    let turn =
        Transform::new(Vector3::new(rate[0], rate[1], rate[2]) * INTERVAL_S, Vector3::zeros());
    let project = |p: Vector3<f64>| {
        let per_m = RIG.focal_px / p.z;
        ([p.x * per_m, p.y * per_m], [(p.x - RIG.baseline_m) * per_m, p.y * per_m])
    };
    (0..60)
        .map(|_| {
            let [x, y, z] = [(); 3].map(|()| f64::from(random.below(1000)) / 1000.0 - 0.5);
            let point = center + Vector3::new(1.8 * x, 1.4 * y, 1.0 * z);
            let (before, before_right) = project(point);
            let mut noise = || normal(random) * noise_px;
            let disparity = before[0] + noise() - before_right[0] - noise();
            let per_px = RIG.baseline_m / disparity;
            let static_prediction = Point3::new(
                (before[0] + noise()) * per_px,
                (before[1] + noise()) * per_px,
                RIG.focal_px * per_px,
            );
            let moved = center
                + turn.rotate(point - center)
                + Vector3::new(rate[3], rate[4], rate[5]) * INTERVAL_S;
            let (left, right) = project(moved);
            Observation {
                static_prediction,
                left: [left[0] + noise(), left[1] + noise()],
                right: [right[0] + noise(), right[1] + noise()],
            }
        })
        .collect()
}

fn track(
    depth_m: f64,
    noise_px: f64,
    frames: usize,
    rate: impl Fn(usize) -> [f64; 6],
) -> Vec<MotionFilter> {
    let mut random = Random::new(7);
    let mut filter = MotionFilter::default();
    let config = MotionConfig::default();
    (0..frames)
        .map(|n| {
            filter.predict(&config, INTERVAL_S);
            let seen = frame(&mut random, depth_m, rate(n), noise_px);
            let noise = if noise_px > 0.1 { noise_px * 1.5 } else { 0.1 };
            assert!(filter.update(&config, &view(noise), seen.iter().copied()));
            filter
        })
        .collect()
}

#[test]
fn exact_observations_give_the_motion_at_once() {
    let rate = [0.0, 0.3, 0.0, 2.0, 0.0, 9.0];
    let filter = track(12.0, 0.0, 1, |_| rate)[0];
    let error = (filter.velocity() - Vector3::new(2.0, 0.0, 9.0)).norm();
    assert!(error < 0.1, "{error} m/s");
    assert!(
        (filter.angular_velocity() - Vector3::new(0.0, 0.3, 0.0)).norm() < 0.05,
        "{}",
        filter.angular_velocity()
    );
}

#[test]
fn a_far_car_is_known_better_after_ten_frames_than_after_one_and_says_so() {
    let filters = track(30.0, 0.3, 40, |_| [0.0, 0.0, 0.0, 0.0, 0.0, 8.0]);
    let error = |filter: &MotionFilter| (filter.velocity() - Vector3::new(0.0, 0.0, 8.0)).norm();
    let late: f64 = filters[10..].iter().map(error).sum::<f64>() / 30.0;
    assert!(late * INTERVAL_S < 0.05, "{late} m/s");
    assert!(
        filters[20].speed()[1] < 0.7 * filters[0].speed()[1],
        "{:?} {:?}",
        filters[20].speed(),
        filters[0].speed()
    );
    let within = filters.iter().filter(|filter| error(filter) < 3.0 * filter.speed()[1]).count();
    assert!(within >= 38, "the error is what it says to be: {within} of 40");
}

#[test]
fn a_car_that_brakes_is_followed() {
    let filters = track(15.0, 0.3, 30, |n| {
        [0.0, 0.0, 0.0, 0.0, 0.0, if n < 10 { 8.0 } else { 8.0 - 0.3 * (n - 10) as f64 }]
    });
    let late = filters[29].speed();
    assert!((late[0] - 2.3).abs() < 0.8, "{late:?}");
}

#[test]
fn one_contradicting_frame_is_not_believed_but_two_are() {
    let still = [0.0; 6];
    let fast = [0.0, 0.0, 0.0, 0.0, 0.0, 9.0];
    let mut random = Random::new(3);
    let config = MotionConfig::default();
    let mut filter = MotionFilter::default();
    let mut take = |rate: [f64; 6]| {
        filter.predict(&config, INTERVAL_S);
        let seen = frame(&mut random, 12.0, rate, 0.3);
        (filter.update(&config, &view(0.4), seen.iter().copied()), filter.speed()[0])
    };
    for _ in 0..5 {
        assert!(take(still).0);
    }
    let (taken, speed) = take(fast);
    assert!(!taken && speed < 0.5, "{speed}");
    assert!(take(still).0, "an outlier is forgotten");
    assert!(!take(fast).0);
    let (taken, speed) = take(fast);
    assert!(taken && (speed - 9.0).abs() < 1.0, "{speed}");
}

#[test]
fn the_motion_turns_about_the_middle() {
    let filter = track(10.0, 0.0, 1, |_| [0.0, 0.5, 0.0, 1.0, 0.0, 3.0])[0];
    let center = filter.center_world();
    let moved = filter.motion(INTERVAL_S).transform_point(center);
    assert!((moved - center - filter.velocity() * INTERVAL_S).norm() < 1e-12);
}

#[test]
fn nonsense_is_refused_and_changes_nothing() {
    let config = MotionConfig::default();
    let mut filter = MotionFilter::default();
    filter.predict(&config, INTERVAL_S);
    let before = filter;
    let bad = [Observation {
        static_prediction: Point3::new(f64::NAN, 0.0, 10.0),
        left: [0.0; 2],
        right: [0.0; 2],
    }; 4];
    assert!(!filter.update(&config, &view(0.3), bad.iter().copied()));
    assert_eq!(filter, before);
}

#[test]
fn a_motion_is_not_made_of_two_points() {
    let config = MotionConfig::default();
    let sighting = |x: f64| Observation {
        static_prediction: Point3::new(x, 0.0, 10.0),
        left: [72.15 * x, 0.0],
        right: [72.15 * x - 38.96, 0.0],
    };
    let is_updated = |count: usize| {
        let mut filter = MotionFilter::default();
        filter.predict(&config, INTERVAL_S);
        let seen = [0.0, 1.0, 0.5].into_iter().take(count).map(sighting);
        filter.update(&config, &view(0.3), seen)
    };
    assert_eq!([is_updated(2), is_updated(3)], [false, true]);
}
