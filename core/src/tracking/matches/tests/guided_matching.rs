//! Guided matching, on a wall of a textured box that a detector takes for a car.

use super::super::guided_matching::step_px;
use super::*;
use crate::{
    Serial,
    image::View,
    memory::SLAB_ALIGN,
    scene_flow::{FlowMatcher, SceneFlowConfig, test_scene},
};

/// Depth of the box's far wall at the origin, m.
const WALL_M: f64 = 14.0;

/// A piece of it.
const PIECE: PixelBox = PixelBox { left: 150, top: 60, width: 90, height: 40 };

const SIZE: [usize; 2] = [test_scene::WIDTH, test_scene::HEIGHT];

fn capacity() -> Capacity {
    Capacity { image_width: test_scene::WIDTH, image_height: test_scene::HEIGHT, ..CAPACITY }
}

/// Drives towards the wall at 3 m/s, says that the camera did `camera_m_s`, and looks on the piece
/// with or without images. No match of the scene flow is handed over.
fn run(camera_m_s: f64, with_images: bool) -> Vec<TrackReport> {
    let capacity = capacity();
    let mut slab = vec![0u8; FlowMatcher::bytes(&capacity) + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut carver = Carver::new(&mut slab[start..], FlowMatcher::bytes(&capacity)).unwrap();
    let mut matcher = FlowMatcher::new_in(&capacity, &mut carver);
    let mask = vec![1; PIECE.area() as usize];
    let detection = Detection {
        class: Class::Car,
        score: 0.9,
        left: PIECE.left,
        top: PIECE.top,
        width: PIECE.width as u32,
        height: PIECE.height as u32,
        mask: &mask,
    };
    with(&capacity, &of_any_size(), |tracker, estimator| {
        (0..6)
            .map(|frame| {
                let at_m = 0.3 * f64::from(frame);
                let images = test_scene::see(&shift(0.0, 0.0, at_m));
                let [left, right] = [0, 1].map(|side| {
                    View::new(&images[side], test_scene::WIDTH, test_scene::HEIGHT).unwrap()
                });
                matcher.push(&SceneFlowConfig::default(), left, right, &Serial);
                let q8 = (test_scene::RIG.focal_px * test_scene::RIG.baseline_m / (WALL_M - at_m)
                    * 256.0) as u16;
                let disparity = vec![q8; test_scene::WIDTH * test_scene::HEIGHT];
                let disparity =
                    View::new(&disparity, test_scene::WIDTH, test_scene::HEIGHT).unwrap();
                let camera = CameraMotion {
                    t_world_camera: shift(0.0, 0.0, 0.1 * camera_m_s * f64::from(frame)),
                    t_current_previous: (frame > 0).then(|| shift(0.0, 0.0, -0.1 * camera_m_s)),
                };
                let search = with_images
                    .then_some(GuidedMatching { matcher: &matcher, disparity_q8: disparity });
                let detected = tracker.detect(frame, &[detection], SIZE, FrameMatches::default());
                detected
                    .assign_matches()
                    .estimate_motions(&test_scene::RIG, &camera, search, estimator)
                    .commit();
                tracker.tracks().next().unwrap()
            })
            .collect()
    })
}

/// No detection is too small to be tracked or reconstructed.
fn of_any_size() -> TrackingConfig {
    let mut config = any_size();
    config.instances.track_area_min_px = 0;
    config
}

#[test]
fn an_object_without_matches_is_searched_for_until_static() {
    let tracks = run(3.0, true);
    for track in &tracks[1..] {
        assert!(track.measured && track.matches > 40 && track.inliers > 40, "{track:?}");
        assert!(track.speed_m_s.unwrap()[0] < 0.5, "{track:?}");
    }
    assert_eq!(tracks[5].state, MotionState::Static);
    assert!(run(3.0, false).iter().all(|track| !track.measured), "there is nothing else to go by");
}

#[test]
fn what_moves_is_found_where_it_went_and_not_where_it_was_sought() {
    // The camera is said to stand: what comes nearer moves.
    let tracks = run(0.0, true);
    let [speed, _] = tracks[5].speed_m_s.unwrap();
    assert!((speed - 3.0).abs() < 0.3, "{speed} m/s");
    assert_eq!(tracks[5].state, MotionState::Dynamic);
}

#[test]
fn the_grid_is_no_finer_than_three_pixels_and_holds_at_most_its_capacity() {
    for [width, height] in [[20, 30], [48, 48], [120, 90], [1242, 375]] {
        let step = step_px(width, height);
        let points = (width / step) * (height / step);
        assert!(
            step >= 3 && points <= MAX_GUIDED_MATCHES as i32,
            "{width} x {height}: {step}, {points}"
        );
        assert!(
            step == 3 || points * 3 > MAX_GUIDED_MATCHES as i32,
            "{width} x {height}: {step}, {points}"
        );
    }
}
