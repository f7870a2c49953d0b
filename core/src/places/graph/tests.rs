//! Loops whose truth is known.

use super::*;
use crate::{
    memory::SLAB_ALIGN,
    state::{Hasher, Reader, Writer},
};
use std::{vec, vec::Vec};

const KEYFRAMES: usize = 80;
/// Steps along each side of a square, m.
const SIDE: usize = 20;

fn with_graph<R>(keyframes: usize, test: impl FnOnce(&mut Graph<'_>) -> R) -> R {
    let bytes = Graph::bytes(keyframes);
    let mut slab = vec![0; bytes + SLAB_ALIGN];
    test(&mut Graph::new_in(keyframes, &mut Carver::new(&mut slab, bytes).unwrap()))
}

/// Poses of a camera that walks around a square, a metre a step, and is a little wrong each time.
fn square(steps: usize, error: &Transform) -> (Vec<Transform>, Vec<Transform>) {
    let quarter = Transform::new([0.0, core::f64::consts::FRAC_PI_2, 0.0], [0.0; 3]);
    let ahead = Transform::from_translation([0.0, 0.0, 1.0]);
    let (mut truth, mut driven) = (vec![Transform::IDENTITY], vec![Transform::IDENTITY]);
    for step in 1..steps {
        let motion = if step % SIDE == 0 { ahead * quarter } else { ahead };
        truth.push((truth[step - 1] * motion).normalized());
        driven.push((driven[step - 1] * motion * *error).normalized());
    }
    (truth, driven)
}

fn pose(t_world_camera: Transform) -> SegmentPose {
    SegmentPose { segment: MapSegment::FIRST, t_world_camera }
}

/// Takes keyframes of all poses.
fn walk(graph: &mut Graph<'_>, poses: &[Transform]) {
    walk_with_fixes(graph, poses, usize::MAX, |_| unreachable!());
}

/// Takes keyframes of all poses, and a fix of the last of each so many.
fn walk_with_fixes(
    graph: &mut Graph<'_>,
    poses: &[Transform],
    every: usize,
    fix_of: impl Fn(usize) -> PoseFix,
) {
    let covariance = twist::isotropic(2e-3, 0.02);
    for (at, t_world_camera) in poses.iter().enumerate() {
        let pose = pose(*t_world_camera);
        graph.advance(&Measured { pose: &pose, covariance: Some(&covariance), depth_m: 10.0 });
        graph.insert(0..=at, t_world_camera, at as u32);
        if (at + 1).is_multiple_of(every) {
            assert!(fix(graph, at, &fix_of(at)));
        }
    }
}

fn place_at(slot: usize, t_keyframe_camera: Transform) -> Recognized<'static> {
    let t_world_keyframe = Transform::IDENTITY;
    Recognized { slot, t_world_keyframe, t_keyframe_camera, covariance: None, depth_m: 10.0 }
}

/// Says that the last keyframe is seen from `slot` as `t_keyframe_camera`.
fn close(graph: &mut Graph<'_>, last: usize, slot: usize, t_keyframe_camera: Transform) -> bool {
    let recognized = place_at(slot, t_keyframe_camera);
    graph.close(0..=last, &recognized)
}

/// Largest distance from the truth, m.
fn worst_m(graph: &Graph<'_>, truth: &[Transform]) -> f64 {
    let off = |(at, truth): (usize, &Transform)| {
        (graph.corrected(at).unwrap().1.inverse() * *truth).distance_m()
    };
    largest(truth.iter().enumerate().map(off))
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |a, b| if a > b { a } else { b })
}

/// Steps until the poses change; returns the frames that took.
fn commit(graph: &mut Graph<'_>, len: usize) -> u32 {
    (1..=2 * ROUNDS).find(|_| graph.step(0..len)).expect("it comes to rest")
}

const DRIFT: [f64; 6] = [0.0, 0.002, 0.0, 0.004, 0.003, 0.01];

