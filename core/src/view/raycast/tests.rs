use super::*;
use crate::{
    geometry::{StereoRig, Transform},
    memory::SLAB_ALIGN,
    parallel::{Serial, TwoThreads},
    random::Random,
    volume::{
        BlockCoord, VolumeConfig,
        tests::analytic::{Told, cuboid, empty, fill},
    },
};
use cell::{Corners, Field, NO_AXIS, RaySegment, mean, within};
use eye::{AXES, depth_from_m, depth_in_m};
use nalgebra::{Point3, Vector3};
use std::{boxed::Box, vec, vec::Vec};

const VOXEL_M: f32 = 0.05;
const RIG: StereoRig = StereoRig { focal_px: 120.0, center_u_px: 79.3, center_v_px: 47.6, baseline_m: 0.5 };

fn capacity(visible_blocks: usize) -> Capacity {
    Capacity { image_width: 160, image_height: 96, visible_blocks, ..Capacity::TINY }
}

fn raycaster(visible_blocks: usize, config: &RaycastConfig) -> Raycaster<'static> {
    let capacity = capacity(visible_blocks);
    let bytes = Raycaster::bytes(&capacity);
    let memory = Box::leak(vec![0u8; bytes + SLAB_ALIGN].into_boxed_slice());
    let start = memory.as_ptr().align_offset(SLAB_ALIGN);
    Raycaster::new_in(&capacity, config, &mut Carver::new(&mut memory[start..], bytes).unwrap())
}

fn view(t_world_camera: Transform) -> Viewpoint {
    Viewpoint { rig: RIG, width: 160, height: 96, t_world_camera }
}

fn at(rotation: [f64; 3], translation: [f64; 3]) -> Viewpoint {
    view(Transform::new(Vector3::from(rotation), Vector3::from(translation)))
}

/// Something a ray can meet: the depth along its z at which a camera sees it through a direction (x, y, 1) in world axes.
trait Scene {
    fn depth(&self, origin: Point3<f64>, direction: Vector3<f64>) -> Option<f64>;
    /// Distance in m, positive in free space.
    fn distance(&self, point: Point3<f64>) -> f64;
    fn normal(&self, point: Point3<f64>) -> Vector3<f64>;
}

struct Plane {
    normal: Vector3<f64>,
    offset: f64,
}

impl Plane {
    /// Free space lies on the side to which `normal` points; the plane passes through `through`.
    fn new(normal: [f64; 3], through: [f64; 3]) -> Self {
        let normal = Vector3::from(normal).normalize();
        Self { normal, offset: normal.dot(&Vector3::from(through)) }
    }
}

impl Scene for Plane {
    fn depth(&self, origin: Point3<f64>, direction: Vector3<f64>) -> Option<f64> {
        let towards = -self.normal.dot(&direction);
        (towards > 1e-9).then(|| self.distance(origin) / towards).filter(|&depth| depth > 0.0)
    }
    fn distance(&self, point: Point3<f64>) -> f64 {
        self.normal.dot(&point.coords) - self.offset
    }
    fn normal(&self, _: Point3<f64>) -> Vector3<f64> {
        self.normal
    }
}

struct Ball {
    center: Vector3<f64>,
    radius: f64,
}

impl Scene for Ball {
    fn depth(&self, origin: Point3<f64>, direction: Vector3<f64>) -> Option<f64> {
        let from = origin.coords - self.center;
        let (a, b, c) = (direction.dot(&direction), from.dot(&direction), from.dot(&from) - self.radius * self.radius);
        let root = b * b - a * c;
        (root > 0.0).then(|| (-b - root.sqrt()) / a)
    }
    fn distance(&self, point: Point3<f64>) -> f64 {
        (point.coords - self.center).norm() - self.radius
    }
    fn normal(&self, point: Point3<f64>) -> Vector3<f64> {
        (point.coords - self.center).normalize()
    }
}

fn place(point: [i32; 3]) -> Point3<f64> {
    Point3::from(point.map(|c| f64::from(c) * f64::from(VOXEL_M)))
}

