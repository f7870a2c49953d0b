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
    assert!(turned(0.0).contains("m off its path"), "{}", turned(0.0));
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
