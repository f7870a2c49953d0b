//! Cost of objects in a frame of KITTI's size on one thread: CPU time of the stages `instances` and
//! `segmentation` and of the whole step, with 0, 1, 4 and 8 cars detected in the same pictures. A
//! street of textured boxes is rendered from a camera in motion; the cars map_frames along with it,
//! 8 to 15 m away, so that in every frame measured every car detected is tracked, followed by its
//! own matches and fused (the bench fails where one is not). Poses are given: undetected cars must
//! not lead the camera astray.
//!
//! `cargo bench -p dynvox-core --bench instances`
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::disallowed_methods,
    missing_docs,
    reason = "a bench may stop at what it does not expect"
)]

use cpu_time::ThreadTime;
use criterion::{Criterion, criterion_group, criterion_main};
use dynvox_core::{
    Capacity, Config, Executor, Mapper, Stage, StereoFrame,
    geometry::{StereoRig, Transform},
    image::View,
    memory::SLAB_ALIGN,
    tracking::{Class, Detection},
};
use nalgebra::Vector3;
use std::{sync::Mutex, time::Duration};

const WIDTH: usize = 1242;
const HEIGHT: usize = 375;
const RIG: StereoRig =
    StereoRig { focal_px: 721.5, center_u_px: 609.6, center_v_px: 172.9, baseline_m: 0.54 };
/// Frames until each car has a map, and frames measured.
const BEGINNING: usize = 8;
const MEASURED: usize = 8;
/// Way of the camera from frame to frame, m.
const STEP_M: f64 = 0.8;
/// Cars abreast: where the rear is before the camera in the first frame and what it gains a frame,
/// how far the near side is to the right of the camera (below 0: the far side, to the left), m. Far
/// enough from each other in the picture for all rears to be seen whole; the first four are like
/// the last four.
const CARS: [(f64, f64, f64); 8] = [
    (10.0, 0.05, 3.0),
    (8.0, 0.05, 0.4),
    (13.0, 0.05, 5.6),
    (14.0, 0.05, 8.2),
    (10.0, 0.04, -4.8),
    (8.0, 0.04, -2.2),
    (13.0, 0.04, -7.4),
    (14.0, 0.04, -10.0),
];
const CAR_M: [f64; 3] = [1.8, 1.45, 3.8];
/// Height of the camera, m.
const EYE_M: f64 = 1.65;

/// A brightness at (a, b) m of a surface: three sizes of smooth noise.
fn texture(surface: i64, a: f64, b: f64) -> u8 {
    let hash = |i: i64, j: i64| {
        let mixed = (i.wrapping_mul(0x9E37_79B9)
            ^ j.wrapping_mul(0x85EB_CA6B)
            ^ surface.wrapping_mul(0xC2B2_AE35)) as u64;
        (mixed.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) as f64 / f64::from(1 << 24)
    };
    let noise = |cell_m: f64| {
        let (x, y) = (a / cell_m, b / cell_m);
        let (i, j, fx, fy) = (x.floor() as i64, y.floor() as i64, x - x.floor(), y - y.floor());
        let row = |j| hash(i, j) * (1.0 - fx) + hash(i + 1, j) * fx;
        row(j) * (1.0 - fy) + row(j + 1) * fy
    };
    (40.0 + 70.0 * noise(0.07) + 60.0 * noise(0.25) + 60.0 * noise(0.9)) as u8
}

/// Casts a ray along (x, y, 1) from a camera `eye_x` to the right of the left one; returns the car
/// it meets (plus 1; 0 for none) and its brightness.
fn meet(x: f64, y: f64, eye_x: f64, frame: usize) -> (usize, u8) {
    let along = frame as f64 * STEP_M;
    let mut nearest = (f64::INFINITY, 0, 0u8);
    // Road, two walls, then the cars: the nearest surface counts.
    if y > 0.0 {
        let z = EYE_M / y;
        nearest = (z, 0, texture(1, x * z + eye_x, z + along));
    }
    for side in [-1.0, 1.0] {
        let z = (side * 12.0 - eye_x) / x;
        if z > 0.0 && z < nearest.0 {
            nearest = (z, 0, texture(2 + side as i64, z + along, y * z));
        }
    }
    for (car, &(start, gain, near_x)) in CARS.iter().enumerate() {
        // A box is met where the ray is inside all three pairs of planes.
        let front = start + gain * frame as f64;
        let slab = |low: f64, high: f64, slope: f64| {
            let (a, b) = (low / slope, high / slope);
            if a < b { (a, b) } else { (b, a) }
        };
        let (x_in, x_out) = slab(near_x - eye_x, near_x + CAR_M[0] - eye_x, x);
        let (y_in, y_out) = slab(EYE_M - CAR_M[1], EYE_M, y);
        let (enter, leave) = (x_in.max(y_in).max(front), x_out.min(y_out).min(front + CAR_M[2]));
        if enter < leave && enter < nearest.0 {
            // Texture in the car's own coordinates moves with the car.
            let own = [x * enter + eye_x - near_x, y * enter, enter - front];
            let (a, b) = if enter > front { (own[2], own[0] + own[1]) } else { (own[0], own[1]) };
            nearest = (enter, car + 1, texture(10 + car as i64, a, b));
        }
    }
    (nearest.1, nearest.2)
}

/// Part of the image that shows a car.
struct Car {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
    mask: Vec<u8>,
}

