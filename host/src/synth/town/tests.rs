//! Promises of towns.

use super::route::Route;
use super::*;
use crate::synth::{StreetConfig, SynthFrame, World};
use dynvox_core::geometry::Transform;
use nalgebra::{Point3, Vector3};

/// A street's settings on rails, without cars.
fn quiet() -> StreetConfig {
    StreetConfig {
        width: 120,
        height: 40,
        noise_sigma: 0.0,
        shake: 0.0,
        parked_density: 0.0,
        ..StreetConfig::static_street()
    }
}

fn town(street: &StreetConfig, config: TownConfig) -> Town {
    Town::new(street.clone(), config).unwrap()
}

/// Share of a frame's points that another frame sees where they are, of those within 30 m that it
/// looks at.
fn found_again(town: &Town, frame: &SynthFrame, other: &SynthFrame) -> f64 {
    let rig = town.rig();
    let t_other_frame = other.t_world_camera.inverse() * frame.t_world_camera;
    let (mut seen, mut found) = (0, 0);
    for (pixel, &depth_m) in frame.depth_m.iter().enumerate() {
        let [u, v] = [(pixel % frame.width) as f64, (pixel / frame.width) as f64];
        let point = Point3::new(
            (u - rig.center_u_px) / rig.focal_px,
            (v - rig.center_v_px) / rig.focal_px,
            1.0,
        ) * f64::from(depth_m);
        let point = t_other_frame.transform_point(point);
        let [u, v] = [
            rig.center_u_px + rig.focal_px * point.x / point.z,
            rig.center_v_px + rig.focal_px * point.y / point.z,
        ];
        let inside = u > 0.0 && v > 0.0 && u < frame.width as f64 - 1.0;
        if depth_m > 0.0 && point.z > 1.0 && point.z < 30.0 && inside && v < frame.height as f64 {
            let at = v as usize * frame.width + u.round() as usize;
            let depth_m = f64::from(other.depth_m[at]);
            seen += 1;
            found += usize::from((depth_m - point.z).abs() < 0.05 * point.z);
        }
    }
    assert!(seen > frame.depth_m.len() / 3, "{seen} points");
    f64::from(found as u32) / f64::from(seen as u32)
}

#[test]
fn a_lane_is_smooth_as_long_as_it_says_and_closed() {
    for (inner, shift_m) in [(true, 0.0), (false, 0.0), (true, 3.0), (false, 3.0)] {
        let route = Route::new(2, inner, shift_m);
        let (mut length_m, steps) = (0.0, 4000);
        let at = |step: i32| {
            let along_m = route.length_m() * f64::from(step) / f64::from(steps);
            route.t_town_local(along_m, 0.0, 0.0)
        };
        for step in -5..steps - 5 {
            let motion = at(step).inverse() * at(step + 1);
            assert!(motion.translation_m[2] > 0.0 && motion.angle_rad() < 0.03, "step {step}");
            length_m += motion.distance_m();
        }
        assert!((length_m - route.length_m()).abs() < 0.01, "{length_m}");
        assert!((at(0).inverse() * at(steps)).distance_m() < 1e-9);
        // Cars keep to the right, whichever way they go.
        let right = at(0).rotate(Vector3::x());
        let outer = Vector3::new(-1.0, 0.0, 0.0);
        assert_eq!(right.dot(&outer) > 0.0, !inner);
    }
}

#[test]
fn a_frame_is_the_same_bits_in_any_order_and_on_any_threads() {
    let street = StreetConfig { width: 96, height: 32, ..StreetConfig::default() };
    let one = town(&street, TownConfig::default());
    one.frame(200);
    let after_another = one.frame(7);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let alone = pool.install(|| town(&street, TownConfig::default()).frame(7));
    assert!(after_another == alone && after_another != one.frame(8));
}

