mod every_cell;
mod layers;
mod scenes;

use super::*;
use crate::{
    geometry::{StereoRig, Transform},
    memory::SLAB_ALIGN,
    parallel::{Serial, TwoThreads, Vectors},
    random::Random,
    volume::{
        BlockCoord, VolumeConfig,
        tests::analytic::{cuboid, empty, fill},
    },
};
use cell::{Corners, Field, along, depths_m, mean, position};
use nalgebra::{Point3, Vector3};
use ray_camera::{AXES, Ray};
use scenes::{Ball, Plane, Scene, filled, rough, seen_from_origin, true_distances};
use std::{boxed::Box, vec, vec::Vec};

const VOXEL_M: f32 = 0.05;
const RIG: StereoRig =
    StereoRig { focal_px: 120.0, center_u_px: 79.3, center_v_px: 47.6, baseline_m: 0.5 };

/// One thread, some vectors.
struct With(Vectors);

impl Executor for With {
    fn vectors(&self) -> Vectors {
        self.0
    }
}

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

/// Errors of depth in voxels at all pixels with a hit, and the share of pixels with a hit among
/// those whose true depth is below `far_m`.
fn errors(
    caster: &Raycaster<'_>,
    view: &Viewpoint,
    scene: &impl Scene,
    far_m: f64,
) -> (Vec<f64>, f64) {
    let depth = caster.depth_m().unwrap();
    // The truth comes from the scene itself, pixel by pixel.
    let origin = Point3::from(view.t_world_camera.translation());
    let (mut errors, mut true_hits, mut met) = (Vec::new(), 0.0, 0.0);
    for v in 0..view.height {
        for u in 0..view.width {
            let ray = Vector3::new(
                (u as f64 - RIG.center_u_px) / RIG.focal_px,
                (v as f64 - RIG.center_v_px) / RIG.focal_px,
                1.0,
            );
            let Some(truth) =
                scene.depth(origin, view.t_world_camera.rotate(ray)).filter(|&truth| truth < far_m)
            else {
                continue;
            };
            let seen = f64::from(depth.get(u, v).unwrap());
            true_hits += 1.0;
            if seen > 0.0 {
                met += 1.0;
                errors.push((seen - truth) / f64::from(VOXEL_M));
            }
        }
    }
    (errors, met / true_hits)
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
fn planes_are_hit_at_their_depth_at_any_angle() {
    // As the map was seen, and from a new place at another angle.
    let poses = [at([0.0; 3], [0.0; 3]), at([0.03, -0.2, 0.05], [0.6, -0.1, 0.3])];
    for (normal, bound) in [
        ([0.0, 0.0, -1.0], 0.01),
        ([0.6, 0.1, -0.8], 0.02),
        ([-0.3, -0.7, -0.6], 0.02),
        ([0.02, -1.0, -0.15], 0.2),
    ] {
        let plane = Plane::new(normal, [0.1, 0.5, 3.017]);
        // One map of true distances, and one as a camera at the origin measures them.
        let maps = [
            filled([-9, -7, 0], [9, 7, 12], true_distances(&plane)),
            filled([-9, -7, 0], [9, 7, 12], seen_from_origin(&plane)),
        ];
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
fn a_ball_is_met_within_a_fraction_of_a_voxel_from_new_poses() {
    let ball = Ball { center: Vector3::new(0.2, -0.1, 3.0), radius: 0.8 };
    let volume = filled([-5, -5, 3], [5, 5, 11], true_distances(&ball));
    for view in [
        at([0.0; 3], [0.0; 3]),
        at([0.0, -0.9, 0.0], [2.4, 0.0, 1.2]),
        at([0.5, 0.4, 0.3], [-1.0, 1.9, 0.4]),
    ] {
        let mut caster = raycaster(2_000, &RaycastConfig::default());
        let report = caster.cast(&volume, &view, &Serial).unwrap();
        let (errors, met) = errors(&caster, &view, &ball, 9.0);
        // Nearly all rays that must meet the ball do.
        assert!(met > 0.99 && report.pixels > 1_000 && report.blocks_left_out == 0);
        assert!(
            median(&errors) < 0.03 && mean_of(&errors).abs() < 0.05,
            "{} {}",
            median(&errors),
            mean_of(&errors)
        );
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
            let ray = Vector3::new(
                (u as f64 - RIG.center_u_px) / RIG.focal_px,
                (v as f64 - RIG.center_v_px) / RIG.focal_px,
                1.0,
            );
            // The ball's normal where the ray met it, in camera axes.
            let truth =
                view.t_world_camera.inverse().rotate(ball.normal(
                    view.t_world_camera.transform_point(Point3::from(ray * f64::from(depth))),
                ));
            let seen = Vector3::from(
                normal.get(u, v).unwrap().map(|c| f64::from(c) / f64::from(NORMAL_ONE)),
            );
            assert!((seen - truth).norm() < 0.07, "{seen} {truth}");
            // No surface is seen from behind.
            assert!(seen.dot(&ray) < 0.05);
            assert_eq!(
                (caster.colour().unwrap().get(u, v), caster.weight().unwrap().get(u, v)),
                (Some([10, 20, 30]), Some(3))
            );
        }
    }
    assert!(hits > 1_000);
}

#[test]
fn points_never_seen_do_not_pull_the_surface_to_either_side() {
    let plane = Plane::new([0.5, 0.2, -0.8], [0.0, 0.0, 3.0]);
    let sample_at = true_distances(&plane);
    // The more is missing, the fewer rays meet the surface; none may meet it elsewhere.
    for (seen_percent, least) in [(97, 0.98), (90, 0.95), (80, 0.85), (60, 0.55)] {
        let mut volume = empty(&VolumeConfig::default(), 5_000);
        fill(&mut volume, cuboid([-9, -7, 0], [9, 7, 12]), |point| {
            let seed =
                // By the point, and not by the order of points, so that neighbouring blocks agree.
                point.iter().fold(7u64, |seed, &c| seed.wrapping_mul(8_191).wrapping_add(c as u64));
            sample_at(point).filter(|_| Random::new(seed).below(100) < seen_percent)
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
fn a_ray_from_behind_a_surface_or_unseen_space_meets_none() {
    let wall = Plane::new([0.0, 0.0, 1.0], [0.0, 0.0, 3.0]);
    // Free space lies beyond: the camera looks at the back of the wall, from unseen space and from
    // within it.
    let volume = filled([-9, -7, 0], [9, 7, 12], true_distances(&wall));
    let mut caster = raycaster(6_000, &RaycastConfig::default());
    for z in [0.0, 2.3, 2.5, 2.9] {
        let report = caster.cast(&volume, &at([0.0; 3], [0.0, 0.0, z]), &Serial).unwrap();
        assert_eq!(report.pixels, 0, "from {z}");
    }
    let report = caster
        .cast(&volume, &at([0.0, core::f64::consts::PI, 0.0], [0.0, 0.0, 5.0]), &Serial)
        .unwrap();
    assert_eq!(report.pixels, 160 * 96, "while its face is seen");
}

#[test]
fn a_sheet_one_lattice_point_thick_stops_every_ray_at_every_angle() {
    // Behind the sheet the space is free again.
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
            // Where the ray meets the sheet within its extent.
            if world.z > 0.1 && x.abs() < 4.5 {
                let seen = f64::from(depth.get(u, 48).unwrap());
                assert!(
                    (seen - truth) * world.z < 0.05 && seen > 0.0,
                    "column {u}, delta {delta}: {seen} for {truth}"
                );
            }
        }
    }
}

#[test]
fn far_from_the_origin_the_picture_is_the_same() {
    let plane = Plane::new([0.4, 0.0, -0.9], [0.0, 0.0, 3.0]);
    let sample_at = true_distances(&plane);
    let mut pictures = Vec::new();
    // Coordinates of blocks have 16 bits: nearly as far as they go.
    for shift in [0, 32_000] {
        let mut volume = empty(&VolumeConfig::default(), 5_000);
        let moved = cuboid([-9, -7, 0], [9, 7, 12])
            .map(|c| BlockCoord::new(c.x.into(), c.y.into(), i32::from(c.z) - shift).unwrap());
        fill(&mut volume, moved, |[x, y, z]| sample_at([x, y, z + 8 * shift]));
        let mut caster = raycaster(6_000, &RaycastConfig::default());
        caster
            .cast(
                &volume,
                &at([0.05, 0.1, 0.0], [0.1, 0.2, 0.3 - f64::from(8 * shift) * f64::from(VOXEL_M)]),
                &Serial,
            )
            .unwrap();
        pictures.push(caster.depth_m.to_vec());
    }
    assert!(pictures[0].iter().filter(|&&depth| depth > 0.0).count() > 10_000);
    // In f64 the camera is far away, and rays are relative to it.
    let equal =
        pictures[0].iter().zip(&pictures[1]).filter(|(a, b)| (*a - *b).abs() < 1e-4).count();
    assert!(equal + 5 > pictures[0].len(), "{equal}");
}

#[test]
fn a_minimum_weight_hides_what_was_seen_less_often() {
    let near = Plane::new([0.0, 0.0, -1.0], [0.0, 0.0, 2.0]);
    let volume = filled([-9, -7, 0], [9, 7, 12], |point| {
        let far = Plane::new([0.0, 0.0, -1.0], [0.0, 0.0, 3.5]);
        true_distances(&near)(point)
            .map(|(sdf, _, colour)| (sdf, 2, colour))
            .or_else(|| true_distances(&far)(point))
    });
    for (min_weight, depth) in [(1, 2.0), (2, 2.0), (3, 3.5)] {
        let mut caster =
            raycaster(6_000, &RaycastConfig { min_weight, ..RaycastConfig::default() });
        caster.cast(&volume, &at([0.0; 3], [0.0; 3]), &Serial).unwrap();
        assert!((caster.depth_m().unwrap().get(80, 48).unwrap() - depth).abs() < 0.01);
    }
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

#[test]
fn without_space_for_all_blocks_the_range_is_shorter_and_reported() {
    let volume = rough(4);
    let view = at([0.0; 3], [0.0; 3]);
    let mut full = raycaster(6_000, &RaycastConfig::default());
    let all = full.cast(&volume, &view, &Serial).unwrap();
    assert_eq!((all.blocks_left_out, all.far_m), (0, 30.0));
    // Space for half of the blocks.
    let space = all.blocks_in_view as usize / 2;
    let mut small = raycaster(space, &RaycastConfig::default());
    let some = small.cast(&volume, &view, &Serial).unwrap();
    assert_eq!(some.blocks_in_view, all.blocks_in_view);
    assert!(
        some.blocks_left_out as usize >= space && some.far_m < 4.0 && some.far_m > 1.0,
        "{some:?}"
    );
    assert!(some.pixels > 0 && some.pixels < all.pixels);
    // What is shown is right: only what is farther is missing.
    for (full, some) in full.depth_m.iter().zip(small.depth_m.iter()) {
        assert!(*some == 0.0 || (full == some && *some <= 4.0));
    }
}

#[test]
fn refuses_unusable_viewpoints_and_shows_no_picture() {
    let volume = empty(&VolumeConfig::default(), 1);
    let mut caster = raycaster(10, &RaycastConfig::default());
    let good = at([0.0; 3], [0.0; 3]);
    // An empty map is no error, and shows nothing.
    assert_eq!(caster.cast(&volume, &good, &Serial).unwrap().pixels, 0);
    assert!(caster.depth_m().unwrap().rows().flatten().all(|&depth| depth == 0.0));
    // A pixel too wide, no pixel, and a size that overflows.
    for (width, height) in [(161, 96), (0, 96), (160, 0), (usize::MAX, 2)] {
        assert_eq!(
            caster.cast(&volume, &Viewpoint { width, height, ..good }, &Serial),
            Err(RaycastError::ImageSize)
        );
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
fn allocates_as_many_bytes_as_it_says() {
    for (_, capacity) in Capacity::PROFILES {
        let bytes = Raycaster::bytes(&capacity);
        let mut slab = vec![0u8; bytes + SLAB_ALIGN];
        let start = slab.as_ptr().align_offset(SLAB_ALIGN);
        let mut carver = Carver::new(&mut slab[start..], bytes).unwrap();
        Raycaster::new_in(&capacity, &RaycastConfig::default(), &mut carver);
        assert_eq!(carver.footprint().bytes(), bytes);
    }
}
