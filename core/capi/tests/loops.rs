//! Fixes of the caller's, and the disparity that is handed out.
#![allow(missing_docs, clippy::unwrap_used, clippy::indexing_slicing)]
#![expect(
    clippy::undocumented_unsafe_blocks,
    reason = "each call keeps the header's promises, but for the one it breaks on purpose"
)]

mod support;

use dynvox_capi::*;
use std::{mem, ptr};
use support::*;

/// Columns by which the right image is shifted: a wall 5 m away.
const DISPARITY_PX: usize = 10;
/// Columns by which the camera moves in a frame: 0.3 m.
const MOVED_PX: usize = 6;
const FRAMES: usize = 22;

/// Image of a textured wall, from so many columns on.
fn wall(from: usize) -> Vec<u8> {
    let width = WIDTH + FRAMES * MOVED_PX + DISPARITY_PX;
    let noise = |u: usize, v: usize| {
        let at = (v * width + u) as u32;
        u32::from(at.wrapping_mul(2_654_435_761).rotate_left(9) as u8)
    };
    let smooth = |u: usize, v: usize| {
        ((noise(u, v) + noise(u + 1, v) + noise(u, v + 1) + noise(u + 1, v + 1)) / 4) as u8
    };
    (0..WIDTH * HEIGHT).map(|at| smooth(from + at % WIDTH, at / WIDTH)).collect()
}

fn step_at(mapper: *mut DynvoxMapper, at: usize) -> DynvoxReport {
    let (left, right) = (wall(MOVED_PX * at), wall(MOVED_PX * at + DISPARITY_PX));
    let mut given = frame(&left);
    given.right.pixels = right.as_ptr();
    let mut report: DynvoxReport = unsafe { mem::zeroed() };
    let status = unsafe { dynvox_step(mapper, &raw const given, ptr::null(), &raw mut report) };
    assert_eq!(status, DynvoxStatus::Ok);
    report
}

fn with_mapper(
    capacity: &DynvoxCapacity,
    config: &DynvoxConfig,
    test: impl FnOnce(*mut DynvoxMapper),
) {
    let mut buffer = Buffer::holding(capacity);
    let (len, mut mapper) = (buffer.len, ptr::null_mut());
    let made = unsafe { dynvox_create(capacity, config, buffer.at(0), len, &raw mut mapper) };
    assert_eq!(made, DynvoxStatus::Ok);
    test(mapper);
}

fn closed_world(mapper: *mut DynvoxMapper) -> [f64; 3] {
    let mut change = DynvoxPose::default();
    assert_eq!(unsafe { dynvox_closed_world(mapper, &raw mut change) }, DynvoxStatus::Ok);
    change.translation_m
}

#[test]
fn a_position_moves_the_closed_world_alone() {
    let with_places = DynvoxCapacity { keyframes: 40, ..capacity() };
    with_mapper(&with_places, &config(), |mapper| {
        let reports: Vec<_> = (0..10).map(|at| step_at(mapper, at)).collect();
        let last = reports[9];
        let [x, y, z] = last.t_world_camera.translation_m;
        assert!(x > 2.0 && closed_world(mapper) == [0.0; 3]);
        let (position, sigma) = ([x + 0.05, y, z], [1e-3; 3]);
        let add = || unsafe { dynvox_add_position(mapper, position.as_ptr(), sigma.as_ptr()) };
        assert_eq!([add(), add()], [DynvoxStatus::Ok, DynvoxStatus::Fix]);
        let moved = (10..FRAMES).filter(|&at| step_at(mapper, at).world_moved).count();
        let [change_m, ..] = closed_world(mapper);
        assert!(moved == 1 && (change_m - 0.05).abs() < 0.02, "{moved}, {change_m} m");
        let mut pose = DynvoxPose::default();
        assert_eq!(unsafe { dynvox_pose(mapper, &raw mut pose) }, DynvoxStatus::Ok);
        let way_m = pose.translation_m[0] - x;
        assert!((way_m - 0.3 * 12.0).abs() < 0.1, "as driven: {way_m} m");
    });
}

