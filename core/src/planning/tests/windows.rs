//! The window: what is free, occupied and unknown, and what moving does to it.

use super::*;
use crate::planning::cells::{Cells, FREE, is_lost};

/// Ground 1.5 m below the camera, a wall 8 m ahead, a pole as thin as a few centimetres.
fn wall_and_pole(camera: [f64; 3], ray: [f64; 3]) -> Option<f64> {
    nearest([
        ground(1.5, 0.0)(camera, ray),
        solid([-20.0, -3.0, 8.0], [20.0, 1.5, 9.0])(camera, ray),
        solid([1.0, -2.0, 4.0], [1.12, 1.5, 4.12])(camera, ray),
    ])
}

#[test]
fn no_side_costs_no_byte_and_a_window_what_its_formula_says() {
    for profile in Capacity::PROFILES.map(|(_, profile)| profile) {
        assert_eq!(Planning::bytes(&profile), 0);
        assert!(profile.footprint().region("planning").is_none());
    }
    for distance_3d in [false, true] {
        let capacity = Capacity { planning_distance_3d: distance_3d, ..CAPACITY };
        let bytes = Planning::bytes(&capacity);
        let mut carver = carver(bytes);
        Planning::new_in(&capacity, &CONFIG(), 0.1, &mut carver);
        assert_eq!(carver.footprint().bytes(), bytes);
        assert_eq!(capacity.footprint().region("planning").unwrap().bytes, bytes);
        // The capacity's window: 20 x 18 x 4 m in cells of 0.2 m.
        let (cells, columns, longest) = (100 * 90 * 20, 100 * 90, 100);
        let boxes = capacity.tracks * size_of::<MovingBox>() + 2 * capacity.pixels() / 3;
        let formula = 6 * cells
            + (32 + 2 + 8) * columns
            + 16 * longest
            + boxes
            + if distance_3d { 9 * cells + 16 * longest } else { 0 };
        // Regions are rounded up to a cache line.
        assert!(
            bytes >= formula && bytes < formula + 40 * SLAB_ALIGN,
            "{bytes} for a formula of {formula}"
        );
    }
}

#[test]
fn nothing_is_free_beyond_the_depth_that_was_fused() {
    let mut scene = Scene { within_m: 5.0, ..Scene::new(&CONFIG()) };
    for n in 0..4 {
        scene.observe(at(0.05 * f64::from(n), 0.0), wall_and_pole);
    }
    scene.planning.update(&scene.volume);
    let state = |z: f64| scene.planning.cell(scene.cell_of([-1.0, 0.0, z])).0;
    assert_eq!([state(2.0), state(4.0)], [CellState::Free; 2], "before it");
    assert_eq!([state(5.5), state(7.0)], [CellState::Unknown; 2], "beyond it, before the wall");
}

#[test]
fn sees_a_wall_a_thin_pole_free_space_before_them_and_nothing_behind() {
    let mut scene = Scene::new(&CONFIG());
    for n in 0..4 {
        scene.observe(at(0.05 * f64::from(n), 0.0), wall_and_pole);
    }
    scene.planning.update(&scene.volume);
    let state = |point: [f64; 3]| scene.planning.cell(scene.cell_of(point)).0;
    // Its column is occupied although most rays pass the pole.
    assert_eq!(state([1.05, 0.0, 4.01]), CellState::Occupied, "a pole thinner than a cell");
    let along = |z: f64| state([-1.0, -0.3, z]);
    assert!([2.0, 4.0, 6.0, 7.0].into_iter().all(|z| along(z) == CellState::Free));
    // The wall's surface lies within one of these cells.
    assert!((75..85).map(|z| along(f64::from(z) / 10.0)).any(|state| state == CellState::Occupied));
    assert_eq!([along(9.5), along(11.0)], [CellState::Unknown; 2], "behind the wall");
    assert_eq!(state([1.0, 0.0, -2.0]), CellState::Unknown, "behind the camera");
    assert_eq!(scene.planning.slice_state(scene.cell_of([-1.0, 0.0, 6.0])), CellState::Free);
    assert_eq!(scene.planning.slice_state(scene.cell_of([1.05, 0.0, 4.01])), CellState::Occupied);
    // A metre, give or take the size of cells.
    let near = scene.planning.slice_distance(scene.cell_of([1.05, 0.0, 3.01])).unwrap();
    assert!((0.79..1.01).contains(&near.distance_m), "a metre before the pole: {near:?}");
}