fn drifting() -> (Vec<Transform>, Vec<Transform>) {
    square(KEYFRAMES, &Transform::IDENTITY.retract(DRIFT))
}

#[test]
fn a_square_with_drift_is_closed_to_the_truth() {
    let (truth, driven) = drifting();
    with_graph(KEYFRAMES, |graph| {
        walk(graph, &driven);
        let before_m = worst_m(graph, &truth);
        assert!(!graph.step(0..KEYFRAMES), "nothing to do without a closure");
        let last = KEYFRAMES - 1;
        assert!(close(graph, last, 0, truth[0].inverse() * truth[last]));
        assert_eq!(commit(graph, KEYFRAMES), ROUNDS);
        let after_m = worst_m(graph, &truth);
        assert!(before_m > 2.0 && after_m < 0.25 * before_m, "{before_m} m, then {after_m} m");
        // The end itself is where the closure says.
        let end = graph.corrected(last).unwrap().1.inverse() * truth[last];
        assert!(end.distance_m() < 0.05 && end.angle_rad() < 0.003, "{end:?}");
        let LoopCounts { moved, last_moved_m, .. } = graph.counts();
        let expected_m = (driven[last].inverse() * truth[last]).distance_m();
        assert!(moved == 1 && (last_moved_m - expected_m).abs() < 0.1, "{last_moved_m} m");
        assert!(!graph.step(0..KEYFRAMES), "and at rest afterwards");
    });
}

#[test]
fn a_wrong_closure_is_weighed_down_and_taken_out() {
    let (truth, driven) = drifting();
    let last = KEYFRAMES - 1;
    let right = |graph: &mut Graph<'_>| {
        // Three right ones: the camera comes back to where it began.
        for slot in 0..3 {
            drive_on(graph, &driven, KEYFRAMES + slot);
            let t = truth[slot].inverse() * truth[last] * along(slot + 1);
            assert!(close(graph, KEYFRAMES + slot, slot, t));
        }
    };
    let end_m = |with_wrong: bool| {
        with_graph(KEYFRAMES + 8, |graph| {
            walk(graph, &driven);
            if with_wrong {
                // Off by 3 m: less than the drift that a way may have, so that it is let in.
                let wrong = Transform::from_translation([3.0, 0.0, 0.0]);
                assert!(close(graph, last, 0, truth[0].inverse() * truth[last] * wrong));
            }
            right(graph);
            commit(graph, KEYFRAMES + 3);
            let counts = graph.counts();
            assert_eq!(counts.taken_out, u32::from(with_wrong), "{counts:?}");
            assert_eq!(graph.closure_len, 3);
            worst_m(graph, &truth)
        })
    };
    let (alone_m, with_wrong_m) = (end_m(false), end_m(true));
    assert!((alone_m - with_wrong_m).abs() < 0.02, "{alone_m} m, {with_wrong_m} m");
}

/// Steps ahead after the last of [`square`].
fn along(steps: usize) -> Transform {
    Transform::from_translation([0.0, 0.0, steps as f64])
}

/// Takes keyframe `at`, a true step after the one before.
fn drive_on(graph: &mut Graph<'_>, driven: &[Transform], at: usize) {
    let t_world_camera = driven[driven.len() - 1] * along(at + 1 - driven.len());
    let pose = pose(t_world_camera);
    let covariance = twist::isotropic(2e-3, 0.02);
    graph.advance(&Measured { pose: &pose, covariance: Some(&covariance), depth_m: 10.0 });
    graph.insert(0..=at, &t_world_camera, at as u32);
}

#[test]
fn a_closure_far_from_what_drifts_is_refused() {
    let (truth, driven) = drifting();
    with_graph(KEYFRAMES, |graph| {
        walk(graph, &driven);
        let last = KEYFRAMES - 1;
        let across = truth[0].inverse() * truth[last] * Transform::new([0.0; 3], [9.0, 0.0, 0.0]);
        let turned = truth[0].inverse() * truth[last] * Transform::new([0.0, 0.5, 0.0], [0.0; 3]);
        assert!(!close(graph, last, 0, across) && !close(graph, last, 0, turned));
        assert_eq!(graph.counts(), LoopCounts { refused: 2, ..LoopCounts::default() });
        assert!(!graph.step(0..KEYFRAMES));
    });
}

