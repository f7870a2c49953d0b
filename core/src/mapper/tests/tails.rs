//! The frames that cost most: inputs made to be expensive, compared with a walk through a scene.
//!
//! `cargo test -p dynvox-core tails -- --nocapture` prints the table; with `--release` its times
//! are those of a build for users. Only units are asserted: a machine may be busy.

use super::*;
use crate::{egomotion::MAX_REFERENCE_FRAMES, random::Random};
use cpu_time::ThreadTime;
use std::println;

const PIXELS: usize = WIDTH * HEIGHT;
/// Memory for all of the scene, and for 64 masks.
const AMPLE: Capacity = Capacity {
    blocks: 6_000,
    visible_blocks: 3_000,
    detections: 64,
    tracks: 64,
    colour: true,
    ..CAPACITY
};
/// So few blocks that most frames evict some.
const CROWDED: Capacity = Capacity { blocks: 400, visible_blocks: 400, ..AMPLE };
/// So few that a frame evicts all that the one before saw.
const EVICTED: Capacity = Capacity { blocks: 150, visible_blocks: 150, ..AMPLE };

/// Index of the unit of descriptors.
const COMPARED: usize = 4;

/// Images, depth, pose and masks of one frame.
struct Input {
    pair: [Vec<u8>; 2],
    depth: Option<Vec<u16>>,
    pose: Option<Transform>,
    masks: usize,
}

impl Input {
    fn pair(pair: [Vec<u8>; 2]) -> Self {
        Self { pair, depth: None, pose: None, masks: 0 }
    }

    /// A wall of one disparity and colour, seen from a pose.
    fn wall(disparity_px: u16, pose: Transform) -> Self {
        let depth = Some(vec![disparity_px << 8; PIXELS]);
        Self { depth, pose: Some(pose), ..Self::pair([(); 2].map(|()| vec![90; PIXELS])) }
    }
}

/// The scene from where a walker is after so many frames.
fn scene(at: usize) -> [Vec<u8>; 2] {
    let turn = Vector3::new(0.0, 0.003 * at as f64, 0.0);
    see(&Transform::new(turn, Vector3::new(0.0, 0.0, 0.06) * at as f64))
}

fn noise(random: &mut Random) -> Vec<u8> {
    (0..PIXELS).map(|_| random.below(256) as u8).collect()
}

/// Both images, with a grey value for each pixel, the right one seen some pixels farther on.
fn drawn(grey: impl Fn(usize, usize) -> u8, shift: usize) -> [Vec<u8>; 2] {
    [0, shift].map(|shift| (0..PIXELS).map(|at| grey(at % WIDTH + shift, at / WIDTH)).collect())
}

/// A pose that has turned about the vertical so far that another part of the world is in view.
fn turned(at: usize) -> Transform {
    Transform::new(Vector3::new(0.0, 1.7 * at as f64, 0.0), Vector3::zeros())
}

/// A clip that is made to be expensive: its capacity, and frame after frame of it.
struct Clip {
    name: &'static str,
    capacity: Capacity,
    frames: Vec<Input>,
}

/// The usual walk, from frame to frame.
fn walk() -> Vec<Input> {
    (0..14).map(|at| Input::pair(scene(at))).collect()
}

fn clips() -> Vec<Clip> {
    let mut random = Random::new(9);
    let clip = |name, frames| Clip { name, capacity: AMPLE, frames };
    let images = |frames: &mut dyn FnMut(usize) -> [Vec<u8>; 2]| -> Vec<Input> {
        (0..8).map(|at| Input::pair(frames(at))).collect()
    };
    // A walk that is interrupted for so long that the camera is lost, and what it sees then.
    let interrupted = |covered: usize, then: &[usize]| -> Vec<Input> {
        let dark = || Input::pair([(); 2].map(|()| vec![0; PIXELS]));
        let seen = (0..6).map(|at| Input::pair(scene(at)));
        let again = then.iter().map(|&at| Input::pair(scene(at)));
        seen.chain((0..covered).map(|_| dark())).chain(again).collect()
    };
    let lost = MAX_REFERENCE_FRAMES as usize + 1;
    let after: Vec<usize> = (6 + lost..14 + lost).collect();
    let walls = |disparity_px: fn(usize) -> u16, pose: fn(usize) -> Transform| -> Vec<Input> {
        (0..10).map(|at| Input::wall(disparity_px(at), pose(at))).collect()
    };
    let mut masked = walk();
    masked.iter_mut().for_each(|input| input.masks = 64);
    vec![
        clip("walk", walk()),
        clip("noise in both images", images(&mut |_| [(); 2].map(|()| noise(&mut random)))),
        clip(
            "one noise in both images",
            images(&mut |_| {
                let grey = noise(&mut random);
                [grey.clone(), grey]
            }),
        ),
        clip(
            "noise in the right image",
            images(&mut |at| [scene(at)[0].clone(), noise(&mut random)]),
        ),
        clip(
            "every second frame noise",
            images(&mut |at| match at % 2 {
                0 => scene(at),
                _ => [(); 2].map(|()| noise(&mut random)),
            }),
        ),
        clip("ramp", images(&mut |at| drawn(|u, _| (3 * (u + at)) as u8, 5))),
        clip(
            "stripes",
            images(&mut |at| drawn(|u, _| if (u + at) % 16 < 8 { 40 } else { 200 }, 8)),
        ),
        clip(
            "chessboard",
            images(&mut |at| {
                drawn(|u, v| if (u + at) % 16 / 8 == v % 16 / 8 { 40 } else { 200 }, 8)
            }),
        ),
        clip(
            "dots",
            images(&mut |at| {
                drawn(|u, v| if (u + 3 * at) % 6 == 0 && v % 6 == 0 { 255 } else { 0 }, 6)
            }),
        ),
        clip("jumps to and fro", images(&mut |at| scene(40 * (at % 2)))),
        clip("ever farther jumps", images(&mut |at| scene(at * at))),
        clip("black", images(&mut |_| [(); 2].map(|()| vec![0; PIXELS]))),
        clip("loss and return", interrupted(lost, &after)),
        clip("loss and return elsewhere", interrupted(lost, &[90, 91, 92, 93, 94, 95])),
        clip("short losses", interrupted(3, &[9, 10, 11])),
        Clip { capacity: CROWDED, ..clip("full pool", walk()) },
        clip("all blocks new", walls(|_| 20, turned)),
        Clip { capacity: EVICTED, ..clip("all blocks evicted", walls(|_| 20, turned)) },
        clip("near and far", walls(|at| if at % 2 == 0 { 60 } else { 5 }, |_| Transform::IDENTITY)),
        clip("64 masks", masked),
    ]
}

