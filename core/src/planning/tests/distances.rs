//! Distance fields equal what a search over all cells finds.

use super::*;
use crate::{planning::distance::DistanceField, random::Random};

/// Squared distance to the nearest cell of the other kind, and which: the one with the lowest z,
/// then x, then y.
fn by_search(is_obstacle: &[u8], [width, length, height]: [usize; 3]) -> Vec<Option<(u32, usize)>> {
    // The order of cells in memory differs from the order of the search.
    let at = |[x, y, z]: [usize; 3]| (y * width + x) * height + z;
    let all = || {
        (0..height)
            .flat_map(move |z| (0..width).flat_map(move |x| (0..length).map(move |y| [x, y, z])))
    };
    let mut found = vec![None; is_obstacle.len()];
    for cell in all() {
        for other in all().filter(|other| is_obstacle[at(*other)] != is_obstacle[at(cell)]) {
            let squared =
                cell.iter().zip(other).map(|(a, b)| (a.abs_diff(b) as u32).pow(2)).sum::<u32>();
            let entry = &mut found[at(cell)];
            // Only a nearer one replaces the first.
            if entry.is_none_or(|(least, _)| squared < least) {
                *entry = Some((squared, at(other)));
            }
        }
    }
    found
}

fn transformed(is_obstacle: &[u8], size: [usize; 3]) -> Vec<Option<(u32, usize)>> {
    let longest = *size.iter().max().unwrap();
    let mut carver = carver(DistanceField::bytes(is_obstacle.len(), longest));
    let mut field = DistanceField::new_in(is_obstacle.len(), longest, &mut carver);
    carver.check().unwrap();
    assert!(field.transform(is_obstacle, size));
    (0..is_obstacle.len()).map(|at| field.get(at)).collect()
}

#[test]
fn a_thousand_random_windows_equal_a_search_over_all_cells() {
    let mut random = Random::new(19);
    for round in 0..1_000u32 {
        let mut side = |most: u32| 1 + random.below(most) as usize;
        let size =
            if round % 2 == 0 { [side(24), side(24), 1] } else { [side(9), side(9), side(9)] };
        // From hardly any obstacle to hardly anything else.
        let share = 1 + random.below(60);
        let is_obstacle: Vec<u8> =
            (0..size.iter().product()).map(|_| u8::from(random.below(61) < share)).collect();
        assert_eq!(
            transformed(&is_obstacle, size),
            by_search(&is_obstacle, size),
            "window {round} of {size:?}"
        );
    }
}

#[test]
fn a_window_of_one_kind_has_no_distance_and_one_obstacle_gives_circles() {
    for kind in [0, 1] {
        assert!(transformed(&[kind; 35], [7, 5, 1]).iter().all(Option::is_none));
    }
    let mut is_obstacle = [0u8; 101 * 101];
    is_obstacle[50 * 101 + 50] = 1;
    for (at, found) in transformed(&is_obstacle, [101, 101, 1]).into_iter().enumerate() {
        let squared = ((at % 101).abs_diff(50).pow(2) + (at / 101).abs_diff(50).pow(2)) as u32;
        let expected =
            if squared == 0 { Some((1, 50 * 101 + 50)) } else { Some((squared, 50 * 101 + 50)) };
        assert_eq!(found.map(|found| found.0), expected.map(|found| found.0), "cell {at}");
        assert!(squared == 0 || found == expected);
    }
}

#[test]
fn the_longest_window_does_not_overflow() {
    let side = crate::planning::MAX_SIDE_CELLS;
    let mut is_obstacle = vec![0u8; side * side];
    is_obstacle[0] = 1;
    let found = transformed(&is_obstacle, [side, side, 1]);
    assert_eq!(found[side * side - 1], Some((2 * (side as u32 - 1).pow(2), 0)));
}

#[test]
fn distances_are_signed_and_point_to_the_nearest_obstacle() {
    let mut planning =
        planning(&CAPACITY, &PlanningConfig { level: true, low_m: -2.0, high_m: 2.0, ..CONFIG() });
    let size = planning.size();
    let cells = cells_of(&mut planning);
    for y in 0..size[1] {
        for x in 0..size[0] {
            for z in 0..size[2] {
                // A slab of obstacle ten cells thick across the whole window, from x = 20.
                let at = cells.position([x, y, z]).unwrap();
                cells.bits[at] = if (20..30).contains(&x) {
                    crate::planning::cells::OCCUPIED
                } else {
                    crate::planning::cells::FREE
                };
            }
        }
    }
    planning.predict(0.0);
    let [x, y, z] = planning.origin();
    // One cell ten cells before the slab, and one in it, two cells from the free side.
    let (outside, inside) = ([x + 10, y + 5, z], [x + 21, y + 5, z + 3]);
    let slice = planning.slice_distance(outside).unwrap();
    assert_eq!(
        // Cells of 0.2 m: ten of them are 2 m.
        (slice.squared_cells, slice.nearest, slice.distance_m),
        (100, [x + 20, y + 5, z], 2.0)
    );
    let cell = planning.cell_distance(inside).unwrap();
    assert_eq!(
        // Within, the nearest free cell counts, two cells away, and the sign is negative.
        (cell.squared_cells, cell.nearest, cell.distance_m),
        (4, [x + 19, y + 5, z + 3], -0.4)
    );
    let is_down = |gradient: Option<[f32; 2]>| {
        gradient.is_some_and(|[right, ahead]| (right + 1.0).abs() < 1e-6 && ahead == 0.0)
    };
    assert!(is_down(planning.slice_gradient(outside)));
    // Within, the gradient points out of the obstacle's near face.
    assert_eq!(planning.cell_gradient(inside).map(|[right, ..]| right < 0.0), Some(true));
    // A cell of the window's edge has a neighbour on one side only.
    assert!(is_down(planning.slice_gradient([x, y, z])), "at the edge");
    assert_eq!(planning.slice_distance([x - 1, y, z]), None);
}