#[test]
fn a_keyframe_that_leaves_hands_its_links_and_closures_on() {
    let (truth, driven) = drifting();
    let last = KEYFRAMES - 1;
    let solved = |thinned: bool| -> Vec<Transform> {
        with_graph(KEYFRAMES, |graph| {
            walk(graph, &driven);
            assert!(close(graph, last, 2, truth[2].inverse() * truth[last]));
            let mut slots: Vec<usize> = (0..KEYFRAMES).collect();
            if thinned {
                for removed in [2, 3, 20, 21, 22] {
                    graph.remove(slots.clone().into_iter(), removed);
                    slots.retain(|&slot| slot != removed);
                }
            }
            assert!((0..ROUNDS).any(|_| graph.step(slots.clone().into_iter())));
            [1, 19, 23, 50, last].map(|slot| graph.corrected(slot).unwrap().1).to_vec()
        })
    };
    for (all, few) in solved(false).iter().zip(solved(true)) {
        let apart = all.inverse() * few;
        assert!(apart.distance_m() < 0.03 && apart.angle_rad() < 2e-3, "{apart:?}");
    }
}

#[test]
fn more_closures_than_there_is_memory_for_stay_spread_over_the_way() {
    let (_, driven) = drifting();
    with_graph(16, |graph| {
        let covariance = twist::isotropic(2e-3, 0.02);
        for (at, t_world_camera) in driven.iter().take(16).enumerate() {
            let pose = pose(*t_world_camera);
            graph.advance(&Measured { pose: &pose, covariance: Some(&covariance), depth_m: 10.0 });
            graph.insert(0..=at, t_world_camera, at as u32);
            if at > 2 {
                assert!(close(graph, at, 0, driven[0].inverse() * *t_world_camera));
            }
        }
        assert_eq!((graph.closure_len, closures_max(16)), (4, 4));
        let ends: Vec<u32> = graph.closures.iter().map(|closure| closure.to).collect();
        assert!(ends[0] == 3 && ends[3] == 15 && ends.is_sorted(), "{ends:?}");
    });
}

#[test]
fn a_segment_that_is_joined_comes_to_lie_where_the_place_says() {
    let (truth, _) = square(30, &Transform::IDENTITY);
    // Lost after 15 keyframes: those that follow begin in a world of their own.
    let own = |at: usize| SegmentPose {
        segment: MapSegment::new(u16::from(at >= 15)),
        t_world_camera: if at < 15 { truth[at] } else { truth[15].inverse() * truth[at] },
    };
    with_graph(30, |graph| {
        for at in 0..30 {
            let pose = own(at);
            graph.advance(&Measured { pose: &pose, covariance: None, depth_m: 10.0 });
            graph.insert(0..=at, &pose.t_world_camera, at as u32);
        }
        let t_keyframe_camera = truth[4].inverse() * truth[29];
        let recognized = place_at(4, t_keyframe_camera);
        graph.join(0..30, &recognized);
        assert!(worst_m(graph, &truth) < 1e-9);
        assert!(graph.close(0..30, &recognized), "a lost camera may be anywhere");
        commit(graph, 30);
        assert!(worst_m(graph, &truth) < 1e-6);
    });
}

fn digest(graph: &mut Graph<'_>) -> u64 {
    Hasher::digest(|hasher| graph.visit(KEYFRAMES, hasher))
}

