//! Allocation and fusion at KITTI size: 5 cm, truncation 0.75 m, 20 m, colour. On odometry 06 with
//! given disparities and true poses where the clip is there (`DYNVOX_DATA`, else `../shared/data`),
//! else on a plain synthetic street canyon.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    missing_docs,
    reason = "a bench may stop at what it does not expect"
)]

use criterion::{Criterion, criterion_group, criterion_main};
use dynvox_core::{
    Capacity, Serial,
    geometry::{StereoRig, Transform, depth_from_disparity},
    image::{View, ViewMut},
    memory::Carver,
    volume::{DepthImage, NoStore, Observation, Viewpoint, Volume, VolumeConfig},
};
use nalgebra::Vector3;
use std::path::PathBuf;

struct Frame {
    depth_m: Vec<f32>,
    grey: Vec<u8>,
    view: Viewpoint,
}

fn data() -> PathBuf {
    std::env::var_os("DYNVOX_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"),
        PathBuf::from,
    )
}

fn kitti() -> Option<Vec<Frame>> {
    let root = data().join("kitti-odometry");
    let poses = std::fs::read_to_string(root.join("poses/06.txt")).ok()?;
    let rig = StereoRig {
        focal_px: 707.0912,
        center_u_px: 601.8873,
        center_v_px: 183.1104,
        baseline_m: 379.8145 / 707.0912,
    };
    let mut frames = Vec::new();
    // As long as there are disparities: the clip may be shorter than the list of poses.
    for (i, line) in poses.lines().enumerate() {
        let disparity = image::open(root.join(format!("sequences/06/disp_elas/{i:06}.png")))
            .ok()?
            .into_luma16();
        let grey =
            image::open(root.join(format!("sequences/06/image_0/{i:06}.png"))).ok()?.into_luma8();
        let (width, height) = (disparity.width() as usize, disparity.height() as usize);
        let p: Vec<f64> = line.split_whitespace().map(|word| word.parse().unwrap()).collect();
        let rotation = [[p[0], p[1], p[2]], [p[4], p[5], p[6]], [p[8], p[9], p[10]]];
        let t_world_camera = Transform::from_rotation_matrix(&rotation, [p[3], p[7], p[11]]);
        let mut depth_m = vec![0.0; width * height];
        let disparity = View::new(disparity.as_raw(), width, height)?;
        depth_from_disparity(
            &rig,
            0.5,
            20.0,
            disparity,
            &mut ViewMut::new(&mut depth_m, width, height)?,
        );
        frames.push(Frame {
            depth_m,
            grey: grey.into_raw(),
            view: Viewpoint { rig, width, height, t_world_camera },
        });
    }
    Some(frames)
}

/// A road between two walls, driven along.
fn canyon() -> Vec<Frame> {
    let rig =
        StereoRig { focal_px: 707.0, center_u_px: 601.0, center_v_px: 183.0, baseline_m: 0.54 };
    let (width, height) = (1226, 370);
    // A road below and a wall on either side, out to 20 m.
    let mut depth_m = vec![0.0; width * height];
    for (i, depth) in depth_m.iter_mut().enumerate() {
        let (x, y) = (((i % width) as f32 - 601.0) / 707.0, ((i / width) as f32 - 183.0) / 707.0);
        let road = if y > 0.0 { 1.65 / y } else { 99.0 };
        let wall = if x > 0.0 { 6.0 / x } else { -8.0 / x };
        let nearest = if road < wall { road } else { wall };
        *depth = if nearest < 20.0 { nearest } else { 0.0 };
    }
    let view = |z| Viewpoint {
        rig,
        width,
        height,
        t_world_camera: Transform::new(Vector3::zeros(), Vector3::new(0.0, 0.0, z)),
    };
    (0..20)
        .map(|i| Frame {
            depth_m: depth_m.clone(),
            grey: vec![128; width * height],
            view: view(f64::from(i)),
        })
        .collect()
}

fn bench(criterion: &mut Criterion) {
    // KITTI where it is there, else a canyon.
    let frames = kitti().unwrap_or_else(canyon);
    let capacity = Capacity { blocks: 120_000, ..Capacity::ONBOARD };
    let config = VolumeConfig::default();
    let bytes = Volume::bytes(&capacity);
    let mut slab = vec![0u8; bytes + 64];
    let start = slab.as_ptr().align_offset(64);
    let mut volume =
        Volume::new_in(&capacity, &config, &mut Carver::new(&mut slab[start..], bytes).unwrap());

    let mut bench = |criterion: &mut Criterion, name: &str, only_fuse: bool| {
        let mut at = 0;
        criterion.bench_function(name, |bencher| {
            bencher.iter_custom(|iterations| {
                let mut spent = std::time::Duration::ZERO;
                for _ in 0..iterations {
                    let frame = &frames[at % frames.len()];
                    at += 1;
                    let depth_m =
                        View::new(&frame.depth_m, frame.view.width, frame.view.height).unwrap();
                    let grey = View::new(&frame.grey, frame.view.width, frame.view.height).unwrap();
                    let seen = Observation {
                        depth: DepthImage::Plain(depth_m),
                        grey,
                        colour: None,
                        class: None,
                    };
                    let begin = std::time::Instant::now();
                    volume.allocate(&frame.view, depth_m, &mut NoStore, &Serial);
                    let middle = std::time::Instant::now();
                    volume.fuse(&frame.view, seen, &Serial);
                    spent += if only_fuse { middle.elapsed() } else { middle - begin };
                }
                spent
            });
        });
    };
    bench(criterion, "allocate", false);
    bench(criterion, "fuse", true);
    println!(
        "blocks {}, visible in the last frame {}",
        volume.pool().len(),
        volume.visible().slots().len()
    );
}

criterion_group! { name = benches; config = Criterion::default().sample_size(20); targets = bench }
criterion_main!(benches);
