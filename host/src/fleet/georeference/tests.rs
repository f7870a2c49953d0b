use super::*;

/// Numbers between -1 and 1.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1u32 << 30) - 1.0
    }

    /// About normally distributed, with a standard deviation.
    fn vector(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| (0..12).map(|_| self.next()).sum::<f64>() * 0.5 * sigma)
    }
}

const ANTENNA_M: [f64; 3] = [0.3, -0.9, -1.1];

fn world() -> Transform {
    Transform::new([0.02, 2.1, -0.03], [310.0, -4.0, -95.0])
}

/// 300 frames along a path of 240 m whose direction swings by some degrees; every eighth fix is
/// reflected by a house.
fn observed(
    bend_rad: f64,
    step_m: f64,
    sigma_m: f64,
    angles_off_rad: Option<f64>,
) -> Vec<Observation> {
    let (mut noise, mut at_m) = (Noise(7), [0.0; 3]);
    let frame = |nth: usize| {
        let (sine, cosine) = (f64::from(nth as u32) * 0.03).sin_cos();
        let t_map_camera = Transform::new([0.3 * bend_rad * cosine, bend_rad * sine, 0.0], at_m);
        // The position grows by a step along the direction.
        let ahead = t_map_camera.rotate([0.0, 0.0, step_m]);
        (0..3).for_each(|axis| at_m[axis] += ahead[axis]);
        let t_world_camera = world() * t_map_camera;
        // A reflection puts a fix up to 25 m off.
        let reflected = if nth % 8 == 3 { noise.vector(25.0) } else { Vector3::zeros() };
        let at_m = Vector3::from(t_world_camera.transform_point(ANTENNA_M))
            + noise.vector(sigma_m)
            + reflected;
        // Given angles, off by a constant turn.
        let off = |by: f64| Transform::new([0.0, by, 0.0], [0.0; 3]) * t_world_camera;
        Observation {
            t_map_camera,
            at_m,
            axes: angles_off_rad.map(|by| Matrix3::from(off(by).rotation_matrix()).transpose()),
            sigma_m: None,
        }
    };
    (0..300).map(frame).collect()
}

fn error(found: &Prior, at_m: [f64; 3]) -> (f64, f64) {
    let apart = Vector3::from(found.t_world_map.transform_point(at_m))
        - Vector3::from(world().transform_point(at_m));
    (apart.norm(), (found.t_world_map.inverse() * world()).angle_rad())
}

#[test]
fn a_bent_path_lies_where_its_fixes_say_within_the_stated_error() {
    let frames = observed(0.6, 0.8, 0.4, None);
    let found = georeference(&frames, ANTENNA_M).unwrap();
    let stated = found.uncertainty.unwrap();
    let (off_m, turned_rad) = error(&found, frames[150].t_map_camera.translation_m);
    assert!((0.3..0.5).contains(&stated.position_m), "{stated:?}");
    assert!(
        off_m < stated.position_m && turned_rad < 2.0 * stated.rotation_rad,
        "{off_m} m, {turned_rad} rad, {stated:?}"
    );
    let exact = georeference(&observed(0.6, 0.8, 0.0, None), ANTENNA_M).unwrap();
    let (off_m, turned_rad) = error(&exact, [0.0; 3]);
    assert!(
        off_m < 0.01 && turned_rad < 1e-4,
        "reflected fixes alone: {off_m} m, {turned_rad} rad"
    );
    // Taken for the camera's, positions of the antenna mislead.
    assert!(
        error(&georeference(&frames, [0.0; 3]).unwrap(), [0.0; 3]).0 > 0.5,
        "the antenna counts"
    );
}

#[test]
fn a_straight_or_short_path_is_refused_unless_angles_are_given() {
    for (bend_rad, step_m) in [(0.0, 0.8), (0.6, 0.002)] {
        let refused = georeference(&observed(bend_rad, step_m, 0.4, None), ANTENNA_M).unwrap_err();
        assert!(
            refused.contains("degrees only") && refused.contains("Give roll, pitch and yaw"),
            "{refused}"
        );
        let found = georeference(&observed(bend_rad, step_m, 0.4, Some(0.01)), ANTENNA_M).unwrap();
        let (off_m, turned_rad) = error(&found, [0.0; 3]);
        assert!(off_m < 0.5 && turned_rad < 0.02, "{off_m} m, {turned_rad} rad");
    }
    // Nine frames, where ten are needed.
    let few = georeference(&observed(0.6, 0.8, 0.4, None)[..9], ANTENNA_M).unwrap_err();
    assert!(few.contains("9 frames with a fix are less than 10"), "{few}");
    let turned = |bend_rad: f64| {
        georeference(&observed(bend_rad, 0.8, 0.4, Some(1.5)), ANTENNA_M).unwrap_err()
    };
    assert!(turned(0.6).contains("contradict its positions by 8"), "{}", turned(0.6));
    assert!(turned(0.0).contains("the heading of its path by 8"), "{}", turned(0.0));
}