#[test]
fn equal_loops_give_equal_bits_wherever_they_are_interrupted() {
    let (truth, driven) = drifting();
    let last = KEYFRAMES - 1;
    let bits = |interrupted: bool| {
        with_graph(KEYFRAMES, |graph| {
            walk(graph, &driven);
            assert!(close(graph, last, 0, truth[0].inverse() * truth[last]));
            (0..4).for_each(|_| assert!(!graph.step(0..KEYFRAMES)));
            if !interrupted {
                commit(graph, KEYFRAMES);
                return digest(graph);
            }
            let mut bytes = Vec::new();
            let mut sink = |piece: &[u8]| -> Result<(), ()> {
                bytes.extend_from_slice(piece);
                Ok(())
            };
            let mut writer = Writer::new(&mut sink);
            graph.visit(KEYFRAMES, &mut writer);
            writer.finish().unwrap();
            with_graph(KEYFRAMES, |other| {
                let mut rest = &bytes[..];
                let mut source =
                    |piece: &mut [u8]| crate::state::in_memory::take(&mut rest, piece).ok_or(());
                let mut reader = Reader::new(&mut source);
                other.visit(KEYFRAMES, &mut reader);
                reader.finish().unwrap();
                commit(other, KEYFRAMES);
                digest(other)
            })
        })
    };
    assert_eq!(bits(false), bits(true));
}

/// Takes a fix of the last keyframe.
fn fix(graph: &mut Graph<'_>, last: usize, fix: &PoseFix) -> bool {
    graph.fix(0..=last, fix)
}

#[test]
fn a_fix_pulls_the_way_there_and_leaves_its_beginning() {
    let (truth, driven) = drifting();
    let last = KEYFRAMES - 1;
    let after_m = |t_world_camera: Transform, rotation_rad: f64| {
        with_graph(KEYFRAMES, |graph| {
            walk(graph, &driven);
            let covariance = twist::isotropic(rotation_rad, 0.02);
            let surveyed = PoseFix { t_world_camera, covariance };
            assert!(fix(graph, last, &surveyed) && !fix(graph, last, &surveyed), "one each");
            assert_eq!(commit(graph, KEYFRAMES), ROUNDS);
            assert_eq!((graph.counts().fixes, graph.counts().closures), (1, 0));
            assert_eq!(graph.held().count(), 0, "no loop");
            assert_eq!(graph.corrected(0).unwrap().1, Transform::IDENTITY);
            let end = graph.corrected(last).unwrap().1.inverse() * truth[last];
            assert!(end.distance_m() < 0.05, "{end:?}");
            worst_m(graph, &truth)
        })
    };
    let before_m = with_graph(KEYFRAMES, |graph| {
        walk(graph, &driven);
        worst_m(graph, &truth)
    });
    let posed_m = after_m(truth[last], 1e-3);
    assert!(posed_m < 0.25 * before_m, "{before_m} m, then {posed_m} m");
    // A position alone, whose turn is the one as driven.
    let position_m = truth[last].translation_m;
    let alone = PoseFix::of_position(position_m, [0.02; 3], &driven[last]);
    let alone_m = after_m(alone.t_world_camera, 10.0);
    assert!(alone_m < 0.5 * before_m, "{before_m} m, then {alone_m} m");
}

#[test]
fn verticals_hold_the_height_of_a_way() {
    const UP: [f64; 3] = [0.0, -1.0, 0.0];
    // Pitch and roll drift, and with them the height.
    let (truth, driven) = square(KEYFRAMES, &Transform::new([0.001, 0.0, 0.0007], [0.0; 3]));
    let off = |graph: &Graph<'_>| {
        let corrected: Vec<_> = (0..KEYFRAMES).map(|at| graph.corrected(at).unwrap().1).collect();
        let pairs = || corrected.iter().zip(&truth);
        let height_m = |(is, truth): (&Transform, &Transform)| {
            libm::fabs(is.translation_m[1] - truth.translation_m[1])
        };
        let tilt_rad = |(is, truth): (&Transform, &Transform)| {
            let [x, _, z] = is.rotate(truth.inverse().rotate(UP));
            libm::hypot(x, z)
        };
        [largest(pairs().map(height_m)), largest(pairs().map(tilt_rad))]
    };
    with_graph(KEYFRAMES, |graph| {
        walk_with_fixes(graph, &driven, 8, |at| {
            PoseFix::of_vertical(truth[at].inverse().rotate(UP), UP, 0.003, &driven[at])
        });
        let [height_m, tilt_rad] = off(graph);
        commit(graph, KEYFRAMES);
        assert_eq!((graph.counts().fixes, graph.counts().taken_out), (10, 0));
        let [then_m, then_rad] = off(graph);
        assert!(height_m > 0.5 && then_m < 0.3 * height_m, "{height_m} m, then {then_m} m");
        assert!(
            tilt_rad > 0.02 && then_rad < 0.3 * tilt_rad,
            "{tilt_rad} rad, then {then_rad} rad"
        );
    });
}