/// Distances as they are.
fn true_distances(scene: &impl Scene) -> impl Fn([i32; 3]) -> Told {
    |point| Some((scene.distance(place(point)) as f32, 3, [10, 20, 30])).filter(|(distance, ..)| distance.abs() < 0.75)
}

/// Distances as a camera at the origin measures them, along its z.
fn seen_from_origin(scene: &impl Scene) -> impl Fn([i32; 3]) -> Told {
    |point| {
        let point = place(point);
        if point.z <= 0.1 {
            return None;
        }
        let depth = scene.depth(Point3::origin(), point.coords / point.z)?;
        let distance = depth - point.z;
        (distance >= -0.75).then_some((if distance < 0.75 { distance } else { 0.75 } as f32, 3, [10, 20, 30]))
    }
}

fn filled(low: [i32; 3], high: [i32; 3], tell: impl Fn([i32; 3]) -> Told) -> Volume<'static> {
    let mut volume = empty(&VolumeConfig::default(), cuboid(low, high).count());
    fill(&mut volume, cuboid(low, high), tell);
    volume
}

/// Depth errors in voxels against the truth, for all pixels where there is a hit, and the share of pixels whose truth, nearer than `far_m`,
/// was met.
fn errors(caster: &Raycaster<'_>, view: &Viewpoint, scene: &impl Scene, far_m: f64) -> (Vec<f64>, f64) {
    let depth = caster.depth_m().unwrap();
    let origin = Point3::from(view.t_world_camera.translation());
    let (mut errors, mut wanted, mut met) = (Vec::new(), 0.0, 0.0);
    for v in 0..view.height {
        for u in 0..view.width {
            let ray = Vector3::new((u as f64 - RIG.center_u_px) / RIG.focal_px, (v as f64 - RIG.center_v_px) / RIG.focal_px, 1.0);
            let Some(truth) = scene.depth(origin, view.t_world_camera.rotate(ray)).filter(|&truth| truth < far_m) else { continue };
            let seen = f64::from(depth.get(u, v).unwrap());
            wanted += 1.0;
            if seen > 0.0 {
                met += 1.0;
                errors.push((seen - truth) / f64::from(VOXEL_M));
            }
        }
    }
    (errors, met / wanted)
}