#[test]
fn ages_count_frames_since_the_last_look() {
    let mut scene = Scene::new(&CONFIG());
    let ahead = [0.0, 0.0, 4.0];
    scene.observe(at(0.0, 0.0), wall_and_pole);
    assert_eq!(scene.planning.cell(scene.cell_of(ahead)), (CellState::Free, Some(0)));
    // Frames without depth only let time pass.
    for _ in 0..3 {
        scene.observe(at(0.0, 0.0), |_, _| None);
    }
    assert_eq!(
        scene.planning.cell(scene.cell_of(ahead)),
        (CellState::Free, Some(3)),
        "a picture of nothing tells nothing"
    );
    scene.observe(at(0.0, 0.0), wall_and_pole);
    assert_eq!(scene.planning.cell(scene.cell_of(ahead)).1, Some(0));
}

#[test]
fn ages_stay_exact_when_stamps_are_lowered() {
    let mut carver = carver(Cells::bytes(&CAPACITY));
    let mut cells = Cells::new_in(&CAPACITY, &mut carver);
    cells.advance();
    cells.observed_at[7] = cells.now();
    // More frames than lead to lowered stamps.
    for _ in 0..30_000 {
        cells.advance();
    }
    cells.observed_at[8] = cells.now();
    for _ in 0..40_000 {
        cells.advance();
    }
    assert_eq!(
        // The older of the two has lost its exact age.
        cells.age(cells.observed_at[8]),
        40_000.min(cells.age(1)),
        "an age too large for its stamp is the largest there is"
    );
    assert!(cells.age(cells.observed_at[7]) >= 32_500 && cells.observed_at[9] == 0);
}

#[test]
fn moving_keeps_what_stays_and_forgets_what_leaves() {
    let mut carver = carver(Cells::bytes(&CAPACITY));
    let mut cells = Cells::new_in(&CAPACITY, &mut carver);
    let mut model = std::collections::BTreeMap::new();
    let mut random = crate::random::Random::new(5);
    for step in 0..200 {
        let mut shift = |most: u32| random.below(2 * most + 1) as i32 - most as i32;
        // Every fiftieth shift may leave little or nothing of the window.
        let far = if step % 50 == 49 { 100 } else { 4 };
        let by = [shift(far), shift(3), shift(2)];
        let origin = [cells.origin[0] + by[0], cells.origin[1] + by[1], cells.origin[2] + by[2]];
        cells.move_to(origin);
        // The model is a map from cells of the world, without a ring buffer: what lies outside
        // goes.
        model.retain(|cell: &Cell, _| cells.local(*cell).is_some());
        for _ in 0..40 {
            let local = cells.size.map(|size| random.below(size as u32) as usize);
            let position = cells.position(local).unwrap();
            cells.bits[position] = FREE;
            model.insert([0, 1, 2].map(|axis| cells.origin[axis] + local[axis] as i32), FREE);
        }
        assert_eq!(
            cells.bits.iter().filter(|bits| **bits == FREE).count(),
            model.len(),
            "step {step}"
        );
        // As many cells are free, and each of the model's is: none is left over or moved.
        assert!(
            model.keys().all(|cell| cells.bits
                [cells.position(cells.local(*cell).unwrap()).unwrap()]
                == FREE)
        );
    }
}

#[test]
fn an_object_that_left_is_no_obstacle_and_a_thin_pole_stays_one() {
    let mut scene = Scene::new(&CONFIG());
    let street = |with_car: bool| {
        move |camera: [f64; 3], ray: [f64; 3]| {
            let car = solid([-1.9, 0.0, 5.0], [-0.4, 1.4, 7.0])(camera, ray).filter(|_| with_car);
            nearest([wall_and_pole(camera, ray), car])
        }
    };
    // So often that averages would take long to forget it.
    for _ in 0..20 {
        scene.observe(at(0.0, 0.0), street(true));
    }
    scene.planning.update(&scene.volume);
    let state = |scene: &Scene, point: [f64; 3]| scene.planning.slice_state(scene.cell_of(point));
    let (car, pole) = ([-1.1, 0.0, 5.05], [1.05, 0.0, 4.01]);
    assert_eq!([state(&scene, car), state(&scene, pole)], [CellState::Occupied; 2]);
    for n in 0..8 {
        scene.observe(at(0.02 * f64::from(n), 0.0), street(false));
    }
    scene.planning.update(&scene.volume);
    assert_eq!([state(&scene, car), state(&scene, pole)], [CellState::Free, CellState::Occupied]);
    // A ray through where the car stood.
    let through = scene.planning.ray(&scene.volume, [-1.1, 0.6, 2.0], [0.0, 0.0, 1.0], 5.0);
    assert_eq!(through.end, PathEnd::Free, "{through:?}");
}

