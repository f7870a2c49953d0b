//! A camera that drives round a block twice while its pose drifts.

use super::eviction::MemoryStore;
use super::*;
use crate::state::{Reader, Writer};
use crate::view::{MeshConfig, Triangle};
use crate::volume::submaps::SubmapCamera;
use core::{f64::consts::FRAC_PI_2, ops::Range};

const WITH_SUBMAPS: Capacity = Capacity { blocks: 12_000, keyframes: 40, ..CAPACITY };
/// Way along a side of the block, and distance from there to the walls across the street, m.
const SIDE_M: f64 = 25.0;
const STREET_M: f64 = 5.0;
const WALL_M: f64 = SIDE_M / 2.0 + STREET_M;
const STEP_M: f64 = 1.25;
const FRAMES_A_LAP: u32 = (4.0 * SIDE_M / STEP_M) as u32;

fn config() -> VolumeConfig {
    VolumeConfig {
        voxel_size_m: 0.1,
        truncation_m: 0.4,
        prune_weight: 0,
        far_m: 12.0,
        ..VolumeConfig::default()
    }
}

/// Pose of the camera in a frame: it looks at the wall across the street.
fn driven_truly(frame: u32) -> Transform {
    let way_m = STEP_M * f64::from(frame % FRAMES_A_LAP);
    let side = libm::floor(way_m / SIDE_M);
    let along_m = way_m - side * SIDE_M - SIDE_M / 2.0;
    Transform::new([0.0, side * FRAC_PI_2, 0.0], [0.0; 3])
        * Transform::from_translation([along_m, 0.0, SIDE_M / 2.0])
}

/// Error of the pose by a frame: 1 % of the way, and a turn.
fn pose_error(frame: u32) -> Transform {
    let way_m = STEP_M * f64::from(frame);
    Transform::new([0.0, 0.000_2 * way_m, 0.0], [0.008 * way_m, 0.0, 0.005 * way_m])
}

/// Depths of the four walls as they are, m.
fn walls(t_world_camera: &Transform) -> Vec<f32> {
    let from = t_world_camera.translation_m;
    let depth_m = |i: usize| {
        let ray = [
            ((i % WIDTH) as f64 - RIG.center_u_px) / RIG.focal_px,
            ((i / WIDTH) as f64 - RIG.center_v_px) / RIG.focal_px,
            1.0,
        ];
        let ray: [f64; 3] = t_world_camera.rotate(ray);
        let walls = [(0, WALL_M), (0, -WALL_M), (2, WALL_M), (2, -WALL_M)];
        let depths = walls.map(|(axis, wall_m)| (wall_m - from[axis]) / ray[axis]);
        depths.into_iter().filter(|depth| *depth > 0.0).min_by(f64::total_cmp).unwrap_or(f64::MAX)
            as f32
    };
    (0..WIDTH * HEIGHT).map(depth_m).collect()
}

/// Fuses one frame with the error of its pose.
fn step(volume: &mut Volume<'_>, frame: u32, store: &mut impl BlockStore) -> AllocationReport {
    let (truth, grey) = (driven_truly(frame), vec![120; WIDTH * HEIGHT]);
    let depth_m = walls(&truth);
    let view = Viewpoint { t_world_camera: pose_error(frame) * truth, ..view([0.0; 3], [0.0; 3]) };
    volume.advance_submaps(&SubmapCamera {
        frame,
        t_world_camera: &view.t_world_camera,
        t_closed_driven: Transform::IDENTITY,
    });
    let seen = observation(&depth_m, &grey);
    let report = volume.allocate(&view, seen.depth.depth_m(), store, &Serial);
    volume.fuse(&view, seen, &Serial);
    report
}

fn run_through(volume: &mut Volume<'_>, frames: Range<u32>) {
    for frame in frames {
        assert_eq!(step(volume, frame, &mut NoStore).refused, 0);
    }
}

/// Distances at which a ray from the middle of the block meets triangles, m.
fn hits_m(triangles: &[Triangle], angle_rad: f64) -> Vec<f64> {
    let ray = Vector3::new(libm::sin(angle_rad), 0.011, libm::cos(angle_rad));
    let hit = |triangle: &Triangle| {
        let [a, b, c] =
            triangle.vertices.map(|vertex| Vector3::from(vertex.position_m.map(f64::from)));
        let (ab, ac) = (b - a, c - a);
        let across = ray.cross(&ac);
        let det = ab.dot(&across);
        let u = -a.dot(&across) / det;
        let q = (-a).cross(&ab);
        let (v, t) = (ray.dot(&q) / det, ac.dot(&q) / det);
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
    };
    triangles.iter().filter_map(hit).collect()
}

/// Walls that rays in all directions meet: mean number, share of those that meet one, and the
/// largest distance from where the wall is, m.
fn met(triangles: &[Triangle]) -> (f64, f64, f64) {
    const RAYS: u32 = 180;
    let (mut number, mut single, mut worst_m) = (0, 0, 0.0);
    for ray in 0..RAYS {
        // Not into the corners, which the camera never sees.
        let side = f64::from(ray % 4) * FRAC_PI_2;
        let angle_rad =
            side + 0.7 * (f64::from(ray) + 0.3 - f64::from(RAYS / 2)) * 2.0 / f64::from(RAYS);
        let hits = hits_m(triangles, angle_rad);
        let facing = [libm::sin(angle_rad), libm::cos(angle_rad)]
            .map(f64::abs)
            .into_iter()
            .max_by(f64::total_cmp)
            .unwrap();
        for hit_m in &hits {
            let off_m = (hit_m * facing - WALL_M).abs();
            if off_m > worst_m {
                worst_m = off_m;
            }
        }
        number += hits.len();
        single += u32::from(hits.len() == 1);
    }
    (number as f64 / f64::from(RAYS), f64::from(single) / f64::from(RAYS), worst_m)
}