/// Work of each frame of a clip, and its CPU time, ms.
fn run(clip: &Clip, config: &Config) -> (Vec<WorkUnits>, Vec<f64>) {
    let mut slab = vec![0u8; clip.capacity.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&clip.capacity, config, &mut slab).unwrap();
    // Squares in eight rows and eight columns.
    let [width, height] = [WIDTH as u32 / 8, HEIGHT as u32 / 8];
    let mask = vec![1; (width * height) as usize];
    let square = |at: usize| Detection {
        class: Class::Car,
        score: 0.9,
        left: ((at % 8) as u32 * width) as i32,
        top: ((at / 8) as u32 * height) as i32,
        width,
        height,
        mask: &mask,
    };
    let step = |input: &Input| {
        let [left, right] =
            input.pair.each_ref().map(|pixels| View::new(pixels, WIDTH, HEIGHT).unwrap());
        let detections: Vec<_> = (0..input.masks).map(square).collect();
        let frame = StereoFrame {
            detections: &detections,
            disparity_q8: input.depth.as_ref().and_then(|depth| View::new(depth, WIDTH, HEIGHT)),
            t_world_camera: input.pose,
            ..StereoFrame::pair(left, right)
        };
        let begun = ThreadTime::now();
        let work = mapper.step(&frame, &Serial).unwrap().work;
        (work, begun.elapsed().as_secs_f64() * 1e3)
    };
    clip.frames.iter().map(step).unzip()
}

/// Time that a frame's units stand for, ms.
fn cost_ms(work: &WorkUnits) -> f64 {
    work.nominal_ns() as f64 / 1e6
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Frames' most of a unit.
fn most(frames: &[WorkUnits], unit: &str) -> u64 {
    let of_frame =
        |work: &WorkUnits| work.named().iter().find(|(name, _)| *name == unit).unwrap().1;
    frames.iter().map(of_frame).max().unwrap()
}

#[test]
fn no_made_up_input_costs_twice_what_a_walk_does() {
    let config = Walk::config();
    let clips = clips();
    // The first frames have no map and no matches.
    let (mut walk, mut walk_ms) = run(&clips[0], &config);
    (walk, walk_ms) = (walk.split_off(3), walk_ms.split_off(3));
    let usual: Vec<f64> = (0..WorkUnits::COUNT)
        .map(|unit| median(walk.iter().map(|work| work.named()[unit].1 as f64)))
        .collect();
    let usual_ms = median(walk.iter().map(cost_ms));
    let usual_cpu_ms = median(walk_ms.iter().copied());
    println!(
        "{:<26}{:>6}{:>6}{:>14}{:>12}{:>8}",
        "input", "units", "CPU", "descriptors", "cast", "moved"
    );
    for clip in &clips {
        let (frames, cpu_ms) = run(clip, &config);
        let bound = clip.capacity.work(&config);
        let cpu = cpu_ms.into_iter().max_by(f64::total_cmp).unwrap() / usual_cpu_ms;
        let cost = frames.iter().map(cost_ms).max_by(f64::total_cmp).unwrap() / usual_ms;
        let [compared, cast, moved] =
            ["compared_descriptors", "cast_pixels", "moved_blocks"].map(|unit| most(&frames, unit));
        let descriptors = compared as f64 / usual[COMPARED];
        println!("{:<26}{cost:>6.2}{cpu:>6.2}{descriptors:>14.2}{cast:>12}{moved:>8}", clip.name);
        for (frame, work) in frames.iter().enumerate() {
            for ((name, units), (_, most)) in work.named().into_iter().zip(bound.named()) {
                assert!(units <= most, "{}, frame {frame}: {units} {name} of {most}", clip.name);
            }
        }
        assert!(cost <= 2.0, "{}: {cost} times a frame of the walk", clip.name);
        assert!(descriptors <= 4.0, "{}: {descriptors} times the comparisons", clip.name);
        // Each clip does what it was made for.
        assert_eq!(cast > 0, clip.name.starts_with("loss"), "{}: {cast} pixels", clip.name);
        assert_eq!(moved > 0, clip.capacity.blocks < AMPLE.blocks, "{}: {moved}", clip.name);
    }
}
