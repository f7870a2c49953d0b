//! Runs with nothing right about them: bounds down to 0, settings at their ends, faulty images,
//! absurd poses, times and detections, and a store that hands back anything. Each mapper refuses
//! what it is given or maps it; its poses stay finite, its slab stays its own, it is restored to
//! the same bits, and it counts what its store counts.
//!
//! `DYNVOX_RANDOM_RUNS` says how many runs there are.

use dynvox::synth::{Street, StreetConfig};
use dynvox_core::geometry::Transform;
use dynvox_core::image::View;
use dynvox_core::memory::SLAB_ALIGN;
use dynvox_core::objects::NoSink;
use dynvox_core::random::Random;
use dynvox_core::tracking::{Class, Detection};
use dynvox_core::volume::{BlockKey, BlockStore, EvictedBlock, LoadedBlock};
use dynvox_core::{Capacity, Config, Mapper, Report, Serial, StereoFrame};
use dynvox_tests::fuzz::sizes;

/// Runs where the environment does not say.
const RUNS: u64 = 300;
const SIZE: [usize; 2] = [96, 48];
/// Frames of a run.
const FRAMES: usize = 8;
/// Bytes on either side of a slab that nothing may touch.
const GUARD: usize = 4 * SLAB_ALIGN;
const GUARDED: u8 = 0xA5;
/// Larger mappers are left out.
const MAX_SLAB: usize = 16 << 20;
/// Values that settings have at their ends.
const VALUES: [&str; 22] = [
    "0",
    "1",
    "2",
    "-1",
    "3",
    "0.5",
    "0.001",
    "0.05",
    "0.2",
    "100",
    "255",
    "65535",
    "4294967295",
    "1e-9",
    "1e9",
    "1e300",
    "nan",
    "inf",
    "true",
    "false",
    "icp",
    "normal",
];

/// Counts of events, so that a test of nothing is noticed.
#[derive(Debug, Default)]
struct Counts {
    runs: u64,
    refused: u64,
    steps: u64,
    refused_steps: u64,
    fused: u64,
    kept: u64,
    returned: u64,
    restored: u64,
}

/// Keeps, loses and makes up blocks, by their segments and coordinates.
#[derive(Default)]
struct Store {
    kept: u32,
    lost: u32,
    returned: u32,
    seed: u64,
}

impl Store {
    fn random(&self, BlockKey { segment, coord }: BlockKey) -> Random {
        let [x, y, z] = [coord.x, coord.y, coord.z].map(|along| u64::from(along as u16));
        Random::new(self.seed ^ (u64::from(segment.get()) << 48 | x << 32 | y << 16 | z))
    }
}

impl BlockStore for Store {
    fn store(&mut self, block: EvictedBlock<'_>) -> bool {
        let keeps = self.random(block.key).below(4) > 0;
        *if keeps { &mut self.kept } else { &mut self.lost } += 1;
        keeps
    }

    fn load(&mut self, block: LoadedBlock<'_>) -> bool {
        // By the block, so that a store answers the same when asked again.
        let mut random = self.random(block.key);
        let loads = random.below(2) == 0;
        if loads {
            block.sdf.iter_mut().for_each(|sdf| *sdf = random.next_u32() as i16);
            block.weight.iter_mut().for_each(|weight| *weight = random.next_u32() as u8);
            block
                .colour
                .into_iter()
                .flatten()
                .flatten()
                .for_each(|channel| *channel = random.next_u32() as u8);
        }
        self.returned += u32::from(loads);
        loads
    }
}

/// A number that no caller means: any bits, huge, tiny or ordinary.
fn number(random: &mut Random) -> f64 {
    let bits = u64::from(random.next_u32()) << 32 | u64::from(random.next_u32());
    [f64::from_bits(bits), 1e300, -1e300, 1e-300, 20_000.0, 0.0, 0.5][random.below(7) as usize]
}

