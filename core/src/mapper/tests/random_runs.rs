//! A thousand short runs through random scenes, each stopped somewhere and resumed.

mod forged;
mod scene;

use super::{
    resume::{restored, saved},
    *,
};
use crate::random::Random;
use scene::{FRAMES, Frame, SIZE, run};
use std::println;

const RUNS: u64 = 1_000;
const SMALL: Capacity = Capacity {
    image_width: SIZE[0],
    image_height: SIZE[1],
    raw_width: 0,
    raw_height: 0,
    features: 400,
    matches: 200,
    // So few that maps and tables evict.
    blocks: 60,
    visible_blocks: 50,
    history_frames: 4,
    detections: 4,
    mask_words: 150,
    tracks: 3,
    objects: 2,
    object_blocks: 12,
    crop_pixels: 1_500,
    keyframes: 6,
    planning_width: 24,
    planning_length: 20,
    planning_height: 10,
    planning_distance_3d: true,
    colour: true,
};
const RIG: crate::geometry::StereoRig = crate::geometry::StereoRig {
    focal_px: 60.0,
    center_u_px: 48.0,
    center_v_px: 24.0,
    baseline_m: 0.5,
};

fn config(seed: u64) -> Config {
    let mut config = Config::for_rig(RIG);
    (config.volume.voxel_size_m, config.volume.truncation_m, config.volume.prune_lag) =
        (0.25, 1.0, 2);
    config.mapper.fuse_every = 1 + u32::from(seed.is_multiple_of(5));
    (config.tracking.motion.matches_min, config.tracking.motion.matches_again) = (6, 6);
    // Some of the patches are tracked only.
    (config.tracking.tracks.forget_frames, config.tracking.instances.area_min_px) = (2, 12_000);
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

/// Events the runs contain; the test fails where one is missing.
#[derive(Debug, Default)]
struct Coverage {
    measured: u32,
    objects: u32,
    waiting: u32,
    extrapolated: u32,
    missed: u32,
    tracked_only: u32,
    evicted: u32,
    pruned: u32,
}

impl Coverage {
    fn note(&mut self, report: &Report, mapper: &Mapper<'_>) {
        self.measured += mapper.tracks().filter(|track| track.inliers > 0).count() as u32;
        self.objects += report.objects.objects;
        self.waiting += report.objects.caught_up;
        self.extrapolated += u32::from(report.pose == PoseOrigin::Extrapolated);
        self.missed += report.tracking.tracks.tracks - report.tracking.tracks.detected;
        self.tracked_only += report.tracking.detections.tracked_only;
        self.evicted += report.allocate.eviction.lost;
        self.pruned += report.prune.visited;
    }

    fn least(&self) -> u32 {
        // By name, so that a new counter must be listed.
        let Self {
            measured,
            objects,
            waiting,
            extrapolated,
            missed,
            tracked_only,
            evicted,
            pruned,
        } = self;
        *[measured, objects, waiting, extrapolated, missed, tracked_only, evicted, pruned]
            .into_iter()
            .min()
            .unwrap()
    }
}

#[dynvox_needs::long]
#[test]
fn a_thousand_runs_resumed_anywhere_equal_those_that_never_stopped() {
    let mut coverage = Coverage::default();
    let mut slab = vec![0u8; SMALL.bytes() + SLAB_ALIGN];
    for seed in 0..RUNS {
        let (frames, config) = (run(seed), config(seed));
        // Before any frame but the first.
        let stop = 1 + Random::new(seed ^ 0x5EED).below(FRAMES as u32 - 1) as usize;
        let mut mapper = Mapper::new(&SMALL, &config, &mut slab).unwrap();
        for frame in &frames[..stop] {
            let report = step(&mut mapper, frame);
            coverage.note(&report, &mapper);
        }
        let bytes = saved(&mut mapper);
        let expected: Vec<Report> =
            // The same mapper goes on: what it does is what a resumed one must do.
            frames[stop..].iter().map(|frame| step(&mut mapper, frame)).collect();
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
        // To the byte, which covers state that no digest has.
        assert!(
            resumed.unwrap() == end,
            "run {seed} stopped before {stop}: the states at the end differ"
        );
    }
    println!("{RUNS} runs: {coverage:?}");
    // Each situation must have come up in many of the runs.
    assert!(coverage.least() >= 80, "{coverage:?}");
}
