//! The raycaster agrees with a plain walk through every cell.

use super::{scenes::rough, *};
use crate::geometry::scalar::max_f32;

/// The share of a ray's way through a cell at which the field falls from `first` > 0 to 0, where it
/// ends at `last` <= 0.
fn root(ends: [[f32; 3]; 2], field: &Field, first: f32, last: f32) -> f32 {
    let (mut low, mut high) = ([0.0, first], [1.0, last]);
    let (mut share, mut side) = (0.0f32, 0);
    // Regula falsi with halved ends (the Illinois method).
    for _ in 0..hits::MAX_REFINEMENTS {
        share = low[0] + (high[0] - low[0]) * (low[1] / (low[1] - high[1]));
        let value = field.at(along(ends, share));
        if value.abs() < hits::GOOD_ENOUGH {
            break;
        }
        if value > 0.0 {
            low = [share, value];
            high[1] *= if side > 0 { 0.5 } else { 1.0 };
            side = 1;
        } else {
            high = [share, value];
            low[1] *= if side < 0 { 0.5 } else { 1.0 };
            side = -1;
        }
    }
    max_f32(0.0, min_f32(share, 1.0))
}

/// One pixel, the obvious way: every cell that the ray passes, each where it leaves the one before,
/// corners looked up in the index one by one; the first in which the field falls from above 0 to 0
/// or below.
fn plain(
    volume: &Volume<'_>,
    view: &Viewpoint,
    config: &RaycastConfig,
    u: usize,
    v: usize,
) -> Option<f32> {
    let ray_camera = RayCamera::new(view, VOXEL_M).unwrap();
    let ray = ray_camera.row(v).ray(u as f32);
    let mut sampler = volume.sampler();
    let mut cell =
        AXES.map(|axis| (ray_camera.origin[axis] + ray.slope[axis] * config.near_m).floor() as i32);
    loop {
        let faces = [0, 1]
            .map(|upper| AXES.map(|axis| (cell[axis] + upper) as f32 - ray_camera.origin[axis]));
        let depths = depths_m(&ray, &faces, config.near_m);
        if depths[0] > config.far_m {
            return None;
        }
        let mut corners = Corners::default();
        for corner in 0..8 {
            let point = AXES
                .map(|axis| cell[axis] + 8 * ray_camera.base[axis] + (corner >> axis & 1) as i32);
            if let Some(sample) =
                sampler.voxel(point).filter(|sample| sample.weight >= config.min_weight)
            {
                corners.sdf[corner] = f32::from(sample.sdf);
                corners.observed |= 1 << corner;
            }
        }
        let any = |test: fn(f32) -> bool| {
            (0..8).any(|corner| corners.observed >> corner & 1 == 1 && test(corners.sdf[corner]))
        };
        // A cell belongs to the block of its first corner and is skipped where that is not in the
        // map.
        let own = BlockCoord::of_lattice(AXES.map(|axis| cell[axis] + 8 * ray_camera.base[axis]))
            .and_then(|coord| volume.find(coord));
        if let (Some(_), Some(corners), true) = (
            own,
            corners.complete(),
            any(|sdf| sdf > 0.0) && any(|sdf| sdf <= 0.0) && depths[0] < depths[1],
        ) {
            let ends = depths.map(|depth_m| position(&ray, &faces, depth_m));
            let values = ends.map(|end| mean(&corners, end));
            if values[0] > 0.0 && values[1] <= 0.0 {
                let share = root(ends, &Field::new(&corners), values[0], values[1]);
                return Some(depths[0] + (depths[1] - depths[0]) * share)
                    .filter(|&depth_m| depth_m <= config.far_m);
            }
        }
        // The face that the ray leaves by.
        let ahead = AXES.map(|axis| usize::from(ray.slope[axis] > 0.0));
        let exits = AXES.map(|axis| faces[ahead[axis]][axis] * ray.per_unit[axis]);
        let axis = AXES.into_iter().min_by(|&a, &b| exits[a].total_cmp(&exits[b])).unwrap();
        cell[axis] += 2 * ahead[axis] as i32 - 1;
    }
}

