//! A thousand short runs through made-up scenes, each stopped somewhere and resumed.

use super::{
    resume::{restored, saved},
    *,
};
use crate::random::Random;
use std::println;

const RUNS: u64 = 1_000;
const FRAMES: usize = 9;
const SIZE: [usize; 2] = [96, 48];
const SMALL: Capacity = Capacity {
    image_width: SIZE[0],
    image_height: SIZE[1],
    raw_width: 0,
    raw_height: 0,
    features: 400,
    matches: 200,
    // So few that some must leave, in maps and tables alike.
    blocks: 60,
    visible_blocks: 50,
    history_frames: 4,
    detections: 4,
    mask_words: 150,
    tracks: 3,
    objects: 2,
    object_blocks: 12,
    crop_pixels: 1_500,
    colour: true,
};
const RIG: crate::geometry::StereoRig =
    crate::geometry::StereoRig { focal_px: 60.0, center_u_px: 48.0, center_v_px: 24.0, baseline_m: 0.5 };

/// What a detector may say of a frame.
struct Box {
    class: Class,
    score: f32,
    /// Left, top, width, height, px.
    pixels: [i32; 4],
    mask: Vec<u8>,
}

/// One frame, as it is handed in.
struct Frame {
    left: Vec<u8>,
    right: Vec<u8>,
    colour: Option<Vec<[u8; 3]>>,
    t_world_camera: Option<Transform>,
    seen: Vec<Box>,
}

/// A patch that moves in front of a wall.
struct Patch {
    at: [i32; 2],
    by: [i32; 2],
    size: [i32; 2],
    disparity: i32,
    class: Class,
}

/// A texture without end.
fn texture(u: i32, v: i32, seed: u32) -> u8 {
    let hash = |u: i32, v: i32| {
        let x = (u as u32).wrapping_mul(0x9E37_79B9) ^ (v as u32).wrapping_mul(0x85EB_CA6B) ^ seed.wrapping_mul(0xC2B2_AE35);
        let x = (x ^ x >> 15).wrapping_mul(0x2C1B_3C6D);
        ((x ^ x >> 12) & 0xFF) as i32
    };
    let (cell_u, cell_v) = (u.div_euclid(3), v.div_euclid(3));
    ((2 * hash(cell_u, cell_v) + hash(u, v)) / 3) as u8
}

/// A run of [`FRAMES`] frames, all of it from one seed: how the camera goes, what moves, what the detector misses or makes up.
fn run(seed: u64) -> Vec<Frame> {
    let mut random = Random::new(seed);
    let mut below = |bound: i32| random.below(bound as u32) as i32;
    let classes = [Class::Car, Class::Person, Class::Other];
    let mut patches: Vec<Patch> = (0..1 + below(3))
        .map(|_| Patch {
            at: [below(80), below(36)],
            by: [below(5) - 2, below(3) - 1],
            size: [6 + below(30), 6 + below(22)],
            disparity: 4 + below(10),
            class: classes[below(3) as usize],
        })
        .collect();
    let (given, coloured, speed) = (below(3) == 0, below(2) == 0, below(3));
    (0..FRAMES as i32)
        .map(|at| {
            // Now and then a camera sees nothing.
            let black = below(12) == 0;
            let value = |u: i32, v: i32, camera: i32| {
                let over = |patch: &&Patch| {
                    let [du, dv] = [u + camera * patch.disparity - patch.at[0], v - patch.at[1]];
                    du >= 0 && dv >= 0 && du < patch.size[0] && dv < patch.size[1]
                };
                match patches.iter().position(|patch| over(&patch)) {
                    _ if black => 0,
                    Some(index) => {
                        let patch = &patches[index];
                        texture(u + camera * patch.disparity - patch.at[0], v - patch.at[1], 7 + index as u32)
                    }
                    None => texture(u + camera * 3 + at * speed, v, seed as u32),
                }
            };
            let image = |camera: i32| -> Vec<u8> {
                let pixels = (0..SIZE[1] as i32).flat_map(|v| (0..SIZE[0] as i32).map(move |u| (u, v)));
                pixels.map(|(u, v)| value(u, v, camera)).collect()
            };
            let (left, right) = (image(0), image(1));
            let mut seen: Vec<Box> = Vec::new();
            for patch in &patches {
                // The detector misses one in four, and what it sees has holes.
                if below(4) > 0 {
                    let holes = below(4);
                    let pixels = [patch.at[0], patch.at[1], patch.size[0], patch.size[1]];
                    let mask = (0..patch.size[0] * patch.size[1]).map(|_| u8::from(below(8) >= holes)).collect();
                    seen.push(Box { class: patch.class, score: 0.5 + 0.05 * below(10) as f32, pixels, mask });
                }
            }
            if below(4) == 0 {
                let [width, height] = [1 + below(40), 1 + below(30)];
                let pixels = [below(110) - 10, below(60) - 10, width, height];
                let mask = (0..width * height).map(|_| below(3) as u8).collect();
                seen.push(Box { class: classes[below(3) as usize], score: below(12) as f32 * 0.1, pixels, mask });
            }
            for patch in &mut patches {
                patch.at = [patch.at[0] + patch.by[0], patch.at[1] + patch.by[1]];
            }
            Frame {
                colour: coloured.then(|| left.iter().map(|&grey| [grey, grey / 2, 255 - grey]).collect()),
                left,
                right,
                t_world_camera: given.then(|| Transform::from_translation([0.05 * f64::from(at * speed), 0.0, 0.1 * f64::from(at)])),
                seen,
            }
        })
        .collect()
}