impl Car {
    fn detection(&self) -> Detection<'_> {
        Detection {
            class: Class::Car,
            score: 0.9,
            left: self.left as i32,
            top: self.top as i32,
            width: self.width as u32,
            height: self.height as u32,
            mask: &self.mask,
        }
    }
}

/// A stereo pair, the cars in the left picture, and the camera's place.
struct Frame {
    pair: [Vec<u8>; 2],
    cars: Vec<Car>,
    t_world_camera: Transform,
}

fn render(frame: usize) -> Frame {
    let mut shown = vec![0; WIDTH * HEIGHT];
    let pair = [0.0, RIG.baseline_m].map(|eye_x| {
        let pixel = |at: usize| {
            let (u, v) = ((at % WIDTH) as f64, (at / WIDTH) as f64);
            let (car, grey) = meet(
                (u - RIG.center_u_px) / RIG.focal_px,
                (v - RIG.center_v_px) / RIG.focal_px,
                eye_x,
                frame,
            );
            // Masks are those of the left camera.
            if eye_x == 0.0 {
                shown[at] = car;
            }
            grey
        };
        (0..WIDTH * HEIGHT).map(pixel).collect()
    });
    let cars = (1..=CARS.len()).map(|car| {
        let its = || (0..WIDTH * HEIGHT).filter(|&at| shown[at] == car);
        let (left, right) =
            (its().map(|at| at % WIDTH).min().unwrap(), its().map(|at| at % WIDTH).max().unwrap());
        let (top, bottom) = (its().next().unwrap() / WIDTH, its().next_back().unwrap() / WIDTH);
        let rows = (top..=bottom).map(|v| v * WIDTH);
        let mask = rows
            .flat_map(|row| {
                shown[row + left..=row + right].iter().map(|&there| u8::from(there == car))
            })
            .collect();
        Car { left, top, width: right + 1 - left, height: bottom + 1 - top, mask }
    });
    Frame {
        cars: cars.collect(),
        pair,
        t_world_camera: Transform::new(
            Vector3::zeros(),
            Vector3::new(0.0, 0.0, frame as f64 * STEP_M),
        ),
    }
}

/// One thread; sums the times of tracking with objects, and of segmentation.
#[derive(Default)]
struct Timed(Mutex<[Duration; 2]>);

impl Executor for Timed {
    fn stage<R>(&self, stage: Stage, work: impl FnOnce() -> R) -> R {
        let begin = ThreadTime::now();
        let result = work();
        let which = match stage {
            Stage::Tracking | Stage::Objects => Some(0),
            Stage::Segmentation => Some(1),
            _ => None,
        };
        if let Some(which) = which {
            self.0.lock().unwrap()[which] += begin.elapsed();
        }
        result
    }
}

/// Drives past, `count` cars detected or, with `by_motion`, all found by their motion; CPU time of
/// the two stages and of the step, summed over the frames measured.
fn map_frames(frames: &[Frame], slab: &mut [u8], count: usize, by_motion: bool) -> [Duration; 3] {
    let mut config = Config::for_rig(RIG);
    config.segmentation.enabled = by_motion;
    let mut mapper = Mapper::new(&Capacity::ONBOARD, &config, slab).unwrap();
    let mut spent = [Duration::ZERO; 3];
    for (at, frame) in frames.iter().enumerate() {
        let detections: Vec<Detection<'_>> =
            frame.cars.iter().take(if by_motion { 0 } else { count }).map(Car::detection).collect();
        let [left, right] =
            frame.pair.each_ref().map(|pixels| View::new(pixels, WIDTH, HEIGHT).unwrap());
        let seen = StereoFrame {
            t_world_camera: Some(frame.t_world_camera),
            detections: &detections,
            ..StereoFrame::pair(left, right)
        };
        let (timed, begin) = (Timed::default(), ThreadTime::now());
        let report = mapper.step(&seen, &timed).unwrap();
        // The first frames only fill the map.
        if at >= BEGINNING {
            spent[2] += begin.elapsed();
            spent
                .iter_mut()
                .zip(timed.0.into_inner().unwrap())
                .for_each(|(sum, time)| *sum += time);
            // The figures count only if as many objects were mapped as were meant to be.
            if by_motion {
                assert!(report.segmentation.instances >= 4, "frame {at}: {:?}", report.objects);
            } else {
                assert_eq!(
                    report.objects.fused as usize, count,
                    "frame {at}: {:?}",
                    report.objects
                );
            }
        }
    }
    spent
}

fn bench(criterion: &mut Criterion) {
    let frames: Vec<Frame> = (0..BEGINNING + MEASURED).map(render).collect();
    let mut slab = vec![0u8; Capacity::ONBOARD.bytes() + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let all = [
        ("instances", 0),
        ("instances", 1),
        ("instances", 4),
        ("instances", 8),
        ("segmentation", 8),
        ("step", 0),
        ("step", 8),
    ];
    for (what, count) in all {
        criterion.bench_function(&format!("{what}/{count} cars"), |bencher| {
            bencher.iter_custom(|times| {
                let runs = (0..times).map(|_| {
                    map_frames(&frames, &mut slab[start..], count, what == "segmentation")
                });
                let of = |[instances, segmentation, step]: [Duration; 3]| match what {
                    "step" => step,
                    "segmentation" => segmentation,
                    _ => instances,
                };
                runs.map(of).sum::<Duration>() / MEASURED as u32
            });
        });
    }
}

criterion_group! { name = benches; config = Criterion::default().sample_size(10); targets = bench }
criterion_main!(benches);