#[test]
fn a_vehicle_that_heads_north_has_the_axes_of_the_world() {
    let north = camera_axes([0.0, 0.0, std::f64::consts::FRAC_PI_2]);
    assert!((north - Matrix3::identity()).norm() < 1e-12, "{north}");
    let nose_down = camera_axes([0.0, 0.1, std::f64::consts::FRAC_PI_2]) * Vector3::z();
    assert!(
        (nose_down - Vector3::new(0.0, 0.1f64.sin(), 0.1f64.cos())).norm() < 1e-12,
        "positive with the nose down: {nose_down}"
    );
    let left_up = camera_axes([0.1, 0.0, std::f64::consts::FRAC_PI_2]) * Vector3::x();
    assert!(
        (left_up - Vector3::new(0.1f64.cos(), 0.1f64.sin(), 0.0)).norm() < 1e-12,
        "positive with the left side up: {left_up}"
    );
}

/// A path of 150 m by a seed: its heading, bends and noise.
struct Drive {
    noise: Noise,
    heading_rad: f64,
    bend_rad: f64,
}

/// Mistake in the table of fixes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mistake {
    None,
    Compass,
    Degrees,
    Exchanged,
    OtherDrive,
}

impl Drive {
    fn new(seed: u64) -> Self {
        let mut noise = Noise(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        (0..20).for_each(|_| {
            noise.next();
        });
        let heading_rad = std::f64::consts::PI * noise.next();
        let bend_rad = 0.3 * noise.next().abs();
        Self { noise, heading_rad, bend_rad }
    }

    /// The frames of the path as its table of fixes gives them, with gaps, and the map's pose.
    fn observed(&mut self, mistake: Mistake) -> (Vec<Observation>, Transform) {
        let plane = LocalPlane::at([49.0, 8.4, 110.0]);
        let (mut map_m, mut east_north_m, mut yaw) = ([0.0; 3], [0.0; 2], self.heading_rad);
        let t_world_map = Transform::from_rotation_matrix(
            &camera_axes([0.0, 0.0, yaw]).transpose().into(),
            [0.0; 3],
        );
        let mut frames = Vec::new();
        for nth in 0..150u32 {
            let turned = yaw - self.heading_rad;
            // The camera's y points down: a turn to the left is negative about it.
            let t_map_camera = Transform::new([0.0, -turned, 0.0], map_m);
            let [east, north] = east_north_m;
            let noise = self.noise.vector(0.3);
            let mut geodetic = [
                49.0 + (north + noise.x) / 111_212.0,
                8.4 + (east + noise.y) / 73_173.0,
                110.0 + noise.z,
            ];
            let mut angles = [0.0, 0.0, yaw + 0.005 * self.noise.next()];
            match mistake {
                Mistake::None => {}
                Mistake::Compass => angles[2] = std::f64::consts::FRAC_PI_2 - angles[2],
                Mistake::Degrees => angles[2] = angles[2].to_degrees(),
                Mistake::Exchanged => geodetic.swap(0, 1),
                Mistake::OtherDrive => {
                    geodetic[0] = 49.0 + 2.5 * (geodetic[0] - 49.0);
                    geodetic[1] = 8.4 + 2.5 * (geodetic[1] - 8.4);
                }
            }
            let fix = Fix { geodetic, angles_rad: Some(angles), sigma_m: None };
            let origin = if mistake == Mistake::Exchanged {
                LocalPlane::at([8.4, 49.0, 110.0])
            } else {
                plane
            };
            if nth % 7 != 3 {
                frames.push(Observation::of(&t_map_camera, &fix, &origin));
            }
            let step = t_map_camera.rotate([0.0, 0.0, 1.0]);
            (0..3).for_each(|axis| map_m[axis] += step[axis]);
            east_north_m = [east + yaw.cos(), north + yaw.sin()];
            yaw += self.bend_rad / 150.0;
        }
        (frames, t_world_map)
    }
}

#[test]
fn tables_with_a_mistake_are_refused_and_others_lie_within_their_sigma() {
    check_seeds(0..6);
}

#[dynvox_needs::long]
#[test]
fn a_hundred_tables_with_a_mistake_are_refused() {
    check_seeds(0..100);
}

/// Nothing is accepted with an error above three standard deviations.
fn check_seeds(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let mistakes = [
            Mistake::None,
            Mistake::Compass,
            Mistake::Degrees,
            Mistake::Exchanged,
            Mistake::OtherDrive,
        ];
        for mistake in mistakes {
            let (frames, t_world_map) = Drive::new(seed).observed(mistake);
            let found = match georeference(&frames, [0.0; 3]) {
                Ok(found) => found,
                Err(error) => {
                    assert!(mistake != Mistake::None, "{seed}: {error}");
                    continue;
                }
            };
            // Towards the north-east a compass agrees with yaw; degrees may be a whole turn off.
            assert!(
                [Mistake::None, Mistake::Compass, Mistake::Degrees].contains(&mistake),
                "{mistake:?} of seed {seed}: {found:?}"
            );
            let stated = found.uncertainty.unwrap();
            let apart = t_world_map.inverse() * found.t_world_map;
            assert!(apart.distance_m() < 3.0 * stated.position_m, "{seed}: {apart:?}, {stated:?}");
            assert!(apart.angle_rad() < 3.0 * stated.rotation_rad, "{seed}: {apart:?}, {stated:?}");
        }
    }
}

