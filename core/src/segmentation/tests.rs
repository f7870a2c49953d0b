//! Moving objects among static points, with closed answers.

mod near_a_wall;
mod patches;
mod world;

use super::*;
use crate::{
    egomotion::Estimator,
    geometry::Transform,
    masks::PixelBox,
    memory::SLAB_ALIGN,
    random::Random,
    scene_flow::{FlowMatcher, Match},
    tracking::{Class, Detection, FrameMatches, OwnerCode, TrackReport, Tracker, TrackingConfig},
};
use std::{vec, vec::Vec};
use world::{CAPACITY, Car, HEIGHT, RIG, WIDTH, World, WorldInput, project};

fn nothing(_: u32) -> Vec<(PixelBox, Vec<u8>)> {
    Vec::new()
}

const OVERTAKING: Car = Car { at: [2.5, 9.0], motion: [0.0, 1.4] };
const PARKED: Car = Car { at: [-3.0, 16.0], motion: [0.0, 0.0] };

#[test]
fn an_overtaking_car_is_found_in_the_third_frame_a_parked_one_never() {
    let world = World { cars: vec![OVERTAKING, PARKED], step_m: 0.8, noise_px: 0.2 };
    let frames = world.run(10, nothing);
    for (frame, (tracks, report)) in (0..).zip(&frames) {
        assert_eq!(tracks.len(), usize::from(frame > 1), "frame {frame}: {report:?}");
        let Some(track) = tracks.first() else { continue };
        assert_eq!(track.class, Class::MovingObject);
        let overlap = world.overlap(frame, &track.pixels);
        assert!(track.detected && overlap > 0.7, "frame {frame}: {overlap} {:?}", track.pixels);
    }
    let track = frames[9].0[0];
    assert_eq!(track.state, crate::tracking::MotionState::Dynamic);
    assert!((track.speed_m_s.unwrap()[0] - 14.0).abs() < 0.5, "{:?}", track.speed_m_s);
}

#[test]
fn where_nothing_moves_nothing_is_found() {
    for step_m in [0.0, 0.4, 1.2] {
        let world =
            World { cars: vec![PARKED, Car { at: [2.0, 12.0], ..PARKED }], step_m, noise_px: 0.3 };
        for (frame, (tracks, report)) in world.run(8, nothing).iter().enumerate() {
            assert_eq!(
                (tracks.len(), report.groups),
                (0, 0),
                "frame {frame} at {step_m} m: {report:?}"
            );
        }
    }
}

#[test]
fn joint_matches_find_a_car_that_keeps_its_distance() {
    // In the image it moves by two thirds of a pixel of disparity a frame, as much as one match
    // errs by.
    let leader = Car { at: [0.5, 18.0], motion: [0.0, 1.4] };
    let world = World {
        cars: vec![leader, Car { at: [-3.5, 26.0], ..PARKED }],
        step_m: 1.4,
        noise_px: 0.2,
    };
    for (frame, (tracks, report)) in world.run(8, nothing).iter().enumerate() {
        assert_eq!(tracks.len(), usize::from(frame > 1), "frame {frame}: {report:?}");
        for track in tracks {
            assert!(
                world.overlap(frame as u32, &track.pixels) > 0.5,
                "frame {frame}: {:?}",
                track.pixels
            );
        }
    }
}

#[test]
fn a_mask_does_not_grow_over_matches_that_do_not_move() {
    // Both cars are at one distance, a metre apart.
    let parked = Car { at: [5.3, 14.0], motion: [0.0, 0.0] };
    let world = World {
        cars: vec![Car { at: [2.5, 14.0], motion: [0.0, 0.0] }, parked],
        step_m: 0.0,
        noise_px: 0.0,
    };
    let (disparity, [middle, beside]) =
        (world.disparity(0), [2.5, 5.3].map(|x| project([x, 1.0, 14.0])[0]));
    let lattice = Lattice::new(&RIG, View::new(&disparity, WIDTH, HEIGHT).unwrap(), None);
    let (mut cells, mut blocked, mut queue) = (vec![0; 3000], vec![0; 3000], vec![0; 3000]);
    let extent = extent::Extent { low: [1.7, 0.3, 13.9], high: [5.4, 1.5, 14.1] };
    let mut is_marked = |blocked: &[u8]| {
        lattice.grow(&extent, blocked, &mut cells, &mut queue).unwrap();
        [middle, beside].map(|[u, v]| lattice.is_own(&cells, u as i32, v as i32))
    };
    assert_eq!(is_marked(&blocked), [true, true]);
    for at in (40..HEIGHT)
        .flat_map(|v| (0..WIDTH).map(move |u| [u as f32, v as f32]))
        .filter(|[u, _]| *u > 285.0)
    {
        lattice.block(
            [at[0], at[1], (RIG.focal_baseline_px_m() / 14.0) as f32],
            false,
            &mut blocked,
        );
    }
    assert_eq!(is_marked(&blocked), [true, false]);
    // A match that moves frees its cell again, one of another disparity does not.
    let [u, v] = beside;
    lattice.block([u, v, 90.0], true, &mut blocked);
    assert_eq!(is_marked(&blocked), [true, false]);
    lattice.block([u, v, (RIG.focal_baseline_px_m() / 14.0) as f32], true, &mut blocked);
    assert_eq!(is_marked(&blocked), [true, true]);
}

