//! The height map on analytic ground.

use super::*;

/// Columns with ground between two depths, with their height errors.
fn heights(
    scene: &Scene,
    depths: std::ops::Range<i32>,
    truth: impl Fn(f64, f64) -> f64,
) -> Vec<f64> {
    let mut errors = Vec::new();
    for z in depths {
        for x in -10..10 {
            // The middle of a column.
            let (x, z) = (0.2 * f64::from(x) + 0.1, 0.2 * f64::from(z) + 0.1);
            let cell = scene.cell_of([x, 0.0, z]);
            if let Some(height_m) = scene.planning.column(cell).and_then(|column| column.ground_m())
            {
                errors.push(f64::from(height_m) - truth(x, z));
            }
        }
    }
    errors
}

fn median_size(mut errors: Vec<f64>) -> f64 {
    errors.iter_mut().for_each(|error| *error = error.abs());
    errors.sort_by(f64::total_cmp);
    errors[errors.len() / 2]
}

#[test]
fn flat_ground_and_slopes_up_and_down_are_found_with_their_rise() {
    // Up to a little less than 30 degrees.
    for rise in [0.0, -0.2, 0.15, -0.5] {
        let mut scene = Scene::new(&CONFIG());
        for n in 0..6 {
            let z = 0.2 * f64::from(n);
            scene.observe(
                Transform::new(Vector3::zeros(), Vector3::new(0.0, rise * z, z)),
                ground(1.5, rise),
            );
        }
        scene.planning.update(&scene.volume);
        let errors = heights(&scene, 20..40, |_, z| -(1.5 + rise * z));
        assert!(errors.len() > 200, "rise {rise}: {} columns of 400", errors.len());
        assert!(median_size(errors) < 0.03, "rise {rise}");
        let slope = scene.planning.column(scene.cell_of([0.1, 0.0, 6.1])).unwrap().slope;
        assert!(
            (f64::from(slope[1]) + rise).abs() < 0.035 && slope[0].abs() < 0.035,
            "rise {rise}: {slope:?}"
        );
    }
}

#[test]
fn a_kerb_is_a_step_a_slope_is_none_and_a_bridge_hangs_over() {
    let mut scene = Scene::new(&CONFIG());
    let street = |camera: [f64; 3], ray: [f64; 3]| {
        nearest([
            ground(1.5, 0.0)(camera, ray),
            // A pavement, 12 cm high; a slab 2.5 m above the road.
            solid([1.0, 1.38, -5.0], [6.0, 2.0, 30.0])(camera, ray),
            solid([-3.0, -1.3, 5.0], [0.5, -1.0, 6.0])(camera, ray),
        ])
    };
    // The camera moves on, so that each cell is seen from several distances.
    for n in 0..8 {
        scene.observe(at(0.0, 0.1 * f64::from(n)), street);
    }
    scene.planning.update(&scene.volume);
    let column = |x: f64, z: f64| scene.planning.column(scene.cell_of([x, 0.0, z])).unwrap();
    let kerbs = (20..30)
        .filter(|z| [0.9, 1.1].iter().any(|x| column(*x, 0.2 * f64::from(*z) + 0.1).step_m > 0.06))
        .count();
    assert!(kerbs >= 9, "{kerbs} of 10");
    // 6 cm are half the height of the kerb.
    let flat = (20..30).filter(|z| column(-0.5, 0.2 * f64::from(*z) + 0.1).step_m > 0.06).count();
    assert_eq!(flat, 0, "no kerb on the road");
    let under = column(-1.1, 5.3);
    // From the road to the slab are 2.5 m, and a cell has 0.2 m.
    assert!((2.2..2.6).contains(&under.clearance_m), "{under:?}");
    // Beside the slab nothing hangs over, which is a clearance of 0.
    assert_eq!(column(-1.1, 4.1).clearance_m, 0.0);
    assert_eq!(
        scene.planning.slice_state(scene.cell_of([-1.1, 0.0, 5.3])),
        CellState::Free,
        "a robot of 2 m passes below"
    );
}

#[test]
fn a_car_is_not_ground() {
    let mut scene = Scene::new(&CONFIG());
    let street = |camera: [f64; 3], ray: [f64; 3]| {
        nearest([
            ground(1.5, 0.0)(camera, ray),
            // A car, 0.9 m high.
            solid([-1.0, 0.6, 5.0], [0.8, 1.5, 8.0])(camera, ray),
        ])
    };
    for n in 0..4 {
        scene.observe(at(0.05 * f64::from(n), 0.0), street);
    }
    scene.planning.update(&scene.volume);
    let top = scene.planning.column(scene.cell_of([0.0, 0.0, 5.9])).unwrap();
    assert_eq!(top.ground_m(), None, "its top is 0.9 m above ground: {top:?}");
    assert_eq!(scene.planning.slice_state(scene.cell_of([0.0, 0.0, 5.05])), CellState::Occupied);
}

#[test]
fn without_a_height_the_disparity_image_tells_where_ground_is() {
    let mut scene = Scene::new(&PlanningConfig { camera_height_m: 0.0, ..CONFIG() });
    for n in 0..4 {
        scene.observe(at(0.05 * f64::from(n), 0.0), ground(1.2, -0.03));
    }
    scene.planning.update(&scene.volume);
    let errors = heights(&scene, 20..35, |_, z| -(1.2 - 0.03 * z));
    assert!(errors.len() > 200 && median_size(errors) < 0.03);
}