fn pose(random: &mut Random) -> Transform {
    let mut pose = Transform::IDENTITY;
    pose.translation_m = pose.translation_m.map(|_| {
        if random.below(3) == 0 { number(random) } else { f64::from(random.below(100)) / 50.0 }
    });
    if random.below(3) == 0 {
        pose.rotation[random.below(4) as usize] = number(random);
    }
    pose
}

fn capacity(random: &mut Random) -> Capacity {
    let mut of = Capacity {
        image_width: SIZE[0],
        image_height: SIZE[1],
        features: 400,
        matches: 200,
        blocks: 60,
        visible_blocks: 50,
        history_frames: 4,
        detections: 4,
        mask_words: 150,
        tracks: 3,
        objects: 2,
        object_blocks: 12,
        crop_pixels: 1_500,
        ..Capacity::TINY
    };
    // Up to four bounds get a size from too small to generous.
    for _ in 0..random.below(4) {
        let size = [0, 1, 2, 7, 33, 300, 5_000][random.below(7) as usize];
        let sizes = sizes(&mut of);
        let at = random.below(sizes.len() as u32) as usize;
        *sizes[at] = size;
    }
    of
}

/// The keys of all settings of the core, from their documentation.
fn keys() -> Vec<&'static str> {
    let rows = include_str!("../../docs/settings.md")
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split('`').next());
    rows.filter(|key| !key.starts_with("street.") && !key.starts_with("room.") && key.contains('.'))
        .collect()
}

fn config(street: &Street, keys: &[&str], random: &mut Random) -> Config {
    let mut config = Config::for_rig(street.rig());
    (config.volume.voxel_size_m, config.volume.truncation_m, config.volume.prune_lag) =
        (0.25, 1.0, 2);
    for _ in 0..random.below(4) {
        let mut changed = config;
        let (key, value) = (
            keys[random.below(keys.len() as u32) as usize],
            VALUES[random.below(VALUES.len() as u32) as usize],
        );
        // One that is refused alone is left out mostly, so that most runs begin.
        if changed.set(key, value).is_ok()
            && (changed.validate().is_empty() || random.below(20) == 0)
        {
            config = changed;
        }
    }
    config
}

/// One frame's inputs.
struct Inputs {
    images: [Vec<u8>; 2],
    size: [usize; 2],
    colour: Vec<[u8; 3]>,
    disparity_q8: Vec<u16>,
    masks: Vec<(Detection<'static>, Vec<u8>)>,
    given: u32,
    pose: Transform,
    time_ns: u64,
}

impl Inputs {
    fn new(frames: &[[Vec<u8>; 2]], at: usize, random: &mut Random) -> Self {
        let [left, right] = &frames[at];
        let noise = |random: &mut Random| {
            (0..SIZE[0] * SIZE[1]).map(|_| random.next_u32() as u8).collect::<Vec<_>>()
        };
        // Half of the frames are spoilt: exchanged, black, noise, or of another time.
        let mut images = match random.below(12) {
            0 => [right.clone(), left.clone()],
            1 => [vec![0; left.len()], vec![0; left.len()]],
            2 => [noise(random), noise(random)],
            3 => [left.clone(), noise(random)],
            4 => frames[random.below(frames.len() as u32) as usize].clone(),
            _ => [left.clone(), right.clone()],
        };
        // One pair in ten is of another size.
        let size = if random.below(10) == 0 {
            [1 + random.below(96) as usize, 1 + random.below(48) as usize]
        } else {
            SIZE
        };
        images.iter_mut().for_each(|image| image.truncate(size[0] * size[1]));
        let pixels = size[0] * size[1];
        let mask = |random: &mut Random| {
            let [width, height] = [random.below(60), random.below(40)];
            let detection = Detection {
                class: Class::from_code(random.below(14)),
                score: number(random) as f32,
                left: random.below(200) as i32 - 50,
                top: if random.below(8) == 0 {
                    random.next_u32() as i32
                } else {
                    random.below(60) as i32 - 10
                },
                width,
                height,
                mask: &[],
            };
            // Some masks do not have the length that their box asks for.
            let len = if random.below(8) == 0 { random.below(100) } else { width * height };
            (detection, (0..len).map(|_| u8::from(random.below(5) > 0)).collect())
        };
        Self {
            colour: (0..pixels).map(|i| [i as u8, 3, 255 - i as u8]).collect(),
            disparity_q8: (0..pixels)
                .map(|_| if random.below(3) == 0 { random.next_u32() as u16 } else { 2_000 })
                .collect(),
            masks: (0..random.below(6)).map(|_| mask(random)).collect(),
            given: random.next_u32(),
            pose: pose(random),
            time_ns: if random.below(4) == 0 {
                u64::from(random.next_u32())
            } else {
                at as u64 * 100_000_000
            },
            images,
            size,
        }
    }