#[test]
fn agrees_to_the_bit_with_a_walk_through_every_cell() {
    let mut hits = 0;
    for (seed, view) in (0..).zip([
        at([0.0; 3], [0.0; 3]),
        at([0.1, -0.4, 0.2], [0.9, -0.3, 0.2]),
        at([-0.3, 0.8, 0.1], [-1.9, 0.4, 1.1]),
        at([0.0, core::f64::consts::PI, 0.0], [0.2, 0.0, 5.0]),
        at([0.0; 3], [0.0, 0.0, 2.2]),
    ]) {
        // Limits within the scene, so that both are met.
        let config = RaycastConfig { near_m: 0.35, far_m: 3.9, min_weight: 1 + (seed % 2) as u8 };
        let volume = rough(seed);
        let mut caster = raycaster(6_000, &config);
        caster.cast(&volume, &view, &Serial).unwrap();
        let depth = caster.depth_m().unwrap();
        // Every third row: the walk through every cell is slow.
        for v in (0..96).step_by(3) {
            for u in 0..160 {
                let (seen, plain) =
                    (depth.get(u, v).unwrap(), plain(&volume, &view, &config, u, v).unwrap_or(0.0));
                assert_eq!(seen, plain, "scene {seed}, pixel {u} {v}");
                hits += u32::from(seen > 0.0);
            }
        }
    }
    assert!(hits > 10_000, "{hits}");
}

#[test]
fn every_level_of_vectors_shows_the_same_picture() {
    let (volume, view) = (rough(3), at([0.1, -0.4, 0.2], [0.9, -0.3, 0.2]));
    let mut pictures = Vectors::available().map(|vectors| {
        let mut caster = raycaster(6_000, &RaycastConfig::default());
        caster.cast(&volume, &view, &With(vectors)).unwrap();
        (
            caster.depth_m.to_vec(),
            caster.normal.to_vec(),
            caster.colour.to_vec(),
            caster.weight.to_vec(),
        )
    });
    let plain = pictures.next().unwrap();
    assert!(plain.0.iter().filter(|&&depth_m| depth_m > 0.0).count() > 5_000);
    assert!(pictures.all(|picture| picture == plain));
}

#[test]
fn cells_side_by_side_agree_at_the_face_between_them() {
    let mut random = Random::new(11);
    let mut share = || random.below(10_000) as f32 / 10_000.0;
    for axis in AXES {
        for _ in 0..1_000 {
            let shared = [(); 4].map(|()| 60_000.0 * share() - 30_000.0);
            // Corners on the face are the upper ones of one cell and the lower ones of the other.
            let corners = [1, 0].map(|upper| {
                let mut four = shared.iter();
                let mut corner = |corner: usize| {
                    if corner >> axis & 1 == upper {
                        *four.next().unwrap()
                    } else {
                        60_000.0 * share() - 30_000.0
                    }
                };
                core::array::from_fn(&mut corner)
            });
            let origin = [(); 3].map(|()| 8.0 * share());
            let cell = [(); 3].map(|()| (400.0 * share()) as i32 - 200);
            let faces = [0, 1].map(|next| {
                [0, 1].map(|upper| {
                    AXES.map(|a| {
                        (cell[a] + upper + if a == axis { next } else { 0 }) as f32 - origin[a]
                    })
                })
            });
            let slope = [(); 3].map(|()| 40.0 * share() - 19.999_5);
            let inverse = 1.0 / (slope[0] * slope[1] * slope[2]);
            let ray = Ray {
                slope,
                per_unit: [
                    slope[1] * slope[2] * inverse,
                    slope[0] * slope[2] * inverse,
                    slope[0] * slope[1] * inverse,
                ],
            };
            let depth_m = faces[0][1][axis] * ray.per_unit[axis];
            let [one, other] =
                [0, 1].map(|n| mean(&corners[n], position(&ray, &faces[n], depth_m)));
            assert_eq!(one.to_bits(), other.to_bits(), "axis {axis}, {slope:?}");
        }
    }
}