fn median(values: &[f64]) -> f64 {
    let mut values: Vec<f64> = values.iter().map(|value| value.abs()).collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn mean_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn planes_are_met_where_they_are_whatever_the_angle_and_the_kind_of_distance() {
    let poses = [at([0.0; 3], [0.0; 3]), at([0.03, -0.2, 0.05], [0.6, -0.1, 0.3])];
    for (normal, bound) in [([0.0, 0.0, -1.0], 0.01), ([0.6, 0.1, -0.8], 0.02), ([-0.3, -0.7, -0.6], 0.02), ([0.02, -1.0, -0.15], 0.2)] {
        let plane = Plane::new(normal, [0.1, 0.5, 3.017]);
        let maps = [filled([-9, -7, 0], [9, 7, 12], true_distances(&plane)), filled([-9, -7, 0], [9, 7, 12], seen_from_origin(&plane))];
        for (map, view) in maps.iter().flat_map(|map| poses.iter().map(move |view| (map, view))) {
            let mut caster = raycaster(6_000, &RaycastConfig::default());
            caster.cast(map, view, &Serial).unwrap();
            let (errors, met) = errors(&caster, view, &plane, 3.5);
            assert!(
                median(&errors) < bound && mean_of(&errors).abs() < bound / 2.0,
                "{normal:?}: {} {}",
                median(&errors),
                mean_of(&errors)
            );
            assert!(met > 0.9, "{normal:?}: {met}");
        }
    }
}

#[test]
fn a_ball_is_met_within_a_fraction_of_a_voxel_from_poses_that_never_saw_it() {
    let ball = Ball { center: Vector3::new(0.2, -0.1, 3.0), radius: 0.8 };
    let volume = filled([-5, -5, 3], [5, 5, 11], true_distances(&ball));
    for view in [at([0.0; 3], [0.0; 3]), at([0.0, -0.9, 0.0], [2.4, 0.0, 1.2]), at([0.5, 0.4, 0.3], [-1.0, 1.9, 0.4])] {
        let mut caster = raycaster(2_000, &RaycastConfig::default());
        let report = caster.cast(&volume, &view, &Serial).unwrap();
        let (errors, met) = errors(&caster, &view, &ball, 9.0);
        assert!(met > 0.99 && report.pixels > 1_000 && report.blocks_left_out == 0);
        assert!(median(&errors) < 0.03 && mean_of(&errors).abs() < 0.05, "{} {}", median(&errors), mean_of(&errors));
    }
}

#[test]
fn normals_face_the_camera_and_colour_and_weight_are_those_of_the_surface() {
    let ball = Ball { center: Vector3::new(0.2, -0.1, 3.0), radius: 0.8 };
    let volume = filled([-5, -5, 3], [5, 5, 11], true_distances(&ball));
    let view = at([0.1, -0.5, 0.2], [1.4, 0.0, 0.2]);
    let mut caster = raycaster(2_000, &RaycastConfig::default());
    caster.cast(&volume, &view, &Serial).unwrap();
    let (normal, depth) = (caster.normal().unwrap(), caster.depth_m().unwrap());
    let mut hits = 0;
    for (v, row) in depth.rows().enumerate() {
        for (u, &depth) in row.iter().enumerate().filter(|(_, depth)| **depth > 0.0) {
            hits += 1;
            let ray = Vector3::new((u as f64 - RIG.center_u_px) / RIG.focal_px, (v as f64 - RIG.center_v_px) / RIG.focal_px, 1.0);
            let truth = view
                .t_world_camera
                .inverse()
                .rotate(ball.normal(view.t_world_camera.transform_point(Point3::from(ray * f64::from(depth)))));
            let seen = Vector3::from(normal.get(u, v).unwrap().map(|c| f64::from(c) / f64::from(NORMAL_ONE)));
            assert!((seen - truth).norm() < 0.07, "{seen} {truth}");
            assert!(seen.dot(&ray) < 0.05);
            assert_eq!((caster.colour().unwrap().get(u, v), caster.weight().unwrap().get(u, v)), (Some([10, 20, 30]), Some(3)));
        }
    }
    assert!(hits > 1_000);
}

#[test]
fn points_never_seen_do_not_pull_the_surface_to_either_side() {
    let plane = Plane::new([0.5, 0.2, -0.8], [0.0, 0.0, 3.0]);
    let tell = true_distances(&plane);
    for (seen_percent, least) in [(97, 0.98), (90, 0.95), (80, 0.85), (60, 0.55)] {
        let mut volume = empty(&VolumeConfig::default(), 5_000);
        fill(&mut volume, cuboid([-9, -7, 0], [9, 7, 12]), |point| {
            let seed = point.iter().fold(7u64, |seed, &c| seed.wrapping_mul(8_191).wrapping_add(c as u64));
            tell(point).filter(|_| Random::new(seed).below(100) < seen_percent)
        });
        let view = at([0.05, 0.1, 0.0], [0.0; 3]);
        let mut caster = raycaster(6_000, &RaycastConfig::default());
        caster.cast(&volume, &view, &Serial).unwrap();
        let (errors, met) = errors(&caster, &view, &plane, 4.0);
        assert!(met > least, "{seen_percent}: {met}");
        assert!(mean_of(&errors).abs() < 0.05, "{seen_percent}: {}", mean_of(&errors));
        assert!(median(&errors) < 0.05, "{seen_percent}: {}", median(&errors));
    }
}

#[test]
fn a_ray_that_begins_behind_a_surface_or_comes_out_of_unseen_space_at_its_back_meets_none() {
    let wall = Plane::new([0.0, 0.0, 1.0], [0.0, 0.0, 3.0]);
    // Free space lies beyond: the camera looks at the back of the wall, from unseen space and from within it.
    let volume = filled([-9, -7, 0], [9, 7, 12], true_distances(&wall));
    let mut caster = raycaster(6_000, &RaycastConfig::default());
    for z in [0.0, 2.3, 2.5, 2.9] {
        let report = caster.cast(&volume, &at([0.0; 3], [0.0, 0.0, z]), &Serial).unwrap();
        assert_eq!(report.pixels, 0, "from {z}");
    }
    let report = caster.cast(&volume, &at([0.0, core::f64::consts::PI, 0.0], [0.0, 0.0, 5.0]), &Serial).unwrap();
    assert_eq!(report.pixels, 160 * 96, "while its face is seen");
}

#[test]
fn a_sheet_one_lattice_point_thick_stops_every_ray_at_every_angle() {
    let sheet = |point: [i32; 3]| Some((if point[2] == 60 { -0.002 } else { 0.75 }, 1, [0; 3]));
    let volume = filled([-12, -5, 5], [12, 5, 8], sheet);
    for delta in [0.0, 0.5, 1.0] {
        let mut caster = raycaster(6_000, &RaycastConfig::default());
        caster.cast(&volume, &at([0.0, delta, 0.0], [-4.0 * delta, 0.0, 1.5]), &Serial).unwrap();
        let depth = caster.depth_m().unwrap();
        for u in (0..160).step_by(3) {
            let ray = Vector3::new((u as f64 - RIG.center_u_px) / RIG.focal_px, 0.0, 1.0);
            let world = Transform::new(Vector3::new(0.0, delta, 0.0), Vector3::zeros()).rotate(ray);
            let truth = 1.5 / world.z;
            let x = -4.0 * delta + world.x * truth;
            if world.z > 0.1 && x.abs() < 4.5 {
                let seen = f64::from(depth.get(u, 48).unwrap());
                assert!((seen - truth) * world.z < 0.05 && seen > 0.0, "column {u}, delta {delta}: {seen} for {truth}");
            }
        }
    }
}

#[test]
fn far_from_the_origin_the_picture_is_the_same() {
    let plane = Plane::new([0.4, 0.0, -0.9], [0.0, 0.0, 3.0]);
    let tell = true_distances(&plane);
    let mut pictures = Vec::new();
    for shift in [0, 32_000] {
        let mut volume = empty(&VolumeConfig::default(), 5_000);
        let moved = cuboid([-9, -7, 0], [9, 7, 12]).map(|c| BlockCoord::new(c.x.into(), c.y.into(), i32::from(c.z) - shift).unwrap());
        fill(&mut volume, moved, |[x, y, z]| tell([x, y, z + 8 * shift]));
        let mut caster = raycaster(6_000, &RaycastConfig::default());
        caster.cast(&volume, &at([0.05, 0.1, 0.0], [0.1, 0.2, 0.3 - f64::from(8 * shift) * f64::from(VOXEL_M)]), &Serial).unwrap();
        pictures.push(caster.depth_m.to_vec());
    }
    assert!(pictures[0].iter().filter(|&&depth| depth > 0.0).count() > 10_000);
    let equal = pictures[0].iter().zip(&pictures[1]).filter(|(a, b)| (*a - *b).abs() < 1e-4).count();
    assert!(equal + 5 > pictures[0].len(), "{equal}");
}

#[test]
fn a_minimum_weight_hides_what_was_seen_less_often() {
    let near = Plane::new([0.0, 0.0, -1.0], [0.0, 0.0, 2.0]);
    let volume = filled([-9, -7, 0], [9, 7, 12], |point| {
        let far = Plane::new([0.0, 0.0, -1.0], [0.0, 0.0, 3.5]);
        true_distances(&near)(point).map(|(sdf, _, colour)| (sdf, 2, colour)).or_else(|| true_distances(&far)(point))
    });
    for (min_weight, depth) in [(1, 2.0), (2, 2.0), (3, 3.5)] {
        let mut caster = raycaster(6_000, &RaycastConfig { min_weight, ..RaycastConfig::default() });
        caster.cast(&volume, &at([0.0; 3], [0.0; 3]), &Serial).unwrap();
        assert!((caster.depth_m().unwrap().get(80, 48).unwrap() - depth).abs() < 0.01);
    }
}

/// A rough scene: a slanted plane and a ball, distances disturbed, some points unseen, some blocks missing, weights and colours at random.
fn rough(seed: u64) -> Volume<'static> {
    let plane = Plane::new([0.3, -0.4, -0.8], [0.0, 0.0, 3.2]);
    let ball = Ball { center: Vector3::new(-0.3, 0.1, 2.0), radius: 0.5 };
    let mut random = Random::new(seed);
    let coords: Vec<_> = cuboid([-8, -6, 0], [8, 6, 12]).filter(|_| random.below(20) > 0).collect();
    let mut volume = empty(&VolumeConfig::default(), coords.len());
    fill(&mut volume, coords, |point| {
        let mut random = Random::new(point.iter().fold(seed, |seed, &c| seed.wrapping_mul(8_191).wrapping_add(c as u64)));
        let at = place(point);
        let distance = if plane.distance(at) < ball.distance(at) { plane.distance(at) } else { ball.distance(at) } as f32;
        let distance = distance + random.below(1_000) as f32 * 1e-4 - 0.05;
        let colour = [(); 3].map(|()| random.below(256) as u8);
        let told = distance.abs() < 0.75 && random.below(100) < 93;
        told.then_some((distance, 1 + random.below(4) as u8, if random.below(4) == 0 { [0; 3] } else { colour }))
    });
    volume
}