#[test]
fn fixes_that_cannot_be_taken_are_refused() {
    let with_places = DynvoxCapacity { keyframes: 40, ..capacity() };
    let mut pose = DynvoxPose { rotation: [1.0, 0.0, 0.0, 0.0], translation_m: [0.0; 3] };
    let mut covariance: [[f64; 6]; 6] = Default::default();
    with_mapper(&with_places, &config(), |mapper| {
        assert!((0..3).all(|at| step_at(mapper, at).frame == at as u32));
        let add = |pose: &DynvoxPose, covariance: &[[f64; 6]; 6]| unsafe {
            dynvox_add_fix(mapper, pose, covariance.as_ptr().cast())
        };
        assert_eq!(add(&pose, &covariance), DynvoxStatus::Fix, "no direction has an error");
        (0..6).for_each(|at| covariance[at][at] = 0.01);
        pose.rotation[1] = 1.0;
        assert_eq!(add(&pose, &covariance), DynvoxStatus::Pose);
        pose.rotation[1] = 0.0;
        assert_eq!(add(&pose, &covariance), DynvoxStatus::Ok);
        let up = [0.0, -1.0, 0.0];
        let level = |up_camera: *const f64, sigma_rad| unsafe {
            dynvox_add_vertical(mapper, up_camera, up.as_ptr(), sigma_rad)
        };
        assert_eq!(level([0.0; 3].as_ptr(), 0.01), DynvoxStatus::Pose);
        assert_eq!(level(up.as_ptr(), 0.0), DynvoxStatus::Fix, "no angle has an error");
        assert_eq!(level(up.as_ptr(), 0.01), DynvoxStatus::Fix, "that keyframe has one");
        assert_eq!(level(ptr::null(), 0.01), DynvoxStatus::Null);
        let without = unsafe { dynvox_add_fix(mapper, &raw const pose, ptr::null()) };
        assert_eq!(without, DynvoxStatus::Null);
        assert_eq!(unsafe { dynvox_closed_world(mapper, ptr::null_mut()) }, DynvoxStatus::Null);
    });
    with_mapper(&capacity(), &config(), |mapper| {
        assert_eq!(step_at(mapper, 0).frame, 0);
        let status = unsafe { dynvox_add_fix(mapper, &raw const pose, covariance.as_ptr().cast()) };
        assert_eq!(status, DynvoxStatus::Fix, "without keyframes");
    });
}

#[test]
fn a_disparity_is_handed_out_with_its_confidence() {
    let mut asked = config();
    assert_eq!(set(&mut asked, c"stereo.min_confidence", c"1"), DynvoxStatus::Ok);
    for (config, has_confidence) in [(config(), false), (asked, true)] {
        with_mapper(&capacity(), &config, |mapper| {
            let (mut disparity, mut confidence) = ([0; WIDTH * HEIGHT], [0; WIDTH * HEIGHT]);
            let mut to = DynvoxDisparity {
                capacity: WIDTH * HEIGHT,
                disparity_q8: disparity.as_mut_ptr(),
                confidence: confidence.as_mut_ptr(),
                width: 0,
                height: 0,
                has_confidence: false,
            };
            assert_eq!(unsafe { dynvox_disparity(mapper, &raw mut to) }, DynvoxStatus::NoFrame);
            assert_eq!(step_at(mapper, 0).frame, 0);
            assert_eq!(unsafe { dynvox_disparity(mapper, &raw mut to) }, DynvoxStatus::Ok);
            assert_eq!((to.width, to.height, to.has_confidence), (WIDTH, HEIGHT, has_confidence));
            let near = |q8: u16| q8.abs_diff(256 * DISPARITY_PX as u16) < 64;
            let right = disparity.iter().filter(|&&q8| near(q8)).count();
            assert!(10 * right > 7 * disparity.len(), "{right} pixels of the wall");
            let pairs = disparity.iter().zip(&confidence);
            let agree = |(q8, trust): (&u16, &u8)| (*trust > 0) == (has_confidence && *q8 > 0);
            assert!(pairs.into_iter().all(agree));
            to.disparity_q8 = ptr::null_mut();
            assert_eq!(unsafe { dynvox_disparity(mapper, &raw mut to) }, DynvoxStatus::Ok);
            to.capacity -= 1;
            assert_eq!(unsafe { dynvox_disparity(mapper, &raw mut to) }, DynvoxStatus::TooSmall);
        });
    }
}
