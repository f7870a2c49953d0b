//! Time of scene flow and egomotion at KITTI size, on the first frames of odometry 06 where they
//! are there, else on smooth noise that moves alike.
//!
//! `cargo bench -p dynvox-core --bench scene_flow`
#![allow(missing_docs, reason = "criterion's macros write functions without")]
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "a bench may fail")]

use criterion::{Criterion, criterion_group, criterion_main};
use dynvox_core::{
    Capacity, Serial,
    egomotion::{EgomotionConfig, Estimator, MotionHypotheses},
    geometry::StereoRig,
    image::View,
    memory::Carver,
    random::Random,
    scene_flow::{FlowMatcher, SceneFlowConfig},
};
use std::{hint::black_box, path::Path};

const RIG: StereoRig = StereoRig {
    focal_px: 707.0912,
    center_u_px: 601.8873,
    center_v_px: 183.1104,
    baseline_m: 0.537_151,
};

struct Picture {
    pixels: Vec<u8>,
    width: usize,
    height: usize,
}

impl Picture {
    fn view(&self) -> View<'_, u8> {
        View::new(&self.pixels, self.width, self.height).unwrap()
    }
}

/// Two stereo pairs.
fn pairs() -> [[Picture; 2]; 2] {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let clip = std::env::var_os("DYNVOX_DATA")
        .map_or_else(beside, Into::into)
        .join("kitti-odometry/sequences/06");
    [0, 1].map(|frame| {
        [0, 1].map(|camera| {
            read(&clip, frame, camera).unwrap_or_else(|| noise(8 * frame + 20 * camera))
        })
    })
}

fn read(clip: &Path, frame: usize, camera: usize) -> Option<Picture> {
    let picture =
        image::open(clip.join(format!("image_{camera}/{frame:06}.png"))).ok()?.into_luma8();
    let (width, height) = picture.dimensions();
    Some(Picture { pixels: picture.into_raw(), width: width as usize, height: height as usize })
}

/// Noise averaged over 3 x 3 px, `shift` columns to the left.
fn noise(shift: usize) -> Picture {
    let (width, height, wide) = (1226, 370, 1300);
    let mut random = Random::new(1);
    let raw: Vec<u32> = (0..wide * (height + 2)).map(|_| random.below(256)).collect();
    let mean = |u: usize, v: usize| {
        (0..9).map(|i| raw[(v + i / 3) * wide + u + shift + i % 3]).sum::<u32>() / 9
    };
    let pixels = (0..width * height).map(|i| mean(i % width, i / width) as u8).collect();
    Picture { pixels, width, height }
}

fn bench(criterion: &mut Criterion) {
    let capacity = Capacity::ONBOARD;
    let bytes = FlowMatcher::bytes(&capacity) + Estimator::bytes(&capacity);
    let mut slab = vec![[0u64; 8]; bytes / 64 + 1];
    let slab: &mut [u8] = bytemuck::cast_slice_mut(&mut slab);
    let lead = slab.as_ptr().align_offset(64);
    let mut carver = Carver::new(&mut slab[lead..], bytes).unwrap();
    let mut matcher = FlowMatcher::new_in(&capacity, &mut carver);
    let mut estimator = Estimator::new_in(&capacity, &mut carver);
    let [before, after] = pairs();
    let config = SceneFlowConfig::default();

    // From rest: features only, no matches.
    criterion.bench_function("scene_flow/features of a pair", |bencher| {
        bencher.iter(|| {
            matcher.reset();
            black_box(matcher.push(&config, before[0].view(), before[1].view(), &Serial))
        });
    });
    for (name, refine) in
        [("scene_flow/frame without refinement", false), ("scene_flow/frame", true)]
    {
        let config = SceneFlowConfig { refine, ..config };
        // The two pairs take turns, so that every frame has one before it.
        let mut odd = false;
        criterion.bench_function(name, |bencher| {
            bencher.iter(|| {
                odd = !odd;
                let pair = if odd { &after } else { &before };
                black_box(matcher.push(&config, pair[0].view(), pair[1].view(), &Serial))
            });
        });
    }
    // Egomotion works on the matches of one frame.
    matcher.reset();
    for pair in [&before, &after] {
        matcher.push(&config, pair[0].view(), pair[1].view(), &Serial);
    }
    criterion.bench_function("egomotion/estimate", |bencher| {
        let config = EgomotionConfig::default();
        bencher.iter(|| {
            black_box(estimator.estimate(
                &config,
                &RIG,
                matcher.bucketed(),
                MotionHypotheses::from_draws(&mut Random::new(1)),
            ))
        });
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = bench
}
criterion_main!(benches);