fn config(seed: u64) -> Config {
    let mut config = Config::for_rig(RIG);
    (config.volume.voxel_size_m, config.volume.truncation_m, config.volume.prune_lag) = (0.25, 1.0, 2);
    config.mapper.fuse_every = 1 + u32::from(seed.is_multiple_of(5));
    (config.tracking.motion.matches_min, config.tracking.motion.matches_again) = (6, 6);
    // Of the patches some are tracked only.
    (config.tracking.forget_frames, config.tracking.area_min_px) = (2, 12_000);
    config
}

fn step(mapper: &mut Mapper<'_>, frame: &Frame) -> Report {
    let view = |pixels| View::new(pixels, SIZE[0], SIZE[1]).unwrap();
    let detections: Vec<Detection<'_>> = frame
        .seen
        .iter()
        .map(|seen| Detection {
            class: seen.class,
            score: seen.score,
            left: seen.pixels[0],
            top: seen.pixels[1],
            width: seen.pixels[2] as u32,
            height: seen.pixels[3] as u32,
            mask: &seen.mask,
        })
        .collect();
    let given = StereoFrame {
        colour: frame.colour.as_ref().map(|colour| View::new(colour, SIZE[0], SIZE[1]).unwrap()),
        t_world_camera: frame.t_world_camera,
        detections: &detections,
        ..StereoFrame::pair(view(&frame.left), view(&frame.right))
    };
    mapper.step(&given, &Serial).unwrap()
}

/// What the runs went through, so that a test of nothing does not pass.
#[derive(Debug, Default)]
struct Coverage {
    measured: u32,
    objects: u32,
    waiting: u32,
    held: u32,
    missed: u32,
    tracked_only: u32,
    evicted: u32,
    pruned: u32,
}

impl Coverage {
    fn note(&mut self, report: &Report, mapper: &Mapper<'_>) {
        self.measured += mapper.tracks().filter(|track| track.inliers > 0).count() as u32;
        self.objects += report.instances.objects.objects;
        self.waiting += report.instances.objects.caught_up;
        self.held += u32::from(report.pose == PoseOrigin::Held);
        self.missed += report.instances.tracks.tracks - report.instances.tracks.detected;
        self.tracked_only += report.instances.detections.tracked_only;
        self.evicted += report.allocation.eviction.lost;
        self.pruned += report.prune.visited;
    }

    fn least(&self) -> u32 {
        let Self { measured, objects, waiting, held, missed, tracked_only, evicted, pruned } = self;
        *[measured, objects, waiting, held, missed, tracked_only, evicted, pruned].into_iter().min().unwrap()
    }
}

#[test]
fn a_thousand_runs_resumed_anywhere_give_the_digests_and_the_state_of_those_that_never_stopped() {
    let mut coverage = Coverage::default();
    let mut slab = vec![0u8; SMALL.bytes() + SLAB_ALIGN];
    for seed in 0..RUNS {
        let (frames, config) = (run(seed), config(seed));
        let stop = 1 + Random::new(seed ^ 0x5EED).below(FRAMES as u32 - 1) as usize;
        let mut mapper = Mapper::new(&SMALL, &config, &mut slab).unwrap();
        for frame in &frames[..stop] {
            let report = step(&mut mapper, frame);
            coverage.note(&report, &mapper);
        }
        let bytes = saved(&mut mapper);
        let expected: Vec<Report> = frames[stop..].iter().map(|frame| step(&mut mapper, frame)).collect();
        let end = saved(&mut mapper);
        let resumed = restored(&SMALL, &config, &bytes, |mapper| {
            for (frame, expected) in frames[stop..].iter().zip(&expected) {
                let report = step(mapper, frame);
                assert_eq!(
                    report.digests.first_difference(&expected.digests),
                    None,
                    "run {seed} stopped before {stop}, frame {}",
                    report.frame
                );
                assert_eq!(report.digest, expected.digest);
                coverage.note(&report, mapper);
            }
            saved(mapper)
        });
        assert!(resumed.unwrap() == end, "run {seed} stopped before {stop}: the states at the end differ");
    }
    println!("{RUNS} runs: {coverage:?}");
    assert!(coverage.least() >= 100, "{coverage:?}");
}