/// One pixel, the obvious way: every cell from the nearest depth to the farthest, corners looked up in the index one by one.
fn plain(volume: &Volume<'_>, view: &Viewpoint, config: &RaycastConfig, u: usize, v: usize) -> Option<f32> {
    let eye = RayCamera::new(view, VOXEL_M).unwrap();
    let ray = eye.ray(u, v);
    let mut sampler = volume.sampler();
    let far = depth_from_m(config.far_m);
    let mut from = depth_from_m(config.near_m);
    let mut cell = ray.cell_at(from);
    let mut entered = None;
    let mut last_cell = (0.0, 0);
    while from <= far {
        let next = AXES.map(|axis| ray.crossing(axis, cell[axis] + ray.ahead[axis]));
        let to = *next.iter().min().unwrap();
        let axis = next.iter().position(|&depth| depth == to).unwrap();
        let mut corners = Corners::default();
        for corner in 0..8 {
            let point = AXES.map(|axis| cell[axis] + 8 * eye.base[axis] + (corner >> axis & 1) as i32);
            if let Some(sample) = sampler.voxel(point).filter(|sample| sample.weight >= config.min_weight) {
                corners.sdf[corner] = f32::from(sample.sdf);
                corners.observed |= 1 << corner;
            }
        }
        let is_seen = |corner: usize| corners.observed >> corner & 1 == 1;
        let any = |wanted: fn(f32) -> bool| (0..8).any(|corner| is_seen(corner) && wanted(corners.sdf[corner]));
        // A cell belongs to the block of its first corner: without that there is none.
        let own = BlockCoord::of_lattice(AXES.map(|axis| cell[axis] + 8 * eye.base[axis])).and_then(|coord| volume.find(coord));
        if own.is_some() && to > from && any(|sdf| sdf > 0.0) && any(|sdf| sdf <= 0.0) {
            let block = ray.offset(cell.map(|c| c >> 3));
            let offset = AXES.map(|axis| block[axis] - (cell[axis] & 7) as f32);
            let passage = RaySegment::new(&ray, offset, [from, to].map(depth_in_m), [entered.unwrap_or(NO_AXIS), axis]);
            let guessed = corners.complete();
            let value = |wall: Option<(usize, usize)>, depth| {
                if let Some((axis, upper)) = wall {
                    let [u, v] = [[1, 2], [0, 2], [0, 1]][axis];
                    let four = [0, 1 << u, 1 << v, 1 << u | 1 << v].map(|corner| corner | upper << axis);
                    if let Some([a, b, c, d]) = march::completed(four.map(|corner| is_seen(corner).then(|| corners.sdf[corner]))) {
                        let [u, v] = [u, v].map(|axis| within(offset[axis], ray.slope[axis], depth_in_m(depth)));
                        let (low, high) = (a + (b - a) * u, c + (d - c) * u);
                        return low + (high - low) * v;
                    }
                }
                guessed.map_or(0.0, |corners| mean(&corners, passage.end(depth == to)))
            };
            let first =
                if last_cell.1 == from { last_cell.0 } else { value(entered.map(|axis| (axis, 1 - ray.ahead[axis] as usize)), from) };
            let last = value(Some((axis, ray.ahead[axis] as usize)), to);
            if let (true, true, Some(corners)) = (first > 0.0, last <= 0.0, guessed) {
                let share = passage.root(&Field::new(&corners), first, last);
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
fn threads_change_nothing() {
    let volume = rough(9);
    let view = at([0.1, -0.4, 0.2], [0.9, -0.3, 0.2]);
    let mut alone = raycaster(6_000, &RaycastConfig::default());
    let mut together = raycaster(6_000, &RaycastConfig::default());
    assert_eq!(alone.cast(&volume, &view, &Serial), together.cast(&volume, &view, &TwoThreads));
    assert_eq!(alone.depth_m, together.depth_m);
    assert_eq!(alone.normal, together.normal);
    assert_eq!(alone.colour, together.colour);
    assert_eq!(alone.weight, together.weight);
}

/// Everything a picture shows, pixel by pixel.
type Pixel = (f32, [i8; 3], [u8; 3], u8);

fn pixels(caster: &Raycaster<'_>) -> Vec<Pixel> {
    let images = caster.depth_m.iter().zip(caster.normal.iter()).zip(caster.colour.iter().zip(caster.weight.iter()));
    images.map(|((depth, normal), (colour, weight))| (*depth, *normal, *colour, *weight)).collect()
}

#[test]
fn several_maps_in_one_picture_show_what_is_nearest_of_each_alone() {
    let ground = rough(5);
    let ball = Ball { center: Vector3::new(0.2, -0.1, 3.0), radius: 0.8 };
    let ball = filled([-5, -5, 3], [5, 5, 11], true_distances(&ball));
    let near = Plane::new([0.0, 0.0, -1.0], [0.0, 0.0, 1.5]);
    let sheet = filled([0, -7, 2], [1, 7, 5], true_distances(&near));
    let camera = at([0.1, -0.4, 0.2], [0.9, -0.3, 0.2]);
    let moved = |rotation: [f64; 3], shift: [f64; 3]| Viewpoint {
        t_world_camera: Transform::new(Vector3::from(rotation), Vector3::from(shift)) * camera.t_world_camera,
        ..camera
    };
    // The ball twice: once before, once behind the ground and the other ball in part.
    let maps = [
        (&ball, moved([0.0, 0.3, 0.0], [0.0, 0.0, 0.4])),
        (&sheet, moved([0.0; 3], [0.1, 0.0, 0.0])),
        (&ball, moved([0.0; 3], [-0.7, 0.0, -0.6])),
    ];
    let mut caster = raycaster(6_000, &RaycastConfig::default());
    caster.cast(&ground, &camera, &Serial).unwrap();
    let mut nearest: Vec<(Pixel, u8)> = pixels(&caster).into_iter().map(|pixel| (pixel, 0)).collect();
    let mut threaded = raycaster(6_000, &RaycastConfig::default());
    threaded.cast(&ground, &camera, &TwoThreads).unwrap();
    for (layer, (map, view)) in (1..).zip(&maps) {
        let mut alone = raycaster(6_000, &RaycastConfig::default());
        alone.cast(map, view, &Serial).unwrap();
        let mut shown = 0;
        for (nearest, pixel) in nearest.iter_mut().zip(pixels(&alone)) {
            if pixel.0 > 0.0 && (nearest.0.0 == 0.0 || pixel.0 < nearest.0.0) {
                *nearest = (pixel, layer);
                shown += 1;
            }
        }
        assert_eq!(caster.cast_over(map, view, layer, &Serial).unwrap().pixels, shown);
        threaded.cast_over(map, view, layer, &TwoThreads).unwrap();
    }
    for caster in [&caster, &threaded] {
        let composed: Vec<(Pixel, u8)> = pixels(caster).into_iter().zip(caster.layer.iter().copied()).collect();
        assert!(composed == nearest);
    }
    for layer in 0..=3 {
        assert!(nearest.iter().filter(|(pixel, shown)| *shown == layer && pixel.0 > 0.0).count() > 300, "map {layer} is seen");
    }
    let other_size = Viewpoint { width: 80, ..camera };
    assert_eq!(caster.cast_over(&ball, &other_size, 9, &Serial), Err(RaycastError::ImageSize));
    let absurd = Viewpoint { rig: StereoRig { focal_px: 0.0, ..RIG }, ..camera };
    assert_eq!(caster.cast_over(&ball, &absurd, 9, &Serial), Err(RaycastError::Viewpoint));
    assert!(pixels(&caster).iter().zip(&nearest).all(|(pixel, (known, _))| pixel == known), "a refused map changes nothing");
    assert_eq!(
        raycaster(10, &RaycastConfig::default()).cast_over(&ball, &camera, 1, &Serial),
        Err(RaycastError::ImageSize),
        "over nothing"
    );
    caster.cast(&ground, &camera, &Serial).unwrap();
    assert!(caster.layer.iter().all(|layer| *layer == 0), "the next picture begins anew");
}

#[test]
fn without_room_for_all_blocks_the_picture_ends_nearer_and_says_so() {
    let volume = rough(4);
    let view = at([0.0; 3], [0.0; 3]);
    let mut whole = raycaster(6_000, &RaycastConfig::default());
    let all = whole.cast(&volume, &view, &Serial).unwrap();
    assert_eq!((all.blocks_left_out, all.far_m), (0, 30.0));
    let room = all.blocks_in_view as usize / 2;
    let mut small = raycaster(room, &RaycastConfig::default());
    let some = small.cast(&volume, &view, &Serial).unwrap();
    assert_eq!(some.blocks_in_view, all.blocks_in_view);
    assert!(some.blocks_left_out as usize >= room && some.far_m < 4.0 && some.far_m > 1.0, "{some:?}");
    assert!(some.pixels > 0 && some.pixels < all.pixels);
    for (whole, some) in whole.depth_m.iter().zip(small.depth_m.iter()) {
        assert!(*some == 0.0 || (whole == some && *some <= 4.0));
    }
}

#[test]
fn refuses_what_it_cannot_look_at_and_shows_no_picture() {
    let volume = empty(&VolumeConfig::default(), 1);
    let mut caster = raycaster(10, &RaycastConfig::default());
    let good = at([0.0; 3], [0.0; 3]);
    assert_eq!(caster.cast(&volume, &good, &Serial).unwrap().pixels, 0);
    assert!(caster.depth_m().unwrap().rows().flatten().all(|&depth| depth == 0.0));
    for (width, height) in [(161, 96), (0, 96), (160, 0), (usize::MAX, 2)] {
        assert_eq!(caster.cast(&volume, &Viewpoint { width, height, ..good }, &Serial), Err(RaycastError::ImageSize));
        assert!(caster.depth_m().is_none());
    }
    for translation in [[f64::NAN, 0.0, 0.0], [f64::INFINITY, 0.0, 0.0], [1e9, 0.0, 0.0]] {
        let lost = Viewpoint {
            t_world_camera: Transform { translation_m: translation, ..good.t_world_camera },
            ..good
        };
        assert_eq!(caster.cast(&volume, &lost, &Serial), Err(RaycastError::Viewpoint));
    }
    let absurd = Viewpoint { rig: StereoRig { focal_px: 0.0, ..RIG }, ..good };
    assert_eq!(caster.cast(&volume, &absurd, &Serial), Err(RaycastError::Viewpoint));
}

#[test]
fn cuts_as_many_bytes_as_it_says() {
    for (_, capacity) in Capacity::PROFILES {
        let bytes = Raycaster::bytes(&capacity);
        let mut slab = vec![0u8; bytes + SLAB_ALIGN];
        let start = slab.as_ptr().align_offset(SLAB_ALIGN);
        let mut carver = Carver::new(&mut slab[start..], bytes).unwrap();
        Raycaster::new_in(&capacity, &RaycastConfig::default(), &mut carver);
        assert_eq!(carver.footprint().bytes(), bytes);
    }
}
