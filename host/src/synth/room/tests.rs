//! Promises of rooms and yards.

use super::*;
use crate::formats::GRAVITY_M_S2;
use crate::synth::room::extent::Extent;
use crate::synth::{StreetUnit, SynthFrame, World, t_camera_unit};
use dynvox_core::digest::Digest;
use dynvox_core::geometry::Transform;
use nalgebra::{Point3, Vector3};

fn quiet() -> RoomConfig {
    RoomConfig { width: 120, height: 80, noise_sigma: 0.0, ..RoomConfig::default() }
}

/// The point that a pixel's centre sees, in the world of the poses.
fn seen(room: &Room, frame: &SynthFrame, pixel: usize) -> Point3<f64> {
    let (rig, depth_m) = (room.rig(), f64::from(frame.depth_m[pixel]));
    let [u, v] = [(pixel % frame.width) as f64, (pixel / frame.width) as f64];
    frame.t_world_camera.transform_point(Point3::new(
        (u - rig.center_u_px) / rig.focal_px * depth_m,
        (v - rig.center_v_px) / rig.focal_px * depth_m,
        depth_m,
    ))
}

fn digest(frame: &SynthFrame) -> u64 {
    let mut digest = Digest::default();
    digest.bytes(frame.left_rgb.as_flattened());
    digest.bytes(frame.right_rgb.as_flattened());
    digest.bytes(&frame.instances);
    for depth_m in &frame.depth_m {
        digest.f64(f64::from(*depth_m));
    }
    digest.finish()
}

#[test]
fn a_frame_is_the_same_bits_in_any_order_and_on_any_threads() {
    for kind in [RoomKind::Room, RoomKind::Yard] {
        let config = RoomConfig { shutter_s: 0.01, light_swing: 0.3, people: 2, ..quiet() };
        let room = Room::new(kind, config.clone()).unwrap();
        room.frame(40);
        let after_another = room.frame(7);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let alone = pool.install(|| Room::new(kind, config).unwrap().frame(7));
        assert!(after_another == alone);
        assert!(after_another != room.frame(8));
        println!("{kind:?}: {:#x}", digest(&alone));
    }
}

#[test]
fn every_ray_ends_within_the_room_and_most_at_its_walls() {
    let config = RoomConfig { people: 0, ..quiet() };
    let extent = Extent::new(RoomKind::Room, &config);
    let room = Room::new(RoomKind::Room, config).unwrap();
    let [x, z] = extent.half_m;
    let t_room_world = room.t_camera0_room.inverse();
    for index in [0, 33] {
        let frame = room.frame(index);
        let mut on_shell = 0;
        for pixel in 0..frame.depth_m.len() {
            let point = t_room_world.transform_point(seen(&room, &frame, pixel));
            // Distances to the walls, the floor and the ceiling, negative outside.
            let inside =
                [x - point.x.abs(), z - point.z.abs(), -point.y, point.y + extent.height_m];
            let least = inside.into_iter().fold(f64::MAX, f64::min);
            assert!(least > -1e-4, "a pixel sees {point}, outside of the room");
            on_shell += usize::from(least < 1e-4);
        }
        let share = on_shell as f64 / frame.depth_m.len() as f64;
        assert!((0.3..0.99).contains(&share), "{share} of the pixels see walls");
    }
}

#[test]
fn people_walk_within_their_boxes_and_are_all_that_moves() {
    for kind in [RoomKind::Room, RoomKind::Yard] {
        let room = Room::new(kind, RoomConfig { people: 3, ..quiet() }).unwrap();
        let mut seen_people = 0;
        for index in [0, 20, 55] {
            let frame = room.frame(index);
            assert_eq!(frame.objects.len(), 3);
            let shown = (0..frame.depth_m.len()).filter(|&pixel| frame.instances[pixel] > 0);
            for pixel in shown {
                seen_people += 1;
                assert!(frame.is_moving(pixel));
                let person = &frame.objects[usize::from(frame.instances[pixel]) - 1];
                let point = seen(&room, &frame, pixel);
                let inside = person.t_world_object.inverse().transform_point(point);
                let [width, height, length] = person.dimensions_m;
                assert!(
                    inside.x.abs() < 0.5 * width
                        && inside.z.abs() < 0.5 * length
                        && (-height..0.001).contains(&inside.y),
                    "{kind:?}: person {} at {inside}",
                    person.id
                );
            }
            let t_next = |frame: &SynthFrame| frame.objects[0].t_world_object;
            let way_m = (t_next(&frame).inverse() * t_next(&room.frame(index + 1))).distance_m();
            let expected_m = frame.objects[0].speed_m_s / 20.0;
            assert!((way_m - expected_m).abs() < 0.05 * expected_m, "{way_m} {expected_m}");
        }
        assert!(seen_people > 200, "{kind:?}: {seen_people} pixels show people");
    }
}

