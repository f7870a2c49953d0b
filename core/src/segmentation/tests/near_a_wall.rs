//! Masks of what moves close to a wall.

use super::*;
use crate::volume::VolumeConfig;
use crate::volume::tests::analytic;
use known::KnownSurfaces;

const PERSON_M: f64 = 12.0;

/// Disparities, 1/256 px, of a person 0.5 m wide and 1.6 m high at [`PERSON_M`] before a wall.
fn disparity(wall_m: f64) -> Vec<u16> {
    let q8 = |depth_m: f64| (256.0 * RIG.focal_baseline_px_m() / depth_m) as u16;
    let [[left, top], [right, bottom]] =
        [[-0.25, 0.0], [0.25, 1.6]].map(|[x, y]| project([x, y, PERSON_M])[0]);
    (0..WIDTH * HEIGHT)
        .map(|at| [(at % WIDTH) as f32, (at / WIDTH) as f32])
        .map(|[u, v]| u >= left && u < right && v >= top && v < bottom)
        .map(|is_person| q8(if is_person { PERSON_M } else { wall_m }))
        .collect()
}

/// Grows a mask from members within `extent`: if it holds the person, and the wall 0.7 m beside.
fn grown(lattice: &Lattice<'_>, extent: extent::Extent) -> [bool; 2] {
    let (mut cells, mut queue) = (vec![0; cells(&CAPACITY)], vec![0; cells(&CAPACITY)]);
    lattice.grow(&extent, &[], &mut cells, &mut queue).unwrap();
    [0.0, 0.7].map(|x| {
        let [u, v] = project([x, 0.8, PERSON_M])[0];
        lattice.is_own(&cells, u as i32, v as i32)
    })
}

#[test]
fn the_mask_of_a_person_keeps_off_the_wall_behind() {
    let disparity = disparity(12.7);
    let lattice = Lattice::new(&RIG, View::new(&disparity, WIDTH, HEIGHT).unwrap(), None);
    let person = extent::Extent { low: [-0.2, 0.2, 11.9], high: [0.2, 1.4, 12.1] };
    assert_eq!(grown(&lattice, person), [true, false]);
    // Members as wide as high may be on the front of a car, whose rest is to be found.
    let car = extent::Extent { low: [-0.6, 0.2, 11.9], high: [0.6, 1.4, 12.1] };
    assert_eq!(grown(&lattice, car), [true, true]);
}

#[test]
fn a_mask_does_not_grow_over_a_surface_that_the_map_held_before() {
    let disparity = disparity(12.7);
    let config = VolumeConfig::default();
    // A wall at 12.7 m about the axis, seen so many times.
    let map = |observed: u8| {
        let mut volume = analytic::empty(&config, 800);
        let sample = |[_, _, z]: [i32; 3]| Some((12.7 - z as f32 * 0.05, observed, [0; 3]));
        analytic::fill(&mut volume, analytic::cuboid([-4, -4, 30], [4, 6, 33]), sample);
        volume
    };
    let car = extent::Extent { low: [-0.6, 0.2, 11.9], high: [0.6, 1.4, 12.1] };
    let t_world_camera = Transform::IDENTITY;
    for (observed, holds_wall) in [(2, true), (3, false)] {
        let volume = map(observed);
        let known = KnownSurfaces { volume: &volume, t_world_camera: &t_world_camera };
        let lattice = Lattice::new(&RIG, View::new(&disparity, WIDTH, HEIGHT).unwrap(), None)
            .with_known(Some(known));
        assert_eq!(grown(&lattice, car), [true, holds_wall], "{observed} observations");
    }
}
