//! Pruning, per 10,000 blocks visited, at `onboard`'s block layout (with colour): blocks without a
//! voxel of low weight, blocks with some voxels go, and blocks that go as a whole. CPU time of one
//! thread.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    missing_docs,
    reason = "a bench may stop at what it does not expect"
)]

use cpu_time::ThreadTime;
use criterion::{Criterion, criterion_group, criterion_main};
use dynvox_core::{
    Capacity, Serial,
    geometry::{StereoRig, Transform},
    image::View,
    memory::Carver,
    volume::{DepthImage, NoStore, Observation, Viewpoint, Volume, VolumeConfig},
};
use nalgebra::Vector3;
use std::time::Duration;

const WIDTH: usize = 620;
const HEIGHT: usize = 188;

/// A road between two walls; `shift_m` moves the walls, as noise would.
fn canyon(shift_m: f32) -> Vec<f32> {
    (0..WIDTH * HEIGHT)
        .map(|i| {
            let (x, y) =
                (((i % WIDTH) as f32 - 300.0) / 354.0, ((i / WIDTH) as f32 - 91.0) / 354.0);
            let road = if y > 0.0 { 1.65 / y } else { 99.0 };
            let wall = (if x > 0.0 { 6.0 / x } else { -8.0 / x }) + shift_m;
            let nearest = if road < wall { road } else { wall };
            if nearest > 0.5 && nearest < 20.0 { nearest } else { 0.0 }
        })
        .collect()
}

fn bench(criterion: &mut Criterion) {
    let capacity = Capacity { blocks: 40_000, visible_blocks: 40_000, ..Capacity::ONBOARD };
    let rig =
        StereoRig { focal_px: 354.0, center_u_px: 300.0, center_v_px: 91.0, baseline_m: 0.54 };
    let view = Viewpoint {
        rig,
        width: WIDTH,
        height: HEIGHT,
        t_world_camera: Transform::new(Vector3::zeros(), Vector3::zeros()),
    };
    let bytes = Volume::bytes(&capacity);
    let mut slab = vec![0u8; bytes + 64];
    let start = slab.as_ptr().align_offset(64);
    // Voxels small enough that one view holds more than 10,000 blocks.
    let config = VolumeConfig { voxel_size_m: 0.03, ..VolumeConfig::default() };
    let mut volume =
        Volume::new_in(&capacity, &config, &mut Carver::new(&mut slab[start..], bytes).unwrap());
    let grey = vec![128; WIDTH * HEIGHT];
    let fuse = |volume: &mut Volume<'_>, shift_m: f32| {
        let depth_m = canyon(shift_m);
        let depth_m = View::new(&depth_m, WIDTH, HEIGHT).unwrap();
        volume.allocate(&view, depth_m, &mut NoStore, &Serial);
        let seen = Observation {
            depth: DepthImage::Plain(depth_m),
            grey: View::new(&grey, WIDTH, HEIGHT).unwrap(),
            colour: None,
            class: None,
        };
        volume.fuse(&view, seen, &Serial);
    };
    // Shifts of the walls fused before each pruning; what only one frame saw goes.
    for (name, shifts) in [
        ("no_low_weight", &[0.0, 0.0][..]),
        ("some_low_weight", &[0.0, 0.0, 0.8]),
        ("all_freed", &[0.0]),
    ] {
        criterion.bench_function(&format!("prune_10000_blocks/{name}"), |bencher| {
            bencher.iter_custom(|iterations| {
                // Fusion refills the volume between two prunings and is not measured.
                let mut spent = Duration::ZERO;
                for _ in 0..iterations {
                    shifts.iter().for_each(|&shift_m| fuse(&mut volume, shift_m));
                    let begin = ThreadTime::now();
                    let report = volume.prune_whole(1);
                    // Scaled to 10,000 blocks, however many there were.
                    spent += begin.elapsed() * 10_000 / report.visited.max(1);
                    assert!(
                        report.visited > 10_000
                            && (report.voxels_reset > 0) == (name != "no_low_weight"),
                        "{report:?}"
                    );
                    // Back to an empty volume.
                    volume.prune_whole(u8::MAX);
                }
                spent
            });
        });
    }
}

criterion_group! { name = benches; config = Criterion::default().sample_size(20); targets = bench }
criterion_main!(benches);
