//! The raycaster agrees with a plain walk through every cell.

use super::{scenes::rough, *};
use crate::geometry::scalar::max_f32;

/// The share of a ray's way through a cell at which the field falls from `first` > 0 to 0, where it ends at `last` <= 0.
fn root(ends: [[f32; 3]; 2], field: &Field, first: f32, last: f32) -> f32 {
    let (mut low, mut high) = ([0.0, first], [1.0, last]);
    let (mut share, mut side) = (0.0f32, 0);
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

/// One pixel, the obvious way: every cell from the nearest depth to the farthest, corners looked up in the index one by one.
fn plain(volume: &Volume<'_>, view: &Viewpoint, config: &RaycastConfig, u: usize, v: usize) -> Option<f32> {
    let ray_camera = RayCamera::new(view, VOXEL_M).unwrap();
    let ray = ray_camera.ray(u, v);
    let mut sampler = volume.sampler();
    let [mut from, far] = [config.near_m, config.far_m].map(depth_from_m);
    let (mut cell, _) = ray.cell_and_exits(from);
    let mut entered = None;
    let mut last_cell = (0.0, 0);
    while from <= far {
        let next = AXES.map(|axis| ray.crossing(axis, cell[axis] + ray.ahead[axis]));
        let to = *next.iter().min().unwrap();
        let axis = next.iter().position(|&depth| depth == to).unwrap();
        let mut corners = Corners::default();
        for corner in 0..8 {
            let point = AXES.map(|axis| cell[axis] + 8 * ray_camera.base[axis] + (corner >> axis & 1) as i32);
            if let Some(sample) = sampler.voxel(point).filter(|sample| sample.weight >= config.min_weight) {
                corners.sdf[corner] = f32::from(sample.sdf);
                corners.observed |= 1 << corner;
            }
        }
        let is_seen = |corner: usize| corners.observed >> corner & 1 == 1;
        let any = |test: fn(f32) -> bool| (0..8).any(|corner| is_seen(corner) && test(corners.sdf[corner]));
        // A cell belongs to the block of its first corner and is skipped where that is not in the map.
        let own = BlockCoord::of_lattice(AXES.map(|axis| cell[axis] + 8 * ray_camera.base[axis])).and_then(|coord| volume.find(coord));
        if own.is_some() && to > from && any(|sdf| sdf > 0.0) && any(|sdf| sdf <= 0.0) {
            let block = ray.offset(cell.map(|c| c >> 3));
            let offset = AXES.map(|axis| block[axis] - (cell[axis] & 7) as f32);
            let end = |depth, face: Option<usize>, leaves: bool| {
                let upper = face.map_or(0, |axis| u32::from(leaves == ray.is_ahead(axis)));
                position(&ray, offset, depth_in_m(depth), face.unwrap_or(NO_AXIS), upper)
            };
            let ends = [end(from, entered, false), end(to, Some(axis), true)];
            let guessed = corners.complete();
            let value = |face: Option<(usize, usize)>, depth| {
                if let Some((axis, upper)) = face {
                    let [u, v] = [[1, 2], [0, 2], [0, 1]][axis];
                    let four = [0, 1 << u, 1 << v, 1 << u | 1 << v].map(|corner| corner | upper << axis);
                    if let Some([a, b, c, d]) = march::completed(four.map(|corner| is_seen(corner).then(|| corners.sdf[corner]))) {
                        let [u, v] = [u, v].map(|axis| within(offset[axis], ray.slope[axis], depth_in_m(depth)));
                        let (low, high) = (a + (b - a) * u, c + (d - c) * u);
                        return low + (high - low) * v;
                    }
                }
                guessed.map_or(0.0, |corners| mean(&corners, ends[usize::from(depth == to)]))
            };
            let first =
                if last_cell.1 == from { last_cell.0 } else { value(entered.map(|axis| (axis, 1 - ray.ahead[axis] as usize)), from) };
            let last = value(Some((axis, ray.ahead[axis] as usize)), to);
            if let (true, true, Some(corners)) = (first > 0.0, last <= 0.0, guessed) {
                let share = root(ends, &Field::new(&corners), first, last);
                let [from_m, to_m] = [from, to].map(depth_in_m);
                return Some(from_m + (to_m - from_m) * share).filter(|&depth_m| depth_m <= config.far_m);
            }
            last_cell = (last, to);
        }
        cell[axis] += 2 * ray.ahead[axis] - 1;
        (from, entered) = (to, Some(axis));
    }
    None
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
        let config = RaycastConfig { near_m: 0.35, far_m: 3.9, min_weight: 1 + (seed % 2) as u8 };
        let volume = rough(seed);
        let mut caster = raycaster(6_000, &config);
        caster.cast(&volume, &view, &Serial).unwrap();
        let depth = caster.depth_m().unwrap();
        for v in (0..96).step_by(3) {
            for u in 0..160 {
                let (seen, plain) = (depth.get(u, v).unwrap(), plain(&volume, &view, &config, u, v).unwrap_or(0.0));
                assert_eq!(seen, plain, "scene {seed}, pixel {u} {v}");
                hits += u32::from(seen > 0.0);
            }
        }
    }
    assert!(hits > 10_000, "{hits}");
}

#[test]
fn rays_one_by_one_meet_what_eight_at_a_time_do() {
    let (mut met, mut kept) = (0, 0);
    for (seed, view) in (0..).zip([at([0.0; 3], [0.0; 3]), at([0.1, -0.4, 0.2], [0.9, -0.3, 0.2])]) {
        let volume = rough(seed);
        let mut caster = raycaster(6_000, &RaycastConfig::default());
        caster.cast(&volume, &view, &Serial).unwrap();
        let ray_camera = RayCamera::new(&view, VOXEL_M).unwrap();
        let marcher = Marcher {
            surface: &caster.surface,
            blocks: volume.blocks(),
            ray_camera: &ray_camera,
            min_weight: 1,
        };
        let mut before = [0; 3];
        for at in 0..160 * 96 {
            let (u, v) = (at % 160, at / 160);
            let range = caster.ranges.row(v)[u >> ranges::TILE_SHIFT];
            let (mut hits, mut alone) = (Hits::none(), None);
            if range[0] <= range[1] {
                marcher.cast(u, v, range, &mut hits);
            }
            hits.take(volume.blocks(), &ray_camera.rotation, Vectors::PLAIN, |column, hit| {
                assert_eq!(column, u);
                alone = Some((hit.depth_m, hit.normal.map(|c| (c * NORMAL_ONE) as i8), hit.colour, hit.weight));
            });
            let shown = (caster.depth_m[at], caster.normal[at], caster.colour[at], caster.weight[at]);
            assert_eq!(shown, alone.unwrap_or_default(), "scene {seed}, pixel {u} {v}");
            met += u32::from(alone.is_some());
            let point = AXES.map(|axis| ray_camera.origin[axis] + ray_camera.ray(u, v).slope[axis] * shown.0);
            let cell = point.map(|c| c.floor() as i32);
            kept += u32::from(alone.is_some() && cell == before);
            before = cell;
        }
    }
    assert!(met > 10_000 && kept > 1_000, "{met} {kept}");
}
