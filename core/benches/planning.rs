//! Maps for planners, CPU time of one thread: distance fields of streets and of scattered
//! obstacles; a frame's free space; an update of the window from the map, by size.

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
    geometry::{GroundPlane, StereoRig, Transform},
    image::View,
    memory::{Carver, SLAB_ALIGN},
    planning::{DepthView, DistanceField, Planning, PlanningConfig},
    random::Random,
    volume::{DepthImage, NoStore, Observation, Viewpoint, Volume, VolumeConfig},
};
use nalgebra::Vector3;
use std::{hint::black_box, time::Duration};

const WIDTH: usize = 620;
const HEIGHT: usize = 188;
const RIG: StereoRig =
    StereoRig { focal_px: 354.0, center_u_px: 300.0, center_v_px: 91.0, baseline_m: 0.54 };

/// Houses on both sides, cars between them; or one obstacle in `one_in` cells.
fn obstacles([width, length, height]: [usize; 3], one_in: Option<u32>) -> Vec<u8> {
    let mut random = Random::new(7);
    let street = |x: usize, y: usize, z: usize| {
        let wall = x < width / 4 || x > width - width / 4;
        let car = y % 40 < 22 && (width / 3..width / 3 + 9).contains(&x) && z < 8;
        u8::from(wall || car)
    };
    (0..width * length * height)
        .map(|at| match one_in {
            Some(cells) => u8::from(random.below(cells) == 0),
            None => street(at / height % width, at / height / width, at % height),
        })
        .collect()
}

fn distances(criterion: &mut Criterion) {
    for (name, size) in [
        ("400x400 slice", [400, 400, 1]),
        ("200x200 slice", [200, 200, 1]),
        ("100x100x20 window", [100, 100, 20]),
    ] {
        // The number of obstacles decides how long the envelopes get.
        for (scene, one_in) in [
            ("street", None),
            ("one in 200", Some(200)),
            ("one in 3", Some(3)),
            ("one in 20000", Some(20_000)),
        ] {
            let is_obstacle = obstacles(size, one_in);
            let (cells, longest) = (is_obstacle.len(), *size.iter().max().unwrap());
            let bytes = DistanceField::bytes(cells, longest);
            let mut slab = vec![0u8; bytes + SLAB_ALIGN];
            let mut field =
                DistanceField::new_in(cells, longest, &mut Carver::new(&mut slab, bytes).unwrap());
            criterion.bench_function(&format!("distance {name}, {scene}"), |bencher| {
                // CPU time of this thread: other work on the machine does not count.
                bencher.iter_custom(|rounds| {
                    let begin = ThreadTime::now();
                    for _ in 0..rounds {
                        assert!(field.transform(black_box(&is_obstacle), size));
                    }
                    begin.elapsed()
                });
            });
        }
    }
}

/// A road between two walls.
fn canyon() -> Vec<f32> {
    (0..WIDTH * HEIGHT)
        .map(|i| {
            let (x, y) =
                (((i % WIDTH) as f32 - 300.0) / 354.0, ((i / WIDTH) as f32 - 91.0) / 354.0);
            let road = if y > 0.0 { 1.65 / y } else { 99.0 };
            let wall = if x > 0.0 { 6.0 / x } else { -8.0 / x };
            let nearest = if road < wall { road } else { wall };
            if nearest > 0.5 && nearest < 20.0 { nearest } else { 0.0 }
        })
        .collect()
}

fn windows(criterion: &mut Criterion) {
    for (sides, distance_3d) in
        [([100, 100, 20], true), ([200, 200, 20], false), ([400, 400, 20], false)]
    {
        let capacity = Capacity {
            blocks: 40_000,
            visible_blocks: 40_000,
            planning_width: sides[0],
            planning_length: sides[1],
            planning_height: sides[2],
            planning_distance_3d: distance_3d,
            ..Capacity::ONBOARD
        };
        let bytes = Volume::bytes(&capacity) + Planning::bytes(&capacity);
        let mut slab = vec![0u8; bytes + SLAB_ALIGN];
        let mut carver = Carver::new(&mut slab, bytes).unwrap();
        let config = VolumeConfig::default();
        let mut volume = Volume::new_in(&capacity, &config, &mut carver);
        let mut planning = Planning::new_in(
            &capacity,
            &PlanningConfig { min_weight: 1, ..PlanningConfig::default() },
            config.voxel_size_m,
            &mut carver,
        );
        // One depth image for all poses: only the camera moves.
        let (grey, depth_m) = (vec![128; WIDTH * HEIGHT], canyon());
        let focal_baseline = RIG.focal_baseline_px_m() as f32;
        let disparity_q8: Vec<u16> = depth_m
            .iter()
            .map(|depth| if *depth > 0.0 { (256.0 * focal_baseline / depth) as u16 } else { 0 })
            .collect();
        let pose =
            |n: u32| Transform::new(Vector3::zeros(), Vector3::new(0.0, 0.0, 0.8 * f64::from(n)));
        let disparity_q8 = View::new(&disparity_q8, WIDTH, HEIGHT).unwrap();
        let ground = GroundPlane::find(&RIG, disparity_q8);
        let sight = |t_world_camera| DepthView {
            rig: &RIG,
            t_world_camera,
            disparity_q8,
            ground,
            within_m: f32::MAX,
        };
        // Twelve views fill the window before anything is measured.
        let poses: Vec<Transform> = (0..12).map(pose).collect();
        for pose in &poses {
            let view = Viewpoint { rig: RIG, width: WIDTH, height: HEIGHT, t_world_camera: *pose };
            let depth_m = View::new(&depth_m, WIDTH, HEIGHT).unwrap();
            volume.allocate(&view, depth_m, &mut NoStore, &Serial);
            let seen = Observation {
                depth: DepthImage::Plain(depth_m),
                grey: View::new(&grey, WIDTH, HEIGHT).unwrap(),
                colour: None,
                class: None,
            };
            volume.fuse(&view, seen, &Serial);
            planning.observe(&sight(pose));
        }
        measure(criterion, &capacity, (&mut planning, &volume), &sight(&poses[11]));
    }
}

fn measure(
    criterion: &mut Criterion,
    capacity: &Capacity,
    (planning, volume): (&mut Planning<'_>, &Volume<'_>),
    sight: &DepthView<'_>,
) {
    let [width, length, height] = planning.size();
    let name = format!(
        "{width}x{length}x{height}, {} blocks, {} bytes",
        volume.pool().len(),
        Planning::bytes(capacity)
    );
    let mut bench = |what: &str, run: &mut dyn FnMut()| {
        criterion.bench_function(&format!("{what} {name}"), |bencher| {
            bencher.iter_custom(|rounds| {
                let begin = ThreadTime::now();
                (0..rounds).for_each(|_| run());
                begin.elapsed()
            });
        });
    };
    // The three parts of a planner's cycle.
    bench("free space", &mut || planning.observe(black_box(sight)));
    bench("update", &mut || assert!(planning.update(black_box(volume)).occupied > 0));
    bench("predict", &mut || assert!(planning.predict(black_box(1.0)).occupied > 0));
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_secs(1));
    targets = distances, windows
}
criterion_main!(benches);
