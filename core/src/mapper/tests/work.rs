//! Work of steps on inputs made to cost the most, compared with its bound.

use super::*;
use crate::{Executor, image::View, parallel::TwoThreads, random::Random};

const SIDES: [usize; 2] = [WIDTH, HEIGHT];
const FRAMES: usize = 10;
/// So few blocks that the pool is full, and the list of visible ones as well.
const FULL: Capacity = Capacity {
    image_width: WIDTH,
    image_height: HEIGHT,
    features: 400,
    matches: 200,
    blocks: 300,
    visible_blocks: 250,
    ..Capacity::TINY
};

/// Pictures and depth of a kind.
#[derive(Clone, Copy, Debug)]
enum Input {
    /// Each image and each disparity is noise of its own.
    Noise,
    /// Ramps of grey, and matching left to the stereo stage.
    Ramp,
    /// A wall that is near in one frame and far in the next.
    Jump,
    /// Nothing at all.
    Black,
}

impl Input {
    /// Left and right image, and the depth that comes with them.
    fn frame(self, number: usize, random: &mut Random) -> ([Vec<u8>; 2], Option<Vec<u16>>) {
        let len = WIDTH * HEIGHT;
        let mut noise = || (0..len).map(|_| random.below(256) as u8).collect::<Vec<u8>>();
        match self {
            Self::Noise => {
                let images = [noise(), noise()];
                let depth = (0..len).map(|_| (1 + random.below(60) as u16) << 8).collect();
                (images, Some(depth))
            }
            Self::Ramp => {
                let ramp = |shift: usize| (0..len).map(|at| ((at + shift) * 3) as u8).collect();
                ([ramp(number), ramp(number + 5)], None)
            }
            Self::Jump => {
                let disparity = if number.is_multiple_of(2) { 40 } else { 4 };
                let image = noise();
                ([image.clone(), image], Some(vec![disparity << 8; len]))
            }
            Self::Black => ([vec![0; len], vec![0; len]], None),
        }
    }
}

/// Work of each frame.
fn run(input: Input, config: &Config) -> Vec<WorkUnits> {
    reports(input, config, &Serial).iter().map(|report| report.work).collect()
}

/// Report of each frame.
fn reports<E: Executor>(input: Input, config: &Config, executor: &E) -> Vec<Report> {
    let mut slab = vec![0u8; FULL.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&FULL, config, &mut slab).unwrap();
    let mut random = Random::new(7);
    let mut step = |number: usize| {
        let ([left, right], depth) = input.frame(number, &mut random);
        let view = |pixels| View::new(pixels, SIDES[0], SIDES[1]).unwrap();
        let given = StereoFrame {
            disparity_q8: depth.as_ref().map(|depth| View::new(depth, SIDES[0], SIDES[1]).unwrap()),
            // A pose that turns away, so that every frame needs other blocks.
            t_world_camera: Some(Transform::new(
                Vector3::new(0.0, 0.5 * number as f64, 0.0),
                Vector3::new(0.0, 0.0, 9.0 * number as f64),
            )),
            ..StereoFrame::pair(view(&left), view(&right))
        };
        mapper.step(&given, executor).unwrap()
    };
    (0..FRAMES).map(&mut step).collect()
}

#[test]
fn no_input_costs_more_than_the_bound_and_each_unit_comes_up() {
    let config = Walk::config();
    let bound = FULL.work(&config);
    let mut most = [0; WorkUnits::COUNT];
    for input in [Input::Noise, Input::Ramp, Input::Jump, Input::Black] {
        for (frame, work) in run(input, &config).iter().enumerate() {
            for ((name, units), (_, bound)) in work.named().into_iter().zip(bound.named()) {
                assert!(units <= bound, "{input:?}, frame {frame}: {units} {name} of {bound}");
            }
            most.iter_mut().zip(work.named()).for_each(|(most, (_, n))| *most = n.max(*most));
        }
    }
    for ((name, _), most) in bound.named().into_iter().zip(most) {
        // Given poses need no picture of the map; a test of its own has those.
        assert!(most > 0 || name == "cast_pixels", "no {name}: no input reaches that stage");
    }
    // Lists that noise fills to the last entry.
    let [pixels, candidates, _, features, _, _, _, _, _, fused, _] = most;
    let full = [bound.stereo_pixels, bound.support_candidates, bound.features, bound.fused_voxels];
    std::println!("most {most:?} of {:?}", bound.named());
    assert_eq!([pixels, candidates, fused], [full[0], full[1], full[3]]);
    assert!(2 * features > full[2], "{features} features of {}", full[2]);
}

#[test]
fn a_frame_that_is_not_fused_moves_no_voxel() {
    let mut config = Walk::config();
    config.mapper.fuse_every = 2;
    let work = run(Input::Noise, &config);
    assert!(work[0].fused_voxels > 0 && work[1].fused_voxels == 0, "{:?}", &work[..2]);
    assert_eq!([work[1].block_requests, work[1].pruned_voxels], [0, 0]);
}

/// Units that a budget cuts while images are matched.
const CUT: [&str; 6] = [
    "stereo_pixels",
    "support_candidates",
    "triangles",
    "features",
    "compared_descriptors",
    "circles",
];

#[test]
fn a_budget_holds_in_every_frame_and_gives_the_same_bits_on_two_threads() {
    let mut config = Walk::config();
    let bound = FULL.work(&config);
    for share in [0.75, 0.5, 0.25] {
        config.mapper.work_budget = share;
        let within = |units: u64, bound: u64| units as f64 <= bound as f64 * f64::from(share);
        let serial = reports(Input::Noise, &config, &Serial);
        for Report { work, frame, .. } in &serial {
            assert!(within(work.fused_voxels, bound.fused_voxels), "{share}, frame {frame}");
            assert!(within(work.pruned_voxels, bound.pruned_voxels), "{share}, frame {frame}");
        }
        for input in [Input::Noise, Input::Ramp, Input::Black] {
            for work in run(input, &config) {
                let pairs = work.named().into_iter().zip(bound.named());
                for (done, most) in pairs.filter(|(done, _)| CUT.contains(&done.0)) {
                    assert!(within(done.1, most.1), "{share}, {input:?}: {done:?} of {most:?}");
                }
            }
        }
        // The budget is felt, and something is mapped nevertheless.
        assert!(serial.iter().any(|report| report.deferred.fused_blocks > 0), "{share}");
        assert!(serial.iter().any(|report| report.work.fused_voxels > 0), "{share}");
        let threads = reports(Input::Noise, &config, &TwoThreads);
        let digests =
            |reports: &[Report]| reports.iter().map(|report| report.digest).collect::<Vec<_>>();
        assert_eq!(digests(&serial), digests(&threads), "{share}");
    }
    config.mapper.work_budget = 1.0;
    let whole = reports(Input::Noise, &config, &Serial);
    assert!(
        whole.iter().all(|report| report.deferred == DeferredWork::default()),
        "all of the bound"
    );
}
