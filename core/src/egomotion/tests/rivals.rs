//! Groups of matches that move as rigidly as the world, and have more matches.

use super::*;

/// Points of a frame: where they lie in the previous camera, and how they move against it.
struct Scene<'r> {
    random: &'r mut Random,
    matches: Vec<Match>,
}

impl Scene<'_> {
    fn uniform(&mut self, [low, high]: [f64; 2]) -> f64 {
        low + (high - low) * self.random.fraction()
    }

    /// Adds points at depths of that range and in columns of that share of the image, seen with
    /// some noise.
    fn add(&mut self, count: usize, depths_m: [f64; 2], columns: [f64; 2], motion: &Transform) {
        for _ in 0..count {
            let z = self.uniform(depths_m);
            let x = (self.uniform(columns) - 0.5) * 2.0 * RIG.center_u_px / RIG.focal_px * z;
            let y = self.uniform([-0.3, 0.3]) * z;
            let mut noisy = |[u, v]: [f32; 2]| {
                [u, v].map(|at| at + self.random.below(200) as f32 / 1000.0 - 0.1)
            };
            let point = Point3::new(x, y, z);
            let [previous_left, previous_right] = project(&point).map(&mut noisy);
            let [current_left, current_right] =
                project(&motion.transform_point(point)).map(&mut noisy);
            self.matches.push(Match { previous_left, previous_right, current_left, current_right });
        }
    }
}

const WORLD_M: [f64; 2] = [3.0, 30.0];
const ALL: [f64; 2] = [0.0, 1.0];

fn ahead(way_m: f64) -> Transform {
    Transform::from_translation([0.0, 0.0, -way_m])
}

/// Steps a camera through frames that `see` makes; the pose and status after each.
fn travel(
    frames: usize,
    mut see: impl FnMut(usize, &mut Scene<'_>),
) -> Vec<(Transform, MotionEstimate)> {
    let mut slab = Box::new(Slab([0; BYTES]));
    let (mut estimator, mut camera) = (estimator(&mut slab), Egomotion::default());
    let mut random = Random::new(11);
    (0..frames)
        .map(|frame| {
            let mut scene = Scene { random: &mut random, matches: Vec::new() };
            see(frame, &mut scene);
            let timed = at_10_hz(&scene.matches);
            let estimate = camera.step(&EgomotionConfig::default(), &RIG, timed, &mut estimator);
            (*camera.t_world_camera(), estimate)
        })
        .collect()
}

#[test]
fn a_vehicle_ahead_at_our_speed_does_not_stop_the_world() {
    // It has most matches from the first frame on, at 8 m in the middle of the view.
    let poses = travel(10, |_, scene| {
        scene.add(220, [7.9, 8.1], [0.35, 0.65], &Transform::IDENTITY);
        scene.add(180, WORLD_M, ALL, &ahead(0.9));
    });
    let way_m = poses[9].0.translation_m[2];
    assert!((way_m - 9.0).abs() < 0.1, "{way_m} m of 9");
}

#[test]
fn the_own_bonnet_does_not_carry_the_camera() {
    let poses = travel(10, |_, scene| {
        scene.add(220, [3.0, 3.05], ALL, &Transform::IDENTITY);
        scene.add(180, WORLD_M, ALL, &ahead(0.9));
    });
    let way_m = poses[9].0.translation_m[2];
    assert!((way_m - 9.0).abs() < 0.1, "{way_m} m of 9");
}

#[test]
fn a_bus_across_the_view_does_not_carry_a_camera_that_stands() {
    let poses = travel(12, |frame, scene| {
        let bus = if frame < 4 { 0 } else { 240 };
        scene.add(bus, [5.0, 5.4], [0.0, 0.8], &Transform::from_translation([0.6, 0.0, 0.0]));
        scene.add(400 - bus, WORLD_M, ALL, &Transform::IDENTITY);
    });
    let away_m = poses[11].0.distance_m();
    assert!(away_m < 0.1, "{away_m} m");
}

#[test]
fn witnesses_that_disagree_leave_the_pose_a_guess() {
    // A wide world that suddenly stands, and a small group that moves on as the camera did.
    let poses = travel(6, |frame, scene| {
        let stops = frame >= 4;
        scene.add(if stops { 150 } else { 0 }, [7.9, 8.1], [0.4, 0.6], &ahead(1.5));
        scene.add(
            if stops { 250 } else { 400 },
            WORLD_M,
            ALL,
            &ahead(if stops { 0.0 } else { 1.5 }),
        );
    });
    assert_eq!(poses[3].1.status, MotionStatus::Estimated);
    assert_eq!(poses[4].1.status, MotionStatus::Contested);
    let way_m = poses[4].0.translation_m[2];
    assert!((way_m - 7.5).abs() < 0.1, "the motion goes on: {way_m} m");
}

#[test]
fn a_truck_that_cuts_in_before_a_slow_camera_does_not_carry_it() {
    // Most of the world flows by less than the distance within which a match counts as an inlier.
    let poses = travel(16, |frame, scene| {
        let truck = if frame < 6 { 0 } else { 260 };
        scene.add(truck, [5.9, 6.1], [0.2, 0.8], &Transform::IDENTITY);
        scene.add(400 - truck, WORLD_M, ALL, &ahead(0.2));
    });
    let way_m = poses[15].0.translation_m[2];
    assert!((way_m - 3.2).abs() < 0.1, "{way_m} m of 3.2");
}

#[test]
fn a_person_who_walks_as_the_camera_does_is_no_world() {
    // A hand turns the camera; the person ahead stays where they are in the view.
    let turning = Transform::new(Vector3::new(0.0, 0.02, 0.0), Vector3::new(0.0, 0.0, -0.03));
    let poses = travel(14, |frame, scene| {
        let person = if frame < 6 { 0 } else { 270 };
        scene.add(person, [1.45, 1.55], [0.3, 0.7], &Transform::IDENTITY);
        scene.add(400 - person, [2.0, 6.0], ALL, &turning);
    });
    for (frame, (_, estimate)) in poses.iter().enumerate() {
        let Some(motion) = estimate.t_current_previous else { continue };
        let (off_m, off_deg) = between(&motion, &turning);
        assert!(off_m < 0.01 && off_deg < 0.2, "frame {frame}: {off_m} m, {off_deg} degrees");
    }
    let held = poses.iter().filter(|(_, estimate)| estimate.t_current_previous.is_none()).count();
    assert!(held <= 2, "{held} frames of 14 were guessed");
}

#[test]
fn a_bonnet_at_one_distance_does_not_pull_the_motion_to_a_turn() {
    // A turn makes up for a way aside there, and moves the world much as it does move.
    let turning = Transform::new(Vector3::new(0.0, 0.005, 0.0), Vector3::new(0.08, 0.0, -0.02));
    let poses = travel(12, |frame, scene| {
        let bonnet = if frame < 4 { 0 } else { 131 };
        scene.add(bonnet, [4.0, 4.6], ALL, &Transform::IDENTITY);
        scene.add(128, [6.0, 40.0], ALL, &turning);
    });
    for (frame, (_, estimate)) in poses.iter().enumerate() {
        let motion = estimate.t_current_previous.expect("a motion is found");
        let (off_m, off_deg) = between(&motion, &turning);
        assert!(off_m < 0.06 && off_deg < 0.2, "frame {frame}: {off_m} m, {off_deg} degrees");
    }
}
