//! Owners of matches, and which of them egomotion may use.

use super::*;
use crate::tracking::motion::MotionEvidence;

fn at(u: f32) -> Match {
    Match { current_left: [u, 60.0], ..Match::default() }
}

#[test]
fn a_match_belongs_to_its_copy_mask_where_delete_masks_overlap() {
    with(&CAPACITY, &any_size(), |tracker, _| {
        // The first one's mask ends at 99, its delete mask at 105; the second's begins at 101.
        ingest(tracker, 0, &[scored(40, 0.9), scored(101, 0.5)], [WIDTH, HEIGHT]);
        assign(tracker, &[at(100.0), at(105.0)], &[]);
        assert_eq!(match_owner(tracker, 1), MatchOwner::Instance(1));
    });
}

/// Evidence of that speed without any uncertainty.
fn seen_at(speed_m_s: f32) -> Option<MotionEvidence> {
    Some(MotionEvidence { speed_m_s, sigma_m_s: 0.0, spread_m_s: 0.0, bias_m_s: 0.0 })
}

#[test]
fn a_small_object_takes_its_neighbours_matches_only_once_it_moves() {
    with(&CAPACITY, &tracked_only(), |tracker, _| {
        ingest(tracker, 0, &[scored(40, 0.9), scored(100, 0.5)], [WIDTH, HEIGHT]);
        assign(tracker, &[at(97.0)], &[]);
        assert_eq!(match_owner(tracker, 0), MatchOwner::Instance(0));
        let certain = StateConfig { confirm_frames: 1, ..StateConfig::default() };
        tracker.tracks.all_mut()[1].motion_state.update(&certain, seen_at(9.0));
        assign(tracker, &[at(97.0)], &[]);
        assert_eq!(match_owner(tracker, 0), MatchOwner::Ambiguous);
    });
}

fn with_large_share(large_share: f32) -> TrackingConfig {
    TrackingConfig { matches: MatchesConfig { large_share }, ..any_size() }
}

#[test]
fn egomotion_uses_an_ambiguous_match_only_if_it_may_use_both_objects() {
    for (large_share, included) in [(1.0, true), (0.0, false)] {
        with(&CAPACITY, &with_large_share(large_share), |tracker, _| {
            ingest(tracker, 0, &[scored(40, 0.9), scored(100, 0.5)], [WIDTH, HEIGHT]);
            assign(tracker, &[at(97.0)], &[]);
            assert_eq!(match_owner(tracker, 0), MatchOwner::Ambiguous);
            assert_eq!(tracker.egomotion_mask(&[]).includes(0), included);
        });
    }
}

/// A car 10 m ahead that does 8 m/s to the camera's 5.
fn ahead(frame: u32) -> [Transform; 2] {
    let t = f64::from(frame) * 0.1;
    [shift(0.0, 0.0, 5.0 * t), shift(1.0, 0.3, 10.0 + 8.0 * t)]
}

#[test]
fn a_match_counts_only_from_mask_to_mask() {
    with(&CAPACITY, &any_size(), |tracker, estimator| {
        let mut run = Run::new(tracker, estimator);
        let [camera, car] = ahead(0);
        run.step(camera, &[(&Board::CAR, Some(car))]);
        let [camera, car] = ahead(1);
        run.step(camera, &[(&Board::CAR, Some(car))]);
        let pixels = run.track(1).unwrap().pixels;
        let delete = pixels.scaled(1200);
        let at = |u: i32, v: i32| Match { current_left: [u as f32, v as f32], ..Match::default() };
        let (last, beyond) = (delete.left, delete.left - 1);
        assign(
            run.tracker,
            &[
                at(last, pixels.top + 5),
                at(beyond, pixels.top + 5),
                at(pixels.left + 5, pixels.top + 5),
            ],
            &[],
        );
        assert_eq!(
            [0, 1, 2].map(|at| match_owner(run.tracker, at)),
            [MatchOwner::Instance(0), MatchOwner::None, MatchOwner::Instance(0)]
        );
        assign(run.tracker, &[Match { current_left: [f32::NAN, 5.0], ..Match::default() }], &[]);
        assert_eq!(match_owner(run.tracker, 0), MatchOwner::None);
    });
}

#[test]
fn egomotion_excludes_moving_cars_and_large_ones_of_unknown_state() {
    let included = |config: &TrackingConfig,
                    frames: u32,
                    poses: &dyn Fn(u32) -> [Transform; 2],
                    board: &Board| {
        with(&CAPACITY, config, |tracker, estimator| {
            let mut run = Run::new(tracker, estimator);
            for frame in 0..frames {
                let [camera, car] = poses(frame);
                run.step(camera, &[(board, Some(car))]);
            }
            let pixels = run.track(1).unwrap().pixels;
            let middle = [pixels.left + pixels.width / 2, pixels.top + pixels.height / 2]
                .map(|px| px as f32);
            assign(run.tracker, &[Match { current_left: middle, ..Match::default() }], &[]);
            run.tracker.egomotion_mask(&[]).includes(0)
        })
    };
    let parked = |frame: u32| [shift(0.0, 0.0, 0.5 * f64::from(frame)), shift(1.0, 0.3, 12.0)];
    let config = any_size();
    assert!(!included(&config, 6, &ahead, &Board::CAR), "known to move");
    assert!(included(&config, 6, &parked, &Board::CAR), "known to stand");
    let small = Board { half_m: [0.9, 0.5], ..Board::CAR };
    assert!(included(&config, 1, &ahead, &small), "unknown and small");
    let large = Board { half_m: [2.5, 1.2], ..Board::CAR };
    assert!(!included(&config, 1, &ahead, &large), "unknown and large");
}

#[test]
fn matches_on_the_silhouette_between_two_cars_are_ambiguous() {
    let mask = [1; 3600];
    let boxes = [
        PixelBox { left: 40, top: 30, width: 60, height: 60 },
        PixelBox { left: 100, top: 30, width: 60, height: 60 },
    ];
    with(&CAPACITY, &any_size(), |tracker, _| {
        let cars = boxes.map(|pixels| detection(Class::Car, 0.5, &pixels, &mask));
        ingest(tracker, 0, &cars, [WIDTH, HEIGHT]);
        let at = |u: f32| Match { current_left: [u, 60.0], ..Match::default() };
        assign(tracker, &[at(90.0), at(97.0), at(102.0), at(110.0)], &[]);
        let of_match = |at| match_owner(tracker, at);
        assert_eq!([of_match(1), of_match(2)], [MatchOwner::Ambiguous; 2]);
        assert_ne!(of_match(0), of_match(3));
        assert!(of_match(0) != MatchOwner::Ambiguous && of_match(3) != MatchOwner::Ambiguous);
    });
}
