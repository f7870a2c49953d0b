//! Rectifying a KITTI raw pair: 1392 x 512 to 1242 x 375, both images, one thread.
//!
//! `cargo bench -p dynvox-core --bench rectify`

#![allow(clippy::expect_used)]

use criterion::{Criterion, criterion_group, criterion_main};
use dynvox_core::{
    Capacity, Serial,
    image::View,
    memory::{Carver, SLAB_ALIGN},
    random::Random,
    rectify::{
        Lens, LensModel, Pair, RawCamera, RawRig, Rectification, RectifiedImages, Rectifier, Sizing,
    },
};
use nalgebra::{Matrix3, Vector3};
use std::hint::black_box;

const CAPACITY: Capacity = Capacity { raw_width: 1_392, raw_height: 512, ..Capacity::ONBOARD };

fn raw_rig() -> RawRig {
    let radial = [-0.37, 0.2, -0.07, 0.0, 0.0, 0.0];
    let lens = Lens::new(
        [984.0, 981.0],
        [690.0, 233.0],
        LensModel::RadialTangential { radial, tangential: [2e-3, 1e-3] },
    );
    let camera = RawCamera { lens: lens.expect("a lens"), width: 1_392, height: 512 };
    RawRig {
        left: camera,
        right: camera,
        r_right_left: Matrix3::identity(),
        t_right_left_m: Vector3::new(-0.54, 0.005, -0.01),
    }
}

fn rectify(criterion: &mut Criterion) {
    let sizing = Sizing::Given { width: 1_242, height: 375, focal_px: Some(721.5) };
    let (rectification, rig) = Rectification::new(&raw_rig(), sizing).expect("a rig");
    let bytes = Rectifier::bytes(&CAPACITY) + RectifiedImages::bytes(&CAPACITY);
    let mut slab = vec![0u8; bytes + SLAB_ALIGN];
    let mut carver = Carver::new(&mut slab, bytes).expect("a slab");
    let mut rectifier = Rectifier::new_in(&CAPACITY, &mut carver);
    let mut images = RectifiedImages::new_in(&CAPACITY, &mut carver);
    rectifier.prepare(&rectification, &rig).expect("it fits");
    // Noise: remapping takes the same time for any image.
    let mut random = Random::new(1);
    let mut noise = || -> Vec<u8> { (0..1_392 * 512).map(|_| random.below(256) as u8).collect() };
    let (left, right) = (noise(), noise());
    let colour: Vec<[u8; 3]> = left.iter().map(|&grey| [grey, grey / 2, 255 - grey]).collect();
    let view = |pixels| View::new(pixels, 1_392, 512).expect("a view");
    let grey = Pair { left: view(&left), right: view(&right), colour: None };
    let with_colour = Pair { colour: View::new(&colour, 1_392, 512), ..grey };
    let mut group = criterion.benchmark_group("rectify");
    for (name, pair) in [("grey pair", grey), ("grey pair and colour", with_colour)] {
        group.bench_function(name, |bencher| {
            bencher.iter(|| black_box(rectifier.rectify(&pair, &mut images, &Serial).is_some()))
        });
    }
    // Once for each calibration, not for each frame.
    group.bench_function("maps, once", |bencher| {
        bencher.iter(|| rectifier.prepare(&rectification, &rig))
    });
    group.finish();
}

criterion_group!(benches, rectify);
criterion_main!(benches);