fn closed(volume: &Volume<'_>) -> Vec<Triangle> {
    let mut triangles = Vec::new();
    let config = MeshConfig::default();
    volume.closed_mesh(&config, volume.segment(), &mut |triangle| triangles.push(triangle));
    triangles
}

fn as_driven(volume: &Volume<'_>) -> Vec<Triangle> {
    let mut triangles = Vec::new();
    volume.mesh(&MeshConfig::default(), |_| true, &mut |triangle| triangles.push(triangle));
    triangles
}

#[test]
fn walls_driven_past_twice_are_single_after_the_loop() {
    let mut doubled = 0.0;
    with_volume(&Capacity { keyframes: 0, ..WITH_SUBMAPS }, &config(), |volume| {
        run_through(volume, 0..2 * FRAMES_A_LAP);
        doubled = met(&as_driven(volume)).0;
    });
    assert!(doubled > 1.4, "{doubled} walls where there is one");
    with_volume(&WITH_SUBMAPS, &config(), |volume| {
        run_through(volume, 0..FRAMES_A_LAP);
        assert_eq!(volume.archived(), 0, "the camera has not come back yet");
        run_through(volume, FRAMES_A_LAP..2 * FRAMES_A_LAP);
        assert!(volume.archived() > 100, "{} blocks", volume.archived());
        let (before, ..) = met(&as_driven(volume));
        volume.close(|_, frame| Some(pose_error(frame).inverse()));
        let (number, single, worst_m) = met(&closed(volume));
        assert!(before > 1.4, "{before} walls before the loop is closed");
        assert!(single > 0.9 && (number - 1.0).abs() < 0.05, "{number} walls, {single} single");
        assert!(worst_m < 0.25, "{worst_m} m");
    });
}

#[test]
fn a_map_without_a_return_is_meshed_to_the_bit_as_without_submaps() {
    let mut meshes = [0, 40].map(|keyframes| {
        let mut found = None;
        with_volume(&Capacity { keyframes, ..WITH_SUBMAPS }, &config(), |volume| {
            run_through(volume, 0..FRAMES_A_LAP * 3 / 4);
            found = Some((closed(volume), volume.digest(), volume.pool().len()));
        });
        found.unwrap()
    });
    assert!(meshes[0].0.len() > 1_000);
    let [without, with] = &mut meshes;
    assert!(without == with);
}

#[test]
fn a_full_pool_hands_archived_blocks_to_the_store_by_their_submap() {
    let mut store = MemoryStore::default();
    let mut lap = 0;
    with_volume(&WITH_SUBMAPS, &config(), |volume| {
        run_through(volume, 0..FRAMES_A_LAP);
        lap = volume.pool.len();
    });
    // Space for one lap, and little more.
    with_volume(&Capacity { blocks: lap + 60, ..WITH_SUBMAPS }, &config(), |volume| {
        let mut refused = 0;
        for frame in 0..2 * FRAMES_A_LAP {
            refused += step(volume, frame, &mut store).refused;
            assert_eq!(volume.pool.len(), volume.index.len());
        }
        assert_eq!(refused, 0);
        let archived = store.blocks.keys().filter(|key| key.segment.archived_submap().is_some());
        let (archived, all) = (archived.count(), store.blocks.len());
        assert!(archived > 100 && archived < all, "{archived} of {all} blocks");
        volume.stream_out(&mut store);
        assert_eq!((volume.pool.len(), volume.digest()), (0, 0));
    });
}

#[test]
fn a_snapshot_holds_the_submaps_and_the_blocks_that_were_come_back_to() {
    let go_on = |volume: &mut Volume<'_>, from: u32| {
        run_through(volume, from..FRAMES_A_LAP + 30);
        (volume.digest(), volume.archived(), closed(volume).len())
    };
    // Just before the camera comes back, and after it has.
    for stop in [FRAMES_A_LAP, FRAMES_A_LAP + 12] {
        let (mut bytes, mut expected) = (Vec::new(), None);
        with_volume(&WITH_SUBMAPS, &config(), |volume| {
            run_through(volume, 0..stop);
            let mut sink = |piece: &[u8]| {
                bytes.extend_from_slice(piece);
                Ok::<(), ()>(())
            };
            let mut writer = Writer::new(&mut sink);
            volume.visit(&mut writer);
            writer.finish().unwrap();
            assert_eq!(volume.archived() > 0, stop > FRAMES_A_LAP);
            expected = Some(go_on(volume, stop));
        });
        with_volume(&WITH_SUBMAPS, &config(), |volume| {
            let mut rest = &bytes[..];
            let mut source =
                |piece: &mut [u8]| crate::state::in_memory::take(&mut rest, piece).ok_or(());
            let mut reader = Reader::new(&mut source);
            volume.visit(&mut reader);
            assert_eq!(reader.finish().err(), None);
            assert!(volume.rebuild());
            assert_eq!(Some(go_on(volume, stop)), expected);
        });
        assert!(expected.unwrap().1 > 0);
    }
}