#[test]
fn a_round_ends_where_it_began_and_no_path_leaves_its_place() {
    let paths =
        [RoomPath::Handheld, RoomPath::Drone, RoomPath::Stand, RoomPath::Turn, RoomPath::Corridor];
    for path in paths {
        for seed in 0..6 {
            let config = RoomConfig { seed, path, turn_deg_s: 0.0, shake: 0.0, ..quiet() };
            let extent = Extent::new(RoomKind::Room, &config);
            let way = path::CameraPath::new(RoomKind::Room, &config, &extent);
            let round_s = 1.0 / way.round_hz();
            let back = way.t_room_camera(0.7).inverse() * way.t_room_camera(0.7 + round_s);
            assert!(back.distance_m() < 1e-6 && back.angle_rad() < 1e-3, "{path:?}: {back:?}");
            for step in 0..100 {
                let at = way.t_room_camera(round_s * f64::from(step) / 100.0).translation_m;
                assert!(at[0].abs() < extent.half_m[0] - 0.5, "{path:?} {seed}: {at:?}");
                assert!(at[2].abs() < extent.half_m[1] - 0.5, "{path:?} {seed}: {at:?}");
            }
        }
    }
}

#[test]
fn a_turn_is_as_fast_as_it_says_and_a_drone_leans_into_its_way() {
    let pose = |path, turn_deg_s| {
        let config = RoomConfig { path, turn_deg_s, shake: 0.0, ..quiet() };
        let extent = Extent::new(RoomKind::Room, &config);
        path::CameraPath::new(RoomKind::Room, &config, &extent)
    };
    let turning = pose(RoomPath::Turn, 150.0);
    let rates = (0..400).map(|step| {
        let [a, b] = [0, 1].map(|next| turning.t_room_camera(0.01 * f64::from(step + next)));
        (a.inverse() * b).angle_rad() / 0.01
    });
    assert!((rates.fold(0.0, f64::max).to_degrees() - 150.0).abs() < 2.0);
    // In a curve a drone's own vertical leans inwards: what it feels is straight down for it.
    let flying = pose(RoomPath::Drone, 0.0);
    for step in 0..50 {
        let time_s = 0.2 * f64::from(step);
        let at = |by: f64| Vector3::from(flying.t_room_camera(time_s + by).translation_m);
        let acceleration = (at(0.01) - at(0.0) * 2.0 + at(-0.01)) / 1e-4;
        let felt = acceleration - Vector3::new(0.0, GRAVITY_M_S2, 0.0);
        let own: [f64; 3] = flying.t_room_camera(time_s).inverse().rotate(felt.into());
        assert!(own[0].abs() < 0.05 && own[2].abs() < 0.05, "{own:?}");
    }
}

#[test]
fn an_open_shutter_blurs_what_moves_and_nothing_that_stands() {
    let contrast = |path, shutter_s| {
        let config = RoomConfig { path, shutter_s, shake: 0.0, people: 0, ..quiet() };
        let room = Room::new(RoomKind::Room, RoomConfig { turn_deg_s: 150.0, ..config }).unwrap();
        // At frame 0 the turn is fastest.
        let frame = room.frame(0);
        let pairs = frame.left_grey.windows(2);
        pairs.map(|pair| f64::from(pair[0].abs_diff(pair[1])).powi(2)).sum::<f64>()
    };
    let [sharp, blurred] = [0.0, 0.02].map(|open| contrast(RoomPath::Turn, open));
    assert!(blurred < 0.7 * sharp, "{blurred} {sharp}");
    let [sharp, still] = [0.0, 0.02].map(|open| contrast(RoomPath::Stand, open));
    assert!((still - sharp).abs() < 0.01 * sharp, "{still} {sharp}");
}

#[test]
fn a_unit_feels_the_turns_of_the_hand_it_is_in() {
    let unit = StreetUnit { rate_hz: 400.0, ..StreetUnit::default() };
    let path = RoomPath::Turn;
    let config = RoomConfig { inertial: Some(unit), frames: 21, path, turn_deg_s: 60.0, ..quiet() };
    let room = Room::new(RoomKind::Room, config).unwrap();
    let mut turned = Transform::IDENTITY;
    let readings = room.inertial();
    let within = readings.iter().filter(|reading| (0..500_000_000).contains(&reading.time_ns));
    let mut count = 0;
    for reading in within {
        // A reading is that of its time: the next one is half a step on.
        let step = Transform::new(reading.turn_rate.map(|rate| rate / 400.0), [0.0; 3]);
        turned = (turned * step).normalized();
        count += 1;
    }
    assert_eq!(count, 200);
    let pose = |index| room.t_world_camera(index) * t_camera_unit();
    let expected = pose(0).inverse() * pose(10);
    let error = turned.inverse() * Transform { translation_m: [0.0; 3], ..expected };
    assert!(expected.angle_rad() > 0.1 && error.angle_rad() < 0.01, "{}", error.angle_rad());
}

#[test]
fn what_cannot_be_built_is_named() {
    let refusal = |kind, config| {
        Room::new(kind, config).err().map(|error| error.to_string()).unwrap_or_default()
    };
    let corridor = RoomConfig { path: RoomPath::Corridor, ..quiet() };
    assert!(refusal(RoomKind::Yard, corridor).contains("a yard has no corridor"));
    let crowd = RoomConfig { people: 9, ..quiet() };
    assert!(refusal(RoomKind::Room, crowd).contains("room.people"));
    let unit = StreetUnit { rate_hz: -1.0, ..StreetUnit::default() };
    let config = RoomConfig { inertial: Some(unit), ..quiet() };
    assert!(refusal(RoomKind::Room, config).contains("room.inertial.rate_hz"));
}
