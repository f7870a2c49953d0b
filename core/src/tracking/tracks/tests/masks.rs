//! Which depth the static map does not get.

use super::*;
use crate::image::ViewMut;

/// The box cleared of depth in a frame, and how many pixels of it.
fn cleared(
    tracker: &mut Tracker<'_>,
    frame: u32,
    detections: &[Detection<'_>],
) -> Option<(PixelBox, u32)> {
    ingest(tracker, frame, detections, [WIDTH, HEIGHT]);
    let mut depth = vec![5.0f32; WIDTH * HEIGHT];
    tracker.mask_dynamic_depth(&mut ViewMut::new(&mut depth, WIDTH, HEIGHT).unwrap());
    tracker.commit();
    let pixels = || {
        (0..)
            .zip(&depth)
            .filter(|(_, depth)| **depth == 0.0)
            .map(|(at, _)| (at % WIDTH as i32, at / WIDTH as i32))
    };
    let (left, right) = (pixels().map(|(u, _)| u).min()?, pixels().map(|(u, _)| u).max()?);
    let (top, bottom) = (pixels().map(|(_, v)| v).min()?, pixels().map(|(_, v)| v).max()?);
    let pixels = PixelBox { left, top, width: right + 1 - left, height: bottom + 1 - top };
    Some((pixels, tracker.report.pixels_masked))
}

#[test]
fn a_missed_object_is_kept_out_of_the_static_map_for_three_frames() {
    with(&CAPACITY, &TrackingConfig::default(), |tracker, _| {
        take(tracker, 0, &[car(100)]);
        take(tracker, 1, &[car(110)]);
        for (frame, left) in [(2, 120), (3, 130), (4, 140)] {
            let expected = PixelBox { left, top: 30, width: 60, height: 60 }.scaled(1200);
            assert_eq!(cleared(tracker, frame, &[]), Some((expected, 72 * 72)), "frame {frame}");
        }
        assert_eq!(cleared(tracker, 5, &[]), None, "it may be anywhere");
        let found = PixelBox { left: 150, top: 30, width: 60, height: 60 }.scaled(1200);
        assert_eq!(
            cleared(tracker, 6, &[car(150)]),
            Some((found, 72 * 72)),
            "found again: nowhere else"
        );
        assert_eq!(
            tracker.tracks().next().map(|track| (track.id, track.detected)),
            Some((1, true))
        );
    });
}

#[test]
fn an_object_seen_once_or_too_small_is_not_kept_out_longer() {
    with(&CAPACITY, &TrackingConfig::default(), |tracker, _| {
        take(tracker, 0, &[car(100)]);
        assert_eq!(cleared(tracker, 1, &[]), None, "a ghost");
    });
    let small = detection(
        Class::Car,
        0.9,
        &PixelBox { left: 100, top: 30, width: 12, height: 12 },
        &MASK[..144],
    );
    with(&CAPACITY, &TrackingConfig::default(), |tracker, _| {
        (0..3).for_each(|frame| drop(take(tracker, frame, &[small])));
        assert_eq!(cleared(tracker, 3, &[]), None);
    });
}

#[test]
fn the_static_map_sees_nothing_under_any_delete_mask_tracked_or_not() {
    let mask = vec![1; 3600];
    let walker = detection(Class::Person, 0.6, &pixels(300, 30, 60, 60), &mask);
    let car = detection(Class::Car, 0.9, &pixels(20, 30, 60, 60), &mask);
    let config = TrackingConfig::default();
    // A table of one track: the walker, of lower score, gets none.
    with(&Capacity { tracks: 1, ..CAPACITY }, &config, |tracker, _| {
        ingest(tracker, 0, &[walker, car], [WIDTH, HEIGHT]);
        assert_eq!((tracker.report.tracks.tracks, tracker.report.tracks.refused), (1, 1));
        let mut depth = vec![5.0f32; WIDTH * HEIGHT];
        tracker.mask_dynamic_depth(&mut ViewMut::new(&mut depth, WIDTH, HEIGHT).unwrap());
        for (at, &depth) in depth.iter().enumerate() {
            let (u, v) = ((at % WIDTH) as i32, (at / WIDTH) as i32);
            let under = [pixels(300, 30, 60, 60), pixels(20, 30, 60, 60)]
                .iter()
                .any(|pixels| pixels.scaled(1200).contains(u, v));
            assert_eq!(depth == 0.0, under, "({u}, {v})");
        }
        assert_eq!(tracker.report.pixels_masked, 2 * 72 * 72);
    });
}

#[test]
fn without_dynamic_everything_is_background() {
    let mask = vec![1; 3600];
    let car = detection(Class::Car, 0.9, &pixels(20, 30, 60, 60), &mask);
    with(&CAPACITY, &TrackingConfig { dynamic: false, ..any_size() }, |tracker, _| {
        ingest(tracker, 0, &[car], [WIDTH, HEIGHT]);
        let mut depth = vec![5.0f32; WIDTH * HEIGHT];
        tracker.mask_dynamic_depth(&mut ViewMut::new(&mut depth, WIDTH, HEIGHT).unwrap());
        assert!(depth.iter().all(|&depth| depth == 5.0) && tracker.tracks().count() == 0);
    });
}

/// A board too small to be reconstructed, and its camera.
fn small_car(speed_m_s: f64) -> impl Fn(u32) -> [Transform; 2] {
    move |frame| {
        let t = f64::from(frame) * 0.1;
        [shift(0.0, 0.0, 5.0 * t), shift(1.0, 0.3, 14.0 + speed_m_s * t)]
    }
}

#[test]
fn a_small_object_is_reported_once_measured_and_masked_once_moving() {
    let config = tracked_only();
    for (speed_m_s, state) in [(8.0, MotionState::Dynamic), (0.0, MotionState::Static)] {
        with(&CAPACITY, &config, |tracker, estimator| {
            let mut run = Run::new(tracker, estimator);
            for frame in 0..8 {
                let [camera, car] = small_car(speed_m_s)(frame);
                run.step(camera, &[(&Board::CAR, Some(car))]);
                assert_eq!(run.track(1).is_some(), frame > 0, "frame {frame}");
                let mut depth_m = vec![5.0; WIDTH * HEIGHT];
                run.tracker
                    .mask_dynamic_depth(&mut ViewMut::new(&mut depth_m, WIDTH, HEIGHT).unwrap());
                let moves = run.track(1).is_some_and(|track| track.state == MotionState::Dynamic);
                assert_eq!(depth_m.contains(&0.0), moves, "frame {frame}");
            }
            assert_eq!(run.track(1).unwrap().state, state);
        });
    }
}
