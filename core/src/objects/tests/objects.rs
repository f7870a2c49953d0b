//! Objects' own volumes.

use super::*;

fn at(frame: u32) -> [Transform; 2] {
    let t = f64::from(frame) * 0.1;
    [shift(0.0, 0.0, 5.0 * t), shift(1.0, 0.3, 10.0 + 8.0 * t)]
}

#[test]
fn what_was_seen_before_the_motion_was_known_is_fused_when_it_is() {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        let reports: Vec<_> = (0..5)
            .map(|frame| {
                let [camera, car] = at(frame);
                run.step(camera, &[(&Board::CAR, Some(car))])
            })
            .collect();
        let begun: Vec<u32> = reports.iter().map(|report| report.begun).collect();
        assert_eq!(begun, [0, 0, 0, 1, 0], "the motion is confirmed in the fourth frame");
        assert_eq!((reports[3].caught_up, reports[3].fused, reports[4].fused), (3, 1, 1));
        let (summary, object) = run.instances.objects().next().unwrap();
        assert_eq!((summary.frames, summary.state), (2, MotionState::Dynamic));
        // A board square to the camera: its blocks lie in one layer, however far it drove
        // meanwhile.
        let volume = object.volume();
        let layers = volume
            .pool()
            .live()
            .filter_map(|slot| volume.blocks().coord(slot))
            .map(|coord| coord.z);
        let (first, last) = (layers.clone().min().unwrap(), layers.max().unwrap());
        assert!(last - first <= 2, "{first} to {last}");
    });
}

#[test]
fn a_car_lost_for_too_long_is_handed_over_and_begun_anew() {
    // The frame in which it is found again has no motion either.
    for (dynamic_frames, missed, restarts) in [(1, 0, 0), (1, 1, 1), (2, 1, 0), (2, 2, 1)] {
        let config = TrackingConfig {
            state: StateConfig { dynamic_frames, ..StateConfig::default() },
            ..any_size()
        };
        with(&CAPACITY, &config, |instances, estimator| {
            let mut run = Run::new(instances, estimator);
            for frame in 0..16 {
                let [camera, car] = at(frame);
                let seen = !(6..6 + missed).contains(&frame);
                run.step(camera, &[(&Board::CAR, seen.then_some(car))]);
            }
            assert_eq!(run.track(1).unwrap().state, MotionState::Dynamic);
            let reasons: Vec<_> = run.sink.0.iter().map(|retired| retired.1).collect();
            assert_eq!(reasons, vec![Retirement::Restarted; restarts], "{missed} frames missed");
            assert!(run.sink.0.iter().all(|retired| retired.2 > 0), "with what was made of it");
        });
    }
}

#[test]
fn full_volumes_are_handed_over_but_not_in_the_frame_they_grow() {
    let near = Board { half_m: [0.8, 0.5], ..Board::CAR };
    let parked = |x: f64| Some(shift(x, 0.0, 9.0));
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        let camera = |frame: u32| shift(0.0, 0.0, 0.02 * f64::from(frame));
        for frame in 0..8 {
            let boards = [(&near, parked(-3.5)), (&near, parked(0.0)), (&near, parked(3.5))];
            let report = run.step(camera(frame), &boards);
            assert_eq!(report.refused, u32::from(frame >= 2), "three stand, two have volumes");
        }
        // One of the two goes out of sight: its volume goes to the third.
        let id = run.instances.objects().next().unwrap().0.id;
        let lost = run.track(id).unwrap().pixels.left;
        let boards: Vec<_> = [-3.5, 0.0, 3.5]
            .map(|x| {
                let there = project(&Point3::new(x - 0.8, 0.0, 9.0))[0][0] as i32;
                (&near, parked(x).filter(|_| (there - lost).abs() > 40))
            })
            .into();
        for frame in 8..10 {
            run.step(camera(frame), &boards);
        }
        assert_eq!(run.sink.0.len(), 1);
        assert_eq!((run.sink.0[0].0.id, run.sink.0[0].1), (id, Retirement::Displaced));
        assert_eq!(run.instances.objects().count(), 2);
    });
}