#[test]
fn a_camera_on_its_head_has_no_vertical() {
    let up = [0.0, -1.0, 0.0];
    let of = |up_camera| PoseFix::of_vertical(up_camera, up, 0.003, &Transform::IDENTITY);
    assert!(of([0.1, -2.0, 0.0]).t_world_camera.is_rotation());
    assert!(!of([0.0, 1.0, 0.0]).t_world_camera.is_finite());
    assert!(!of([0.0; 3]).t_world_camera.is_finite());
}

#[test]
fn a_wrong_fix_is_overruled_by_the_others() {
    let (truth, driven) = drifting();
    with_graph(KEYFRAMES, |graph| {
        walk_with_fixes(graph, &driven, 10, |at| {
            let [x, y, z] = truth[at].translation_m;
            let off_m = if at == 49 { 15.0 } else { 0.0 };
            PoseFix::of_position([x + off_m, y, z], [0.1, 0.2, 0.1], &driven[at])
        });
        commit(graph, KEYFRAMES);
        let counts = graph.counts();
        assert_eq!((counts.fixes, counts.taken_out), (8, 1), "{counts:?}");
        let after_m = worst_m(graph, &truth);
        assert!(after_m < 0.5, "{after_m} m");
    });
}

#[test]
fn a_loop_and_a_fix_hold_one_keyframe() {
    let (truth, driven) = drifting();
    let last = KEYFRAMES - 1;
    with_graph(KEYFRAMES, |graph| {
        walk(graph, &driven);
        assert!(close(graph, last, 0, truth[0].inverse() * truth[last]));
        let covariance = twist::isotropic(1e-3, 0.02);
        assert!(fix(graph, last, &PoseFix { t_world_camera: truth[last], covariance }));
        assert!(!close(graph, last, 0, truth[0].inverse() * truth[last]), "known already");
        commit(graph, KEYFRAMES);
        assert_eq!(graph.counts().taken_out, 0);
        assert!(worst_m(graph, &truth) < 0.6);
    });
}

#[test]
fn a_camera_that_is_lost_takes_no_fix() {
    let (truth, driven) = drifting();
    with_graph(KEYFRAMES, |graph| {
        let covariance = twist::isotropic(1e-3, 0.02);
        let surveyed = PoseFix { t_world_camera: truth[9], covariance };
        assert!(!fix(graph, 0, &surveyed), "no keyframe");
        walk(graph, &driven[..10]);
        let elsewhere = SegmentPose { segment: MapSegment::new(1), t_world_camera: truth[9] };
        graph.advance(&Measured { pose: &elsewhere, covariance: None, depth_m: 10.0 });
        assert!(!fix(graph, 9, &surveyed), "another segment");
    });
}

#[test]
fn a_fix_without_an_error_is_refused() {
    let fix = PoseFix::of_position([1.0, 2.0, 3.0], [0.1; 3], &Transform::IDENTITY);
    assert!(fix.has_errors());
    for sigma_m in [[0.1, 0.0, 0.1], [f64::NAN; 3], [f64::INFINITY; 3]] {
        let fix = PoseFix::of_position([0.0; 3], sigma_m, &Transform::IDENTITY);
        assert!(!fix.has_errors(), "{sigma_m:?}");
    }
}
