//! The stereo matcher at KITTI size on one thread: the whole, and each of its steps.
//!
//! On a synthetic textured pair, and on the first pair of KITTI odometry 06 where the clips are
//! (folder `DYNVOX_DATA`, else `../shared/data` beside the checkout). Steps are timed from within
//! whole runs, so their caches are as warm as they are at work.
#![allow(missing_docs, clippy::unwrap_used, clippy::indexing_slicing)]

use criterion::{Criterion, criterion_group, criterion_main};
use dynvox_core::{
    Capacity, Serial,
    image::View,
    memory::{Carver, SLAB_ALIGN},
    random::Random,
    stereo::{StereoConfig, StereoMatcher, StereoStep},
};
use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

struct Pair {
    name: &'static str,
    width: usize,
    height: usize,
    left: Vec<u8>,
    right: Vec<u8>,
}

/// A wall of smoothed noise at 12 px over a road that comes nearer, up to 90 px, with pillars in
/// front.
fn synthetic() -> Pair {
    let (width, height) = (1242, 375);
    let mut random = Random::new(1);
    let mut texture = || -> Vec<f32> {
        // Smoothed noise: every place is unlike its neighbours, at all scales.
        let noise: Vec<f32> =
            (0..(width + 256) * height).map(|_| random.below(256) as f32).collect();
        (0..noise.len())
            .map(|i| {
                (0..9).filter_map(|k| noise.get(i + k % 3 + k / 3 * (width + 256))).sum::<f32>()
                    / 9.0
            })
            .collect()
    };
    let (far, near) = (texture(), texture());
    let render = |shift: f32| -> Vec<u8> {
        let at = |texture: &[f32], u: f32, v: usize| {
            let (i, f) = (u as usize, u.fract());
            texture[v * (width + 256) + i] * (1.0 - f) + texture[v * (width + 256) + i + 1] * f
        };
        let pixel = |i: usize| {
            let (u, v) = ((i % width) as f32, i / width);
            // Disparity grows down the road; pillars stand in front of what is farther.
            let ground = 12.0 + 78.0 * v.saturating_sub(180) as f32 / 195.0;
            let pillar = (v > 60 && (u + shift * 40.0) % 300.0 < 40.0).then_some(40.0);
            let (texture, disparity) =
                pillar.filter(|&d| d > ground).map_or((&far, ground), |d| (&near, d));
            at(texture, u + shift * disparity, v) as u8
        };
        (0..width * height).map(pixel).collect()
    };
    Pair { name: "synthetic", width, height, left: render(0.0), right: render(1.0) }
}

fn kitti() -> Option<Pair> {
    // A real pair, where the data set is there.
    let data = std::env::var_os("DYNVOX_DATA").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data")),
        PathBuf::from,
    );
    let image = |folder: &str| {
        image::open(data.join("kitti-odometry/sequences/06").join(folder).join("000000.png")).ok()
    };
    let (left, right) = (image("image_0")?.into_luma8(), image("image_1")?.into_luma8());
    Some(Pair {
        name: "kitti_06",
        width: left.width() as usize,
        height: left.height() as usize,
        left: left.into_raw(),
        right: right.into_raw(),
    })
}

fn stereo(criterion: &mut Criterion) {
    let capacity = Capacity::ONBOARD;
    let mut memory = vec![0u64; StereoMatcher::bytes(&capacity) / 8 + 16];
    let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut memory);
    let skip = bytes.as_ptr().align_offset(SLAB_ALIGN);
    let mut carver = Carver::new(&mut bytes[skip..], StereoMatcher::bytes(&capacity)).unwrap();
    let mut matcher = StereoMatcher::new_in(&capacity, &mut carver);
    let config = StereoConfig::dynslam();
    for pair in [Some(synthetic()), kitti()].into_iter().flatten() {
        let left = View::new(&pair.left, pair.width, pair.height).unwrap();
        let right = View::new(&pair.right, pair.width, pair.height).unwrap();
        let mut group = criterion.benchmark_group(format!("stereo/{}", pair.name));
        // Few samples: a whole match takes tens of milliseconds.
        group
            .sample_size(20)
            .measurement_time(Duration::from_secs(4))
            .warm_up_time(Duration::from_millis(500));
        group.bench_function("whole", |bencher| {
            bencher.iter(|| matcher.compute(&config, left, right, &Serial))
        });
        group.measurement_time(Duration::from_secs(2)).sample_size(10);
        for step in StereoStep::ALL {
            group.bench_function(step.name(), |bencher| {
                bencher.iter_custom(|times| {
                    let mut spent = Duration::ZERO;
                    for _ in 0..times {
                        let mut last = Instant::now();
                        // The matcher tells when a step ends: the time since the step before is
                        // that step's.
                        matcher.compute_observed(&config, [left, right], &Serial, |done| {
                            let now = Instant::now();
                            if done == step {
                                spent += now - last;
                            }
                            last = now;
                        });
                    }
                    spent
                });
            });
        }
        group.finish();
    }
}

criterion_group!(benches, stereo);
criterion_main!(benches);
