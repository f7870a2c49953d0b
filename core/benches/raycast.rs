//! Looking at and meshing a street of some 60,000 blocks at KITTI size: 5 cm, truncation 0.75 m,
//! colour. The street (a road, two facades with recesses, parked cars) is seen by a camera that
//! drives along it and fused from exact depth, so no data set is needed.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::disallowed_methods,
    missing_docs,
    reason = "a bench may stop at what it does not expect"
)]

use criterion::{Criterion, criterion_group, criterion_main};
use dynvox_core::{
    Capacity, Serial,
    geometry::{StereoRig, Transform},
    image::View,
    memory::Carver,
    view::{MeshConfig, RaycastConfig, Raycaster},
    volume::{DepthImage, NoStore, Observation, Viewpoint, Volume, VolumeConfig},
};
use nalgebra::Vector3;

const WIDTH: usize = 1242;
const HEIGHT: usize = 375;
const RIG: StereoRig =
    StereoRig { focal_px: 721.5, center_u_px: 609.6, center_v_px: 172.9, baseline_m: 0.54 };
const FRAMES: usize = 60;
/// Way from frame to frame, m.
const STEP_M: f64 = 1.7;

/// Nearest depth along (x, y, 1) from the camera at height 1.65 m and `z` along the street.
fn depth(x: f64, y: f64, z: f64) -> f64 {
    let mut nearest = if y > 0.0 { 1.65 / y } else { f64::INFINITY };
    let mut meet = |depth: f64, holds: bool| {
        if holds && depth > 0.0 && depth < nearest {
            nearest = depth;
        }
    };
    // Facades 9 m to the left and 8 m to the right, every other 3 m set back by 40 cm.
    for (side, distance) in [(-1.0, 9.0), (1.0, 8.0)] {
        for back in [0.0, 0.4] {
            let at = (distance + back) / (side * x);
            let bay = ((z + at) / 3.0).floor() as i64 % 2 == 0;
            meet(at, side * x > 0.0 && bay == (back == 0.0));
        }
    }
    // Cars 4.2 m long, 1.75 m wide and 1.45 m high, parked every 7 m on both sides.
    for car in 0..18 {
        let front = f64::from(car) * 7.0 + 4.0 - z;
        for (near, far) in [(3.0, 4.75), (-5.5, -3.75)] {
            let slab = |low: f64, high: f64, slope: f64| {
                let (a, b) = (low / slope, high / slope);
                if a < b { (a, b) } else { (b, a) }
            };
            // The slabs' entry and exit along the ray.
            let (x_in, x_out) = slab(near, far, x);
            let (y_in, y_out) = slab(0.2, 1.65, y);
            let enter = x_in.max(y_in).max(front);
            meet(enter, enter < x_out.min(y_out).min(front + 4.2));
        }
    }
    nearest
}

fn view(frame: usize) -> Viewpoint {
    let yaw_rad = 0.05 * (frame as f64 * 0.2).sin();
    let t_world_camera = Transform::new(
        Vector3::new(0.0, yaw_rad, 0.0),
        Vector3::new(0.0, 0.0, frame as f64 * STEP_M),
    );
    Viewpoint { rig: RIG, width: WIDTH, height: HEIGHT, t_world_camera }
}

fn fill(volume: &mut Volume<'_>) {
    let mut depth_m = vec![0.0f32; WIDTH * HEIGHT];
    let mut grey = vec![0u8; WIDTH * HEIGHT];
    for frame in 0..FRAMES {
        let view = view(frame);
        for (at, (depth_m, grey)) in depth_m.iter_mut().zip(&mut grey).enumerate() {
            let (u, v) = ((at % WIDTH) as f64, (at / WIDTH) as f64);
            let ray = Vector3::new(
                (u - RIG.center_u_px) / RIG.focal_px,
                (v - RIG.center_v_px) / RIG.focal_px,
                1.0,
            );
            let world = view.t_world_camera.rotate(ray);
            // Depth in the camera is depth along the street over the ray's share of it.
            let met = depth(world.x / world.z, world.y / world.z, frame as f64 * STEP_M) / world.z;
            *depth_m = if met < 20.0 { met as f32 } else { 0.0 };
            *grey = 40 + (at % 200) as u8;
        }
        let depth_m = View::new(&depth_m, WIDTH, HEIGHT).unwrap();
        volume.allocate(&view, depth_m, &mut NoStore, &Serial);
        volume.fuse(
            &view,
            Observation {
                depth: DepthImage::Plain(depth_m),
                grey: View::new(&grey, WIDTH, HEIGHT).unwrap(),
                colour: None,
                class: None,
            },
            &Serial,
        );
    }
}

fn bench(criterion: &mut Criterion) {
    let capacity = Capacity { blocks: 120_000, ..Capacity::ONBOARD };
    let bytes = Volume::bytes(&capacity) + Raycaster::bytes(&capacity);
    let mut slab = vec![0u8; bytes + 64];
    let start = slab.as_ptr().align_offset(64);
    let mut carver = Carver::new(&mut slab[start..], bytes).unwrap();
    let mut volume = Volume::new_in(&capacity, &VolumeConfig::default(), &mut carver);
    let mut caster = Raycaster::new_in(&capacity, &RaycastConfig::default(), &mut carver);
    fill(&mut volume);

    // A step of seven frames: the picture before is of no help.
    let mut at = 0;
    criterion.bench_function("raycast", |bencher| {
        bencher.iter(|| {
            at = (at + 7) % FRAMES;
            caster.cast(&volume, &view(at), &Serial).unwrap()
        });
    });
    let mut triangles = 0;
    // The sum keeps the mesh from being optimised away.
    criterion.bench_function("triangles", |bencher| {
        bencher.iter(|| {
            let mut sum = 0.0;
            triangles = volume.triangles(&MeshConfig::default(), &mut |triangle| {
                sum += triangle.vertices[0].position_m[0]
            });
            sum
        });
    });
    println!(
        "{} blocks, {triangles} triangles, last picture: {:?}",
        volume.pool().len(),
        caster.cast(&volume, &view(30), &Serial).unwrap()
    );
}

criterion_group! { name = benches; config = Criterion::default().sample_size(20); targets = bench }
criterion_main!(benches);
