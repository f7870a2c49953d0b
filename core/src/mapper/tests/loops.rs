//! A camera that comes back to where it has been without having been lost.

use super::resume::{restored, saved};
use super::*;
use crate::{
    FixError,
    places::{LoopCounts, PoseFix},
};

const WITH_PLACES: Capacity = Capacity { keyframes: 80, ..CAPACITY };
/// Frames of a full turn, and a few that go over its beginning again.
const TURN: usize = 80;
const FRAMES: usize = TURN + 18;

/// Pose of frame `at` of a camera that turns about a point 0.4 m behind it.
fn turning(at: usize) -> Transform {
    let turn = core::f64::consts::TAU * at as f64 / TURN as f64;
    Transform::new([0.0, turn, 0.0], [0.0; 3]) * Transform::from_translation([0.0, 0.0, 0.4])
}

fn step(mapper: &mut Mapper<'_>, at: usize) -> Report {
    let pair = see(&turning(at));
    let [left, right] = pair.each_ref().map(|pixels| View::new(pixels, WIDTH, HEIGHT).unwrap());
    mapper.step(&StereoFrame::pair(left, right), &Serial).unwrap()
}

#[test]
fn a_full_turn_is_recognised() {
    let mut slab = vec![0u8; WITH_PLACES.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&WITH_PLACES, &Walk::config(), &mut slab).unwrap();
    let mut moved = 0;
    for at in 0..FRAMES {
        moved += u32::from(step(&mut mapper, at).world_moved);
        if at == TURN / 2 {
            assert_eq!(mapper.loops(), LoopCounts::default(), "nothing was seen before");
        }
    }
    let counts = mapper.loops();
    assert!(counts.closures > 0 && counts.refused + counts.taken_out == 0, "{counts:?}");
    assert_eq!(moved, counts.moved, "{counts:?}");
    assert!(moved > 0 && mapper.static_map().is_bent(), "the map moves with its keyframes");
    // What it holds says where a full turn ends: at its beginning.
    assert!(mapper.held_loops().count() > 0);
    for held in mapper.held_loops() {
        let [from, to] = [held.from_frame, held.to_frame].map(|frame| turning(frame as usize));
        let off = (from.inverse() * to).inverse() * held.t_from_to;
        assert!(off.distance_m() < 0.1 && off.angle_rad() < 0.02, "{held:?}");
    }
}

#[dynvox_needs::long]
#[test]
fn a_snapshot_while_a_loop_is_closed_goes_on_closing_it() {
    let go_on = |mapper: &mut Mapper<'_>, from: usize| {
        let moved: Vec<bool> = (from..FRAMES).map(|at| step(mapper, at).world_moved).collect();
        (moved, mapper.loops(), mapper.corrected_keyframes().collect::<Vec<_>>())
    };
    let mut slab = vec![0u8; WITH_PLACES.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&WITH_PLACES, &Walk::config(), &mut slab).unwrap();
    let found = (0..FRAMES).find(|&at| {
        step(&mut mapper, at);
        mapper.loops().closures > 0
    });
    let next = found.expect("the loop is found") + 3;
    (next - 2..next).for_each(|at| {
        step(&mut mapper, at);
    });
    assert_eq!(mapper.loops().moved, 0, "a solution takes several frames");
    let bytes = saved(&mut mapper);
    let expected = go_on(&mut mapper, next);
    let again = |mapper: &mut Mapper<'_>| go_on(mapper, next);
    assert_eq!(restored(&WITH_PLACES, &Walk::config(), &bytes, again), Ok(expected));
}

#[test]
fn a_surveyed_pose_moves_the_keyframes_and_not_the_camera() {
    let mut slab = vec![0u8; WITH_PLACES.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&WITH_PLACES, &Walk::config(), &mut slab).unwrap();
    let mut last = step(&mut mapper, 0);
    for at in 1..20 {
        last = step(&mut mapper, at);
    }
    assert_eq!(mapper.t_closed_driven(), Transform::IDENTITY);
    // As if the way so far had been 4 cm too short.
    let [x, y, z] = last.t_world_camera.translation_m;
    let fix = PoseFix::of_position([x, y, z + 0.04], [1e-3; 3], &last.t_world_camera);
    assert_eq!(mapper.add_position([x, y, z + 0.04], [1e-3; 3]), Ok(()));
    assert_eq!(mapper.add_fix(&fix), Err(FixError::Nowhere), "that keyframe has one");
    let wild = PoseFix { t_world_camera: Transform::from_translation([1e9, 0.0, 0.0]), ..fix };
    assert_eq!(mapper.add_fix(&wild), Err(FixError::Pose));
    let certain = PoseFix::of_position([x, y, z], [0.0; 3], &last.t_world_camera);
    assert_eq!(mapper.add_fix(&certain), Err(FixError::Covariance));
    let moved = (20..32).filter(|&at| step(&mut mapper, at).world_moved).count();
    let counts = mapper.loops();
    assert_eq!((moved, counts.fixes, counts.taken_out), (1, 1, 0), "{counts:?}");
    let [_, _, ahead_m] = mapper.t_closed_driven().transform_point([x, y, z]);
    assert!((ahead_m - z - 0.04).abs() < 0.01, "{ahead_m} m for {z} m");
}
