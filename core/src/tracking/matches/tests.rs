//! Which matches count, and for which object.

mod guided_matching;
mod match_owners;

use super::*;
use crate::tracking::tests::*;
use std::{vec, vec::Vec};

fn scored(left: i32, score: f32) -> Detection<'static> {
    Detection { score, ..car(left) }
}

/// Points of an object that moves away from a standing camera by 0.2 m, seen in a band of the box
/// of `car(left)`, no two within 5 px.
fn points(count: u32, left: i32, top: i32, depth_m: f64) -> Vec<Match> {
    let seen = |n: u32| {
        let pixel = [
            f64::from(left) + 5.0 + f64::from(7 * n % 50),
            f64::from(top) + f64::from(13 * n % 20),
        ];
        let z = depth_m * (1.0 + 0.01 * f64::from(n % 5));
        let per_px = z / RIG.focal_px;
        let point = Point3::new(
            (pixel[0] - RIG.center_u_px) * per_px,
            (pixel[1] - RIG.center_v_px) * per_px,
            z,
        );
        let ([previous_left, previous_right], [current_left, current_right]) =
            (project(&point), project(&(point + Vector3::new(0.0, 0.0, 0.2))));
        Match { previous_left, previous_right, current_left, current_right }
    };
    (0..count).map(seen).collect()
}

/// Returns the number of matches that a car counts in its second frame.
fn counted(refined: &[Match], sparse: &[Match]) -> u32 {
    with(&CAPACITY, &any_size(), |tracker, estimator| {
        take_frame(tracker, estimator, 0, &[car(100)], [&[], &[]]);
        take_frame(tracker, estimator, 1, &[car(100)], [refined, sparse]);
        tracker.tracks().next().unwrap().matches
    })
}

#[test]
fn a_match_that_leaves_the_mask_or_enters_it_is_not_counted() {
    let stays = points(20, 100, 35, 10.0);
    let aside = |[u, v]: [f32; 2]| [u + 100.0, v];
    let leaves = points(5, 100, 65, 10.0)
        .into_iter()
        .map(|m| Match { current_left: aside(m.current_left), ..m });
    let entering = points(5, 100, 65, 10.0).into_iter().map(|m| Match {
        previous_left: aside(m.previous_left),
        previous_right: aside(m.previous_right),
        ..m
    });
    let all: Vec<Match> = stays.iter().copied().chain(leaves).chain(entering).collect();
    assert_eq!([counted(&stays, &[]), counted(&all, &[])], [20; 2]);
}

#[test]
fn sparse_matches_fill_up_few_refined_ones_and_count_once() {
    let (few, sparse) = (points(20, 100, 35, 10.0), points(30, 100, 65, 10.0));
    assert_eq!(counted(&few, &sparse), 50);
    let again =
        |m: &Match| Match { current_left: [m.current_left[0] + 0.5, m.current_left[1]], ..*m };
    let with_doubles: Vec<Match> =
        sparse.iter().copied().chain(few.iter().take(5).map(again)).collect();
    assert_eq!(counted(&few, &with_doubles), 50, "the same feature says nothing new");
    assert_eq!(counted(&points(60, 100, 35, 10.0), &sparse), 60, "enough are enough");
}

#[test]
fn matches_through_windows_and_before_the_car_are_not_counted() {
    let own = points(20, 100, 35, 10.0);
    let behind = points(5, 100, 65, 60.0);
    let before = points(5, 100, 65, 3.0);
    for other in [behind, before] {
        let all: Vec<Match> = own.iter().copied().chain(other).collect();
        assert_eq!(counted(&all, &[]), 20);
    }
}

#[test]
fn an_object_seen_for_the_first_time_has_no_matches() {
    with(&CAPACITY, &any_size(), |tracker, estimator| {
        take_frame(tracker, estimator, 0, &[car(100)], [&[], &[]]);
        take_frame(tracker, estimator, 1, &[car(250)], [&points(30, 250, 35, 10.0), &[]]);
        let matches: Vec<(u32, u32)> =
            tracker.tracks().map(|track| (track.id, track.matches)).collect();
        assert_eq!(matches, [(1, 0), (2, 0)]);
    });
}