#[test]
fn the_forgotten_and_the_last_are_handed_over_too() {
    let tracks = TracksConfig { forget_frames: 3, ..TracksConfig::default() };
    with(&CAPACITY, &TrackingConfig { tracks, ..any_size() }, |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        for frame in 0..16 {
            let [camera, car] = at(frame);
            run.step(camera, &[(&Board::CAR, (!(5..=10).contains(&frame)).then_some(car))]);
        }
        let reasons = |sink: &Retired| {
            sink.0.iter().map(|retired| (retired.0.id, retired.1)).collect::<Vec<_>>()
        };
        assert_eq!(reasons(&run.sink), [(1, Retirement::Forgotten)]);
        let mut sink = Retired::default();
        assert_eq!(run.instances.finish(&mut sink), 1);
        assert_eq!(reasons(&sink), [(2, Retirement::Finished)]);
        assert_eq!(run.instances.objects().count(), 0);
    });
}

#[test]
fn people_are_tracked_but_not_reconstructed() {
    let walker = Board { class: Class::Person, ..Board::CAR };
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        for frame in 0..6 {
            let [camera, t_world_walker] = at(frame);
            run.step(camera, &[(&walker, Some(t_world_walker))]);
        }
        assert_eq!(run.track(1).unwrap().state, MotionState::Dynamic);
        assert_eq!(run.instances.objects().count(), 0);
    });
}

#[test]
fn a_small_object_that_moves_is_tracked_but_not_reconstructed() {
    with(&CAPACITY, &tracked_only(), |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        for frame in 0..8 {
            let [camera, car] = at(frame);
            run.step(camera, &[(&Board::CAR, Some(car))]);
        }
        assert_eq!(run.track(1).unwrap().state, MotionState::Dynamic);
        assert_eq!(run.instances.objects().count(), 0);
    });
}

#[test]
fn an_object_larger_than_its_blocks_refuses_the_rest_and_says_so() {
    with(&Capacity { object_blocks: 20, ..CAPACITY }, &any_size(), |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        let refused: u32 = (0..6)
            .map(|frame| {
                let [camera, car] = at(frame);
                run.step(camera, &[(&Board::CAR, Some(car))]).blocks_refused
            })
            .sum();
        assert!(refused > 0);
        assert!(run.instances.objects().all(|(_, object)| object.volume().pool().len() <= 20));
    });
}

#[test]
fn a_short_ring_of_crops_keeps_the_latest_and_counts_the_rest() {
    with(&Capacity { crop_pixels: 5_000, ..CAPACITY }, &any_size(), |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        let reports: Vec<_> = (0..4)
            .map(|frame| {
                let [camera, car] = at(frame);
                run.step(camera, &[(&Board::CAR, Some(car))])
            })
            .collect();
        assert_eq!(reports.iter().map(|report| report.crops_dropped).sum::<u32>(), 2);
        assert_eq!(reports[3].caught_up, 1);
    });
}

#[test]
fn an_object_stays_where_it_stood_and_is_nowhere_once_it_drove_off() {
    let parked = |frame: u32| [shift(0.0, 0.0, 0.5 * f64::from(frame)), shift(1.0, 0.3, 14.0)];
    for (poses, state) in
        [(at as fn(u32) -> [Transform; 2], MotionState::Dynamic), (parked, MotionState::Static)]
    {
        with(&CAPACITY, &any_size(), |instances, estimator| {
            let mut run = Run::new(instances, estimator);
            let mut last = None;
            for frame in 0..16 {
                let [camera, car] = poses(frame);
                run.step(camera, &[(&Board::CAR, (frame < 6).then_some(car))]);
                let track = run.track(1).unwrap();
                let pose = run.instances.posed().next().map(|pose| pose.t_world_object);
                let expected = match frame {
                    0..2 => None,
                    // That it moves is confirmed a frame later than that it stands.
                    2 if state == MotionState::Dynamic => None,
                    // Seen, or carried on over a frame or a few without a motion.
                    _ if track.t_world_object.is_some() => track.t_world_object,
                    _ if state == MotionState::Static => last,
                    _ => None,
                };
                assert_eq!(pose, expected, "frame {frame} {state:?}");
                last = pose;
            }
            assert_eq!(last.is_some(), state == MotionState::Static);
            assert_eq!(run.instances.objects().count(), 1, "either has its volume");
        });
    }
}

#[test]
fn an_object_of_a_chain_that_broke_is_not_shown_where_the_next_chain_is() {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        for frame in 0..12 {
            let [camera, car] = at(frame);
            run.step(camera, &[(&Board::CAR, (!(6..9).contains(&frame)).then_some(car))]);
            if (9..12).contains(&frame) {
                assert!(run.track(1).unwrap().t_world_object.is_some(), "a new chain has begun");
                assert_eq!(run.instances.posed().count(), 0);
            }
        }
    });
}
