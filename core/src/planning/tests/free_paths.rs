//! Rays and paths through a map.

use super::*;

/// Ground 1.5 m below the camera, a wall 8 m ahead, a low bar across the way at 5 m.
fn wall_and_bar(camera: [f64; 3], ray: [f64; 3]) -> Option<f64> {
    nearest([
        ground(1.5, 0.0)(camera, ray),
        solid([-20.0, -3.0, 8.0], [20.0, 1.5, 9.0])(camera, ray),
        solid([0.5, 0.9, 5.0], [1.5, 1.5, 5.4])(camera, ray),
    ])
}

fn scene() -> Scene {
    let mut scene = Scene::new(&CONFIG());
    for n in 0..4 {
        scene.observe(at(0.05 * f64::from(n), 0.0), wall_and_bar);
    }
    scene.planning.update(&scene.volume);
    scene
}

#[test]
fn a_ray_ends_at_the_first_surface_or_where_nothing_was_seen() {
    let scene = scene();
    let ray = |from: [f64; 3], direction: [f64; 3], far_m: f64| {
        scene.planning.ray(&scene.volume, from, direction, far_m)
    };
    // A direction of any length; distances are in metres.
    let wall = ray([-1.0, 0.0, 2.0], [0.0, 0.0, 3.0], 20.0);
    assert_eq!(wall.end, PathEnd::Surface);
    assert!((wall.free_m - 6.0).abs() < 0.05, "{wall:?}");
    assert_eq!(
        // The wall is farther than what is asked for.
        ray([-1.0, 0.0, 2.0], [0.0, 0.0, 1.0], 3.0),
        FreePath { end: PathEnd::Free, free_m: 3.0 }
    );
    let down = ray([0.0, 0.0, 4.0], [0.0, 1.0, 0.0], 20.0);
    assert!(down.end == PathEnd::Surface && (down.free_m - 1.5).abs() < 0.05, "{down:?}");
    assert_eq!(
        ray([0.0, 0.0, 12.0], [0.0, 0.0, 1.0], 5.0),
        FreePath { end: PathEnd::Unknown, free_m: 0.0 },
        "behind the wall"
    );
    assert_eq!(ray([0.0, 0.0, 3.0], [0.0; 3], 5.0).end, PathEnd::Unknown, "no direction");
    assert_eq!(ray([f64::NAN; 3], [0.0, 0.0, 1.0], 5.0).end, PathEnd::Unknown);
}

#[test]
fn a_path_is_free_until_the_robots_rim_touches() {
    let scene = scene();
    let robot = RobotCylinder { radius_m: 0.4, low_m: 0.2, high_m: 1.0, unknown_ends: false };
    let sweep =
        |path: &[[f64; 3]], robot: &RobotCylinder| scene.planning.sweep(&scene.volume, path, robot);
    // The path lies on the ground, which is 1.5 m below the camera.
    let ground = |x: f64, z: f64| [x, 1.5, z];
    let straight = sweep(&[ground(-1.0, 3.0), ground(-1.0, 12.0)], &robot);
    assert!(
        straight.end == PathEnd::Surface && (straight.free_m - 4.6).abs() < 0.06,
        "a wall at 8, less the radius: {straight:?}"
    );
    let bar = sweep(&[ground(1.0, 2.0), ground(1.0, 3.0), ground(1.0, 7.0)], &robot);
    assert!(
        bar.end == PathEnd::Surface && (bar.free_m - 2.6).abs() < 0.06,
        "a bar at 5, less the radius: {bar:?}"
    );
    assert_eq!(
        // A detour of 1.6 m to the left passes the bar with the radius to spare.
        sweep(&[ground(1.0, 2.0), ground(1.0, 4.5), ground(-0.6, 4.5), ground(-0.6, 7.0)], &robot)
            .end,
        PathEnd::Free,
        "around it"
    );
    let over = RobotCylinder { low_m: 0.8, ..robot };
    // The bar is 0.6 m high, and this cylinder begins above it.
    assert_eq!(sweep(&[ground(1.0, 2.0), ground(1.0, 7.0)], &over).end, PathEnd::Free, "over it");
    let unknown = RobotCylinder { unknown_ends: true, ..robot };
    // Where all was seen, unknown_ends changes nothing.
    assert_eq!(sweep(&[ground(-1.0, 4.0), ground(-1.0, 7.0)], &unknown).end, PathEnd::Free);
    let back = sweep(&[ground(0.0, 4.0), ground(0.0, -4.0)], &unknown);
    assert!(
        back.end == PathEnd::Unknown && back.free_m > 1.0 && back.free_m < 4.5,
        "behind the camera nothing is known: {back:?}"
    );
    // No way, no obstacle.
    assert_eq!(sweep(&[], &robot), FreePath { end: PathEnd::Free, free_m: 0.0 });
}

#[test]
fn a_path_touches_where_a_search_over_fine_steps_does() {
    let scene = scene();
    let robot = RobotCylinder { radius_m: 0.5, low_m: 0.2, high_m: 1.2, unknown_ends: false };
    let mut points = Vec::new();
    // The twin tries a thousand positions of the robot against every point of the surface.
    for slot in scene.volume.pool().live() {
        let coord = scene.volume.blocks().coord(slot).unwrap();
        crossings(&scene.volume, slot, coord, 1, |crossing| points.push(crossing.point_m(0.1)));
    }
    assert!(points.len() > 1_000);
    let mut random = crate::random::Random::new(8);
    let mut touched = 0;
    for _ in 0..50 {
        // The paths begin and end anywhere on the ground, also within the obstacles.
        let mut random_point = || {
            [0.1 * f64::from(random.below(60)) - 3.0, 1.5, 2.0 + 0.1 * f64::from(random.below(70))]
        };
        let (from, to) = (random_point(), random_point());
        let way = scene.planning.sweep(&scene.volume, &[from, to], &robot);
        let (dx, dz) = (to[0] - from[0], to[2] - from[2]);
        let length = libm::hypot(dx, dz);
        let touches = |s: f64| {
            let (x, z) = (from[0] + dx * s, from[2] + dz * s);
            points.iter().any(|[px, py, pz]| {
                libm::hypot(px - x, pz - z) < robot.radius_m && (0.2..1.2).contains(&(1.5 - py))
            })
        };
        // Paths are at most 9 m long, and a step 9 mm: the bound below is 2 cm.
        let first = (0..=1_000).map(|n| f64::from(n) / 1_000.0).find(|s| touches(*s));
        assert_eq!(way.end == PathEnd::Surface, first.is_some(), "{from:?} to {to:?}");
        if let Some(first) = first {
            touched += 1;
            assert!(
                libm::fabs(way.free_m - first * length) < 0.02,
                "{way:?}, {} m by steps",
                first * length
            );
        }
    }
    // Without paths that touch, the comparison would be empty.
    assert!(touched > 10);
}