#[test]
fn a_mask_reaches_the_left_border_where_only_the_left_camera_sees() {
    // A car 8 m ahead, cut by the border; so near the border that its disparity of 18.75 px is
    // missing, and farther from it than that explains.
    for (unseen, left) in [(24, 0), (60, 60)] {
        let disparity = |at: usize| match (at % WIDTH, at / WIDTH) {
            (u, _) if u < unseen => 0,
            (u, v) if u < 100 && (30..90).contains(&v) => 4_800,
            _ => 1_024,
        };
        let disparity_q8: Vec<u16> = (0..WIDTH * HEIGHT).map(disparity).collect();
        let lattice = Lattice::new(&RIG, View::new(&disparity_q8, WIDTH, HEIGHT).unwrap(), None);
        let extent = extent::Extent { low: [-5.2, -0.5, 7.9], high: [-2.7, 1.0, 8.1] };
        let mut working = (vec![0; cells(&CAPACITY)], vec![0; cells(&CAPACITY)]);
        let pixels = lattice.grow(&extent, &[], &mut working.0, &mut working.1).unwrap();
        assert_eq!((pixels.left, pixels.left + pixels.width), (left, 100), "{pixels:?}");
    }
}

#[test]
fn a_masked_car_is_not_found_twice() {
    let world = World { cars: vec![OVERTAKING], step_m: 0.8, noise_px: 0.2 };
    let mask = |frame: u32| vec![world.mask(frame)];
    for (frame, (tracks, report)) in world.run(6, mask).iter().enumerate() {
        assert_eq!((tracks.len(), report.instances), (1, 0), "frame {frame}: {report:?}");
    }
}

#[test]
fn a_detector_that_comes_later_takes_the_track_over() {
    let world = World { cars: vec![OVERTAKING], step_m: 0.8, noise_px: 0.2 };
    let mask = |frame: u32| if frame < 5 { Vec::new() } else { vec![world.mask(frame)] };
    let frames = world.run(8, mask);
    let (tracks, report) = &frames[7];
    assert_eq!(
        (tracks.len(), tracks[0].id, tracks[0].class, report.instances),
        (1, 1, Class::Car, 0)
    );
}

#[test]
fn a_car_that_is_hidden_from_the_matches_is_predicted_for_three_frames() {
    // The car moves for three frames, and stands from then on.
    let world = World { cars: vec![OVERTAKING], step_m: 0.8, noise_px: 0.2 };
    let static_world =
        World { cars: vec![Car { motion: [0.0, 0.0], ..OVERTAKING }], step_m: 0.8, noise_px: 0.2 };
    let mut storage = vec![Hypothesis::default(); MAX_HYPOTHESES];
    let mut hypotheses = Hypotheses::new(&mut storage);
    let config = SegmentationConfig::default();
    let model = |camera: &CameraMotion| {
        StaticModel::new(&config, &RIG, &camera.t_current_previous.unwrap(), [0.25, 0.0])
    };
    let bytes = MotionSegmenter::bytes(&CAPACITY);
    let mut slab = vec![0u8; bytes + SLAB_ALIGN];
    let mut carver = Carver::new(&mut slab, bytes).unwrap();
    let mut segmenter = MotionSegmenter::new_in(&CAPACITY, &mut carver);
    core::mem::swap(&mut segmenter.hypotheses, &mut hypotheses);
    let mut confirmed = Vec::new();
    for frame in 1..9 {
        let shown = if frame < 4 { &world } else { &static_world };
        let (camera, matches) = (shown.camera(frame), shown.matches(frame));
        let codes = vec![OwnerCode::default(); matches.len()];
        let disparity = shown.disparity(frame);
        let lattice = Lattice::new(&RIG, View::new(&disparity, WIDTH, HEIGHT).unwrap(), None);
        let contradictions = Contradictions {
            model: &model(&camera),
            t_world_camera: &camera.t_world_camera,
            refined: Owned { matches: &matches, codes: &codes, variance: 1.0 },
            sparse: Owned { matches: &[], codes: &[], variance: SPARSE_VARIANCE },
            lattice: &lattice,
        };
        // Without images: matches alone.
        segmenter.observe(&contradictions, None);
        confirmed.push(
            segmenter.hypotheses.all().iter().filter(|hypothesis| hypothesis.is_shown()).count(),
        );
    }
    // Confirmed in the second frame, and predicted three frames beyond the third.
    assert_eq!(confirmed, [0, 1, 1, 1, 1, 1, 0, 0]);
}