    /// Maps them. `None` where they were refused.
    fn step(&self, mapper: &mut Mapper<'_>, store: &mut Store) -> Option<Report> {
        let [width, height] = self.size;
        let view = |pixels| View::new(pixels, width, height).expect("pixels of this size");
        let detections: Vec<_> =
            self.masks.iter().map(|(detection, mask)| Detection { mask, ..*detection }).collect();
        // Each input is given in a share of the frames: every fourth, every eighth, every second.
        let given = |bit: u32, of: u32| self.given >> bit & (of - 1) == 0;
        let frame = StereoFrame {
            colour: given(0, 4)
                .then(|| View::new(&self.colour, width, height).expect("pixels of this size")),
            class: given(2, 8).then(|| view(&self.images[1])),
            disparity_q8: given(5, 8).then(|| {
                View::new(&self.disparity_q8, width, height).expect("pixels of this size")
            }),
            t_world_camera: given(8, 4).then_some(self.pose),
            time_ns: given(10, 2).then_some(self.time_ns),
            detections: &detections,
            ..StereoFrame::pair(view(&self.images[0]), view(&self.images[1]))
        };
        mapper.step_with(&frame, &Serial, store, &mut NoSink).ok()
    }
}

fn assert_sound(report: &Report, mapper: &Mapper<'_>, seed: u64) {
    let frame = report.frame;
    assert_eq!(report.internal_faults, 0, "run {seed}, frame {frame}");
    assert!(
        report.t_world_camera.is_finite(),
        "run {seed}, frame {frame}: {:?}",
        report.t_world_camera
    );
    for track in mapper.tracks() {
        let poses =
            track.t_world_object.iter().chain([&track.motion_world]).all(Transform::is_finite);
        let numbers = track.center_world_m.iter().all(|number| number.is_finite());
        assert!(poses && numbers, "run {seed}, frame {frame}: {track:?}");
    }
}

/// Restores a mapper, and maps what came after its snapshot: the digests are the same.
fn assert_restored(
    (capacity, config): (&Capacity, &Config),
    slab: &mut [u8],
    mut saved: &[u8],
    after: &[(Inputs, Option<u64>)],
    store: &mut Store,
) {
    let restored = Mapper::restore(capacity, config, slab, &mut |piece: &mut [u8]| {
        // Part by part, as the mapper asks for it.
        let (next, rest) = saved.split_at_checked(piece.len()).ok_or(())?;
        piece.copy_from_slice(next);
        saved = rest;
        Ok::<(), ()>(())
    });
    let seed = store.seed;
    let Ok(mut restored) = restored else { panic!("run {seed}: its own snapshot is refused") };
    for (inputs, digest) in after {
        assert_eq!(
            inputs.step(&mut restored, store).map(|report| report.digest),
            *digest,
            "run {seed} restored"
        );
    }
}

fn run(street: &Street, frames: &[[Vec<u8>; 2]], keys: &[&str], seed: u64, counts: &mut Counts) {
    let mut random = Random::new(seed);
    let (capacity, config) = (capacity(&mut random), config(street, keys, &mut random));
    counts.runs += 1;
    // Bounds that are refused are an outcome, too.
    if capacity.validate().is_err() || capacity.bytes() > MAX_SLAB {
        counts.refused += 1;
        return;
    }
    let len = capacity.bytes() + SLAB_ALIGN;
    // Guards at both ends: a byte written outside the slab is found.
    let mut memory = [vec![GUARDED; len + 2 * GUARD], vec![GUARDED; len + 2 * GUARD]];
    {
        let [first, second] = memory.each_mut().map(|memory| &mut memory[GUARD..GUARD + len]);
        let Ok(mut mapper) = Mapper::new(&capacity, &config, first) else {
            counts.refused += 1;
            return;
        };
        let mut store = Store { seed, ..Store::default() };
        let saves = random.below(FRAMES as u32) as usize;
        let mut saved = Vec::new();
        let mut after = Vec::new();
        for at in 0..FRAMES {
            // A snapshot at a random frame; all frames after it are played twice.
            if at == saves {
                let written: Result<(), ()> = mapper.save(&mut |piece: &[u8]| {
                    saved.extend_from_slice(piece);
                    Ok(())
                });
                assert!(written.is_ok());
            }
            let inputs = Inputs::new(frames, at, &mut random);
            // What the store saw must be what the report says.
            let before = [store.kept, store.lost, store.returned];
            let report = inputs.step(&mut mapper, &mut store);
            if let Some(report) = &report {
                assert_sound(report, &mapper, seed);
                let stored =
                    [store.kept - before[0], store.lost - before[1], store.returned - before[2]];
                let of = report.allocate.eviction;
                assert_eq!(
                    [of.stored, of.lost, of.loaded],
                    stored,
                    "run {seed}, frame {}",
                    report.frame
                );
                (counts.fused, counts.steps) =
                    (counts.fused + u64::from(report.fused), counts.steps + 1);
            } else {
                counts.refused_steps += 1;
            }
            if at >= saves {
                after.push((inputs, report.map(|report| report.digest)));
            }
        }
        // The surface is finite in all of these runs.
        mapper.triangles(&mut |triangle| {
            assert!(
                triangle.vertices.iter().flat_map(|vertex| vertex.position_m).all(f32::is_finite),
                "run {seed}"
            )
        });
        if let Ok(view) = mapper.raycast(&pose(&mut random), &Serial) {
            assert!(
                view.depth_m()
                    .into_iter()
                    .flat_map(|depth_m| depth_m.pixels())
                    .all(|depth_m| depth_m.is_finite()),
                "run {seed}"
            );
        }
        (counts.kept, counts.returned) =
            (counts.kept + u64::from(store.kept), counts.returned + u64::from(store.returned));
        assert_restored((&capacity, &config), second, &saved, &after, &mut store);
        counts.restored += 1;
    }
    for memory in &memory {
        assert!(
            memory[..GUARD].iter().chain(&memory[GUARD + len..]).all(|&byte| byte == GUARDED),
            "run {seed} left its slab"
        );
    }
}

#[test]
fn random_runs_end_in_a_sound_map_or_an_error() {
    let runs =
        std::env::var("DYNVOX_RANDOM_RUNS").ok().and_then(|text| text.parse().ok()).unwrap_or(RUNS);
    let [width, height] = SIZE.map(|side| side as u32);
    let street = Street::new(StreetConfig {
        width,
        height,
        frames: FRAMES as u32,
        ..StreetConfig::default()
    })
    .expect("a sound street");
    let frames: Vec<_> = (0..FRAMES as u32)
        .map(|at| street.frame(at))
        .map(|frame| [frame.left_grey, frame.right_grey])
        .collect();
    let keys = keys();
    assert!(keys.len() > 80, "{} keys", keys.len());
    let mut counts = Counts::default();
    for seed in 0..runs {
        run(&street, &frames, &keys, seed, &mut counts);
    }
    println!("{counts:?}");
    // Most runs must get far enough to mean something.
    let Counts { runs, refused, steps, refused_steps, fused, kept, returned, restored } = counts;
    assert!(
        2 * refused < runs && 2 * refused_steps < steps && restored == runs - refused,
        "most runs begin"
    );
    assert!(
        [fused, kept, returned].into_iter().all(|count| count > runs / 10),
        "they map, and use the store"
    );
}