#[test]
fn one_lap_later_the_camera_sees_what_it_saw() {
    let street = StreetConfig { shake: 1.0, ..quiet() };
    let town = town(&street, TownConfig::default());
    // The last but one frame of the first lap, and the first frame of the second one.
    let lap = town.frames() / 2;
    let (first, again) = (town.frame(0), town.frame(lap));
    assert!((again.t_world_camera.distance_m()) < 1.0, "{:?}", again.t_world_camera);
    let found = found_again(&town, &first, &again);
    assert!(found > 0.7, "{found} of the points are found again");
    let elsewhere = found_again(
        &town,
        &first,
        &SynthFrame { t_world_camera: Transform::IDENTITY, ..town.frame(lap / 2) },
    );
    assert!(elsewhere < 0.6, "half a lap away {elsewhere} of them would be found");
}

#[test]
fn twin_streets_are_the_same_half_a_lap_apart() {
    let at = |twins| {
        let config = TownConfig { twins, ..TownConfig::default() };
        // So fast that half a lap is 120 frames.
        let speed_m_s = town(&quiet(), config).lap_m() / 240.0 * quiet().rate_hz;
        let town = town(&StreetConfig { speed_m_s, ..quiet() }, config);
        [30, 150].map(|frame| town.frame(frame).depth_m)
    };
    let same = |a: &[f32], b: &[f32]| {
        let pairs = a.iter().zip(b).filter(|(a, b)| **a < 60.0 && (**a - **b).abs() < 0.02);
        pairs.count() as f64 / a.len() as f64
    };
    let [near, opposite] = at(TownTwins::Streets);
    assert!(same(&near, &opposite) > 0.8, "{}", same(&near, &opposite));
    let [near, opposite] = at(TownTwins::None);
    assert!(same(&near, &opposite) < 0.6, "{}", same(&near, &opposite));
}

#[test]
fn another_recording_has_other_cars_before_the_same_houses() {
    let street = StreetConfig { parked_density: 0.6, ..quiet() };
    let recording =
        |recording| town(&street, TownConfig { recording, ..TownConfig::default() }).frame(30);
    let (first, second) = (recording(0), recording(1));
    assert_eq!(first.t_world_camera, second.t_world_camera, "a recording on rails");
    let ids = |frame: &SynthFrame| frame.objects.iter().map(|car| car.id).collect::<Vec<_>>();
    assert!(ids(&first) != ids(&second) && first.objects.len() > 10);
    let still = |pixel: &usize| first.instances[*pixel] == 0 && second.instances[*pixel] == 0;
    for pixel in (0..first.depth_m.len()).filter(still) {
        assert_eq!(first.depth_m[pixel], second.depth_m[pixel], "pixel {pixel}");
    }
}

#[test]
fn no_car_comes_near_the_camera_in_either_direction() {
    let street = StreetConfig { parked_density: 1.0, shake: 1.0, ..StreetConfig::default() };
    let street = StreetConfig { width: 32, height: 32, ..street };
    for (reverse, lane_shift_m) in [(false, 0.0), (true, 0.0), (false, 0.6)] {
        let config = TownConfig { reverse, lane_shift_m, ..TownConfig::default() };
        let town = town(&street, config);
        for index in 0..town.frames() / 2 {
            let t_world_camera = town.t_world_camera(index);
            let cars = town.objects(index);
            assert!(cars.len() > 40, "{} cars", cars.len());
            for car in cars {
                let t_car_camera = car.t_world_object.inverse() * t_world_camera;
                let [x, _, z] = t_car_camera.translation_m;
                let [width, _, length] = car.dimensions_m;
                let clear = x.abs() > 0.5 * width + 0.6 || z.abs() > 0.5 * length + 0.6;
                assert!(clear, "car {} in frame {index}, reverse {reverse}", car.id);
            }
        }
    }
}

#[test]
fn a_town_out_of_range_is_refused_by_name() {
    let none = TownConfig { blocks: 0, ..TownConfig::default() };
    let error = Town::new(quiet(), none).err().unwrap().to_string();
    assert!(error.contains("town.blocks"), "{error}");
}