#[test]
fn what_left_the_map_is_unknown_until_it_is_seen_through() {
    let mut scene = Scene::new(&CONFIG());
    let street = |with_car: bool| {
        move |camera: [f64; 3], ray: [f64; 3]| {
            let car = solid([-1.9, 0.0, 5.0], [-0.4, 1.4, 7.0])(camera, ray).filter(|_| with_car);
            nearest([wall_and_pole(camera, ray), car])
        }
    };
    let state = |scene: &Scene, at: [f64; 3]| scene.planning.slice_state(scene.cell_of(at));
    let (car, far_from_it) = ([-1.1, 0.0, 5.05], [0.3, 0.0, 3.0]);
    // The way is free, then a car stands in it, then its blocks leave the map.
    scene.observe(at(0.0, 0.0), street(false));
    scene.planning.update(&scene.volume);
    assert_eq!(state(&scene, car), CellState::Free);
    (0..3).for_each(|_| scene.observe(at(0.0, 0.0), street(true)));
    scene.planning.update(&scene.volume);
    assert_eq!(state(&scene, car), CellState::Occupied);
    scene.volume.stream_out(&mut Watched { planning: &mut scene.planning, store: &mut NoStore });
    scene.planning.update(&scene.volume);
    assert_eq!(state(&scene, car), CellState::Unknown);
    // Where no block was, nothing stood: what was seen free there stays so.
    assert_eq!(state(&scene, far_from_it), CellState::Free);
    scene.observe(at(0.0, 0.0), street(false));
    scene.planning.update(&scene.volume);
    assert_eq!(state(&scene, car), CellState::Free);
}

/// Every cell that the surface of a block marks is among those that its leaving clears.
#[test]
fn no_cell_that_a_block_marks_is_left_out_when_it_leaves() {
    for up in [[0.0, -1.0, 0.0], [0.3, -0.9, 0.2], [0.6, 0.1, -0.8]] {
        let [up_x, up_y, up_z] = up;
        let mut scene = Scene::new(&PlanningConfig { up_x, up_y, up_z, ..CONFIG() });
        (0..3).for_each(|_| scene.observe(at(0.0, 0.0), wall_and_pole));
        let marked = scene.planning.update(&scene.volume).occupied;
        assert!(marked > 100, "{marked} cells occupied with up {up:?}");
        let before = scene.planning.cells.bits.to_vec();
        scene
            .volume
            .stream_out(&mut Watched { planning: &mut scene.planning, store: &mut NoStore });
        let after = scene.planning.cells.bits.iter();
        let kept = before.iter().zip(after).filter(|(b, a)| **b & OCCUPIED != 0 && !is_lost(**a));
        assert_eq!(kept.count(), 0, "with up {up:?}");
    }
}

#[test]
fn unknown_is_an_obstacle_only_if_asked() {
    for unknown_is_obstacle in [false, true] {
        let mut scene = Scene::new(&PlanningConfig { unknown_is_obstacle, ..CONFIG() });
        scene.observe(at(0.0, 0.0), wall_and_pole);
        scene.planning.update(&scene.volume);
        let behind = scene.planning.slice_distance(scene.cell_of([0.0, 0.0, -3.0])).unwrap();
        assert_eq!(behind.distance_m < 0.0, unknown_is_obstacle);
    }
}

#[test]
fn a_tilted_window_lies_upright() {
    // Up leans by 0.1 rad: the camera looks down.
    let tilt = 0.1f64;
    let config =
        PlanningConfig { up_y: -libm::cos(tilt) as f32, up_z: libm::sin(tilt) as f32, ..CONFIG() };
    let grid = Grid::new(&config, 0.1);
    let up = grid.of_world([0.0, -libm::cos(tilt), libm::sin(tilt)]);
    assert!(
        libm::fabs(up[2] * grid.cell_m() - 1.0) < 1e-4
            && libm::fabs(up[0]) + libm::fabs(up[1]) < 1e-3,
        "{up:?}"
    );
    let back = grid.to_world(grid.of_world([3.0, -2.0, 7.0]));
    assert!(back.iter().zip([3.0, -2.0, 7.0]).all(|(a, b)| libm::fabs(a - b) < 1e-3), "{back:?}");
}
