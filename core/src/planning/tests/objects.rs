//! Moving objects: boxes, where they will be, what they cover.

use super::*;
use crate::planning::cells::OBJECT;

fn car() -> MovingBox {
    MovingBox {
        id: 3,
        center_m: [2.0, 4.0, 0.0],
        half_m: [2.0, 0.9, 0.8],
        heading: [0.0, 1.0],
        velocity_m_s: [0.0, 5.0],
        sigma_m: 0.1,
        sigma_m_s: 0.2,
        ..MovingBox::default()
    }
}

#[test]
fn a_box_is_fitted_to_points_along_its_heading() {
    let (cos, sin) = (0.8, 0.6);
    let mut fit = BoxFit::new([cos * 7.0, sin * 7.0], [100.0, 50.0, 1.0]);
    for along in -20..=20 {
        for across in -9..=9 {
            let (a, b) = (0.1 * f64::from(along), 0.1 * f64::from(across));
            fit.add([
                100.0 + cos * a - sin * b,
                50.0 + sin * a + cos * b,
                1.0 + 0.2 * f64::from(across % 3),
            ]);
        }
    }
    let found = fit.solve().unwrap();
    assert!((found.heading[0] - 0.8).abs() < 1e-6 && (found.heading[1] - 0.6).abs() < 1e-6);
    assert!((found.center_m[0] - 100.0).abs() < 1e-4 && (found.center_m[1] - 50.0).abs() < 1e-4);
    // Twice the deviation of an even spread is its half and a seventh of that.
    assert!(
        (2.2..2.5).contains(&found.half_m[0]) && (1.0..1.2).contains(&found.half_m[1]),
        "{found:?}"
    );
    assert_eq!(BoxFit::new([0.0; 2], [0.0; 3]).solve(), None);
}

#[test]
fn a_moving_box_covers_where_it_will_be_and_leaves_the_window_beneath() {
    let mut planning = planning(
        &CAPACITY,
        &PlanningConfig { object_sigmas: 0.0, level: true, low_m: -1.0, ..CONFIG() },
    );
    let [width, length, _] = planning.size();
    // The window's middle is the world's origin, so that the car starts within it.
    cells_of(&mut planning).move_to([-(width as i32) / 2, -(length as i32) / 2, -10]);
    assert!(planning.add_moving(car()));
    let covers = |planning: &Planning<'_>, x: f64, y: f64| {
        // The grid's axes are the world's x, z and -y.
        let cell = planning.grid().cell_at(planning.grid().of_world([x, 0.0, y])).unwrap();
        planning.cell(cell).0 == CellState::Occupied
            && planning.slice_state(cell) == CellState::Occupied
    };
    let report = planning.predict(0.0);
    assert_eq!(report.boxes, 1);
    assert!(
        covers(&planning, 2.0, 4.0)
            && covers(&planning, 2.8, 5.8)
            && !covers(&planning, 2.0, 0.5)
            && !covers(&planning, 0.5, 4.0)
    );
    planning.predict(-1.0);
    assert!(
        covers(&planning, 2.0, -1.0) && !covers(&planning, 2.0, 4.0),
        "a second earlier, and nothing is left where it was"
    );
    // At its speed the box has left the window long before 100 s.
    planning.predict(100.0);
    assert!(planning.cells.bits.iter().all(|bits| bits & OBJECT == 0), "out of the window");
}

#[test]
fn a_box_grows_by_what_is_not_known_of_it() {
    let mut planning = planning(&CAPACITY, &PlanningConfig { object_sigmas: 2.0, ..CONFIG() });
    cells_of(&mut planning).move_to([-30, -30, -10]);
    planning.add_moving(MovingBox { velocity_m_s: [0.0; 2], ..car() });
    let cells = |planning: &Planning<'_>| {
        planning.cells.bits.iter().filter(|bits| *bits & OBJECT != 0).count()
    };
    planning.predict(0.0);
    let now = cells(&planning);
    planning.predict(2.0);
    assert!(cells(&planning) > now + now / 5, "{} cells after {now}", cells(&planning));
}

#[test]
fn a_box_that_is_not_a_number_covers_nothing() {
    let mut planning = planning(&CAPACITY, &CONFIG());
    planning.add_moving(MovingBox { center_m: [f32::NAN; 3], half_m: [f32::INFINITY; 3], ..car() });
    planning.predict(f32::NAN);
    assert!(planning.cells.bits.iter().all(|bits| bits & OBJECT == 0));
}