/// A receiver that is sure of one half of its fixes, and off by metres in the other, which it says.
#[test]
fn what_a_receiver_says_of_its_fixes_weighs_them() {
    let mut noise = Noise(11);
    let mut frames = observed(0.6, 0.8, 0.0, None);
    for (nth, frame) in frames.iter_mut().enumerate() {
        let sigma_m = if nth % 2 == 0 { 0.1 } else { 3.0 };
        let exact = Vector3::from((world() * frame.t_map_camera).transform_point(ANTENNA_M));
        frame.at_m = exact + noise.vector(sigma_m);
        frame.sigma_m = Some(sigma_m);
    }
    let middle = frames[150].t_map_camera.translation_m;
    let weighted = error(&georeference(&frames, ANTENNA_M).unwrap(), middle);
    frames.iter_mut().for_each(|frame| frame.sigma_m = None);
    let unweighted = error(&georeference(&frames, ANTENNA_M).unwrap(), middle);
    assert!(
        weighted.0 < 0.03 && weighted.0 < unweighted.0,
        "{weighted:?} m and rad, without {unweighted:?}"
    );
    // A receiver may know of an error that all fixes share.
    frames.iter_mut().for_each(|frame| frame.sigma_m = Some(4.0));
    let stated = georeference(&frames, ANTENNA_M).unwrap().uncertainty.unwrap();
    assert!(stated.position_m >= 4.0, "{stated:?}");
}

#[test]
fn fixes_of_a_receivers_own_times_are_joined_with_the_path() {
    use crate::fleet::free_space::CameraPose;
    use crate::formats::TimedFix;
    use dynvox_core::geometry::MapSegment;
    let plane = LocalPlane::at([49.0, 8.4, 110.0]);
    let poses: Vec<Transform> =
        observed(0.6, 0.8, 0.0, None).iter().map(|of| of.t_map_camera).collect();
    let began_s = 1_711_197_319.0;
    let camera = |(frame, t_map_camera): (usize, &Transform)| CameraPose {
        frame,
        time_s: Some(began_s + 0.1 * frame as f64),
        segment: MapSegment::FIRST,
        t_map_camera: *t_map_camera,
    };
    let mut cameras: Vec<CameraPose> = poses.iter().enumerate().map(camera).collect();
    // One fix a second, half-way between two frames.
    let fixes: Vec<TimedFix> = (0..29)
        .map(|second: usize| {
            let before = t_world(&poses[10 * second]);
            let after = t_world(&poses[10 * second + 1]);
            let [east, down, north] = [0, 1, 2].map(|axis| 0.5 * (before[axis] + after[axis]));
            let geodetic = [49.0 + north / 111_212.0, 8.4 + east / 73_173.0, 110.0 - down];
            let fix = Fix { geodetic, angles_rad: None, sigma_m: None };
            TimedFix { time_s: began_s + 0.05 + second as f64, fix }
        })
        .collect();
    let joined = timed::observations(&cameras, &fixes, &plane).unwrap();
    assert_eq!(joined.len(), 29);
    let (off_m, turned_rad) = error(&georeference(&joined, [0.0; 3]).unwrap(), [0.0; 3]);
    assert!(off_m < 0.5 && turned_rad < 0.01, "{off_m} m, {turned_rad} rad");
    // Frames that a clock of their own stamps have no fix; nor have those of a gap.
    cameras.retain(|camera| !(100..200).contains(&camera.frame));
    let with_gap = timed::observations(&cameras, &fixes, &plane).unwrap();
    assert_eq!(with_gap.len(), 19, "none is taken across the gap");
    cameras.iter_mut().for_each(|camera| camera.time_s = Some(0.1 * camera.frame as f64));
    let refused = timed::observations(&cameras, &fixes, &plane).unwrap_err();
    assert!(refused.contains("no fix lies between two frames"), "{refused}");
    cameras.iter_mut().for_each(|camera| camera.time_s = None);
    let refused = timed::observations(&cameras, &fixes, &plane).unwrap_err();
    assert!(refused.contains("by their times, which its frames lack"), "{refused}");
}

/// The camera in the world, m.
fn t_world(t_map_camera: &Transform) -> [f64; 3] {
    (world() * *t_map_camera).translation_m
}
