use super::*;
use crate::input::TrueObject;
use dynvox_core::geometry::Transform;
use dynvox_core::masks::PixelBox;
use dynvox_core::tracking::Class;
use nalgebra::Vector3;

const SIZE: (usize, usize) = (640, 192);
const PIXELS: PixelBox = PixelBox { left: 100, top: 50, width: 80, height: 40 };

fn truth(frame: u32, moving: bool) -> ObjectsTruth {
    // The camera drives and turns; the car drives 1 m a frame and turns by 0.02 rad.
    let f = f64::from(frame);
    let along = if moving {
        Transform::new(Vector3::new(0.0, 0.02, 0.0) * f, Vector3::new(0.0, 0.0, 1.0) * f)
    } else {
        Transform::IDENTITY
    };
    let object = TrueObject {
        id: 7,
        instance: 0,
        pixels: PIXELS,
        t_world_object: Transform::from_translation([3.0, 1.6, 12.0]) * along,
        dimensions_m: [1.8, 1.5, 4.0],
        moving,
        speed_m_s: if moving { 10.0 } else { 0.0 },
    };
    ObjectsTruth {
        t_world_camera: Transform::new(
            Vector3::new(0.0, 0.01, 0.0) * f,
            Vector3::new(0.0, 0.0, 0.8) * f,
        ),
        objects: vec![object],
        unlabelled: Vec::new(),
    }
}

fn track(state: MotionState, motion_world: Transform) -> TrackReport {
    TrackReport {
        id: 1,
        class: Class::Car,
        state,
        score: 1.0,
        detected: true,
        first_frame: 0,
        last_frame: 0,
        sightings: 1,
        pixels: PIXELS,
        speed_m_s: Some([10.5, 0.1]),
        measured: true,
        center_world_m: [0.0; 3],
        motion_world,
        t_world_object: None,
        matches: 50,
        inliers: 40,
        blocks: 0,
    }
}

/// Evaluates a run whose estimated world is the true one moved by `drift`, with each motion off by
/// `error` in the car's frame.
fn errors_of(
    states: &[MotionState],
    moving: &[bool],
    drift: &Transform,
    error: &Transform,
) -> ObjectErrors {
    let mut errors = ObjectErrors::default();
    for (at, (&state, &moving)) in states.iter().zip(moving).enumerate() {
        let frame = at as u32;
        let now = truth(frame, moving);
        let before = truth(frame.saturating_sub(1), moving).objects[0].t_world_object;
        // The motion in the world: the car's own, seen from where it was.
        let motion =
            before * (before.inverse() * now.objects[0].t_world_object * error) * before.inverse();
        let frame = TrackedFrame {
            tracks: &[track(state, drift * motion * drift.inverse())],
            t_world_camera: &(drift * now.t_world_camera),
            truth: &now,
            size: SIZE,
        };
        errors.add(&frame, |_| true);
    }
    errors
}

#[test]
fn a_motion_off_by_two_centimetres_has_that_error_despite_drift() {
    let drift = Transform::new(Vector3::new(0.1, -0.4, 0.05), Vector3::new(30.0, -2.0, 11.0));
    let off = Transform::new(Vector3::new(0.0, 0.001, 0.0), Vector3::new(0.02, 0.0, 0.0));
    let errors =
        errors_of(&[MotionState::Dynamic; 8], &[true; 8], &drift, &off).tracks()[&1].clone();
    assert!((errors.me_t_m.unwrap() - 0.02).abs() < 1e-4, "{errors:?}");
    assert!((errors.me_r_deg.unwrap() - 0.001f64.to_degrees()).abs() < 1e-6);
    assert!((errors.speed_error_m_s.unwrap() - 0.5).abs() < 1e-5);
    assert_eq!((errors.truth, errors.frames, errors.confusion), (7, 8, [[0; 3], [0, 0, 8]]));
}

#[test]
fn a_state_may_take_five_frames_and_no_more() {
    use MotionState::{Dynamic as D, Static as S, Uncertain as U};
    let of = |states: &[MotionState], moving: &[bool]| {
        errors_of(states, moving, &Transform::IDENTITY, &Transform::IDENTITY).tracks()[&1].clone()
    };
    let (m, s) = (true, false);
    // Five uncertain frames are allowed at the beginning, the sixth is late.
    assert_eq!(of(&[U, U, U, U, U, D, D], &[m; 7]).late_frames, 0);
    assert_eq!(of(&[U, U, U, U, U, U, D], &[m; 7]).late_frames, 1);
    // A car that starts: the time begins anew.
    let starting = of(&[S, S, S, S, S, S, S, U, D, D], &[s, s, s, s, s, m, m, m, m, m]);
    assert_eq!((starting.late_frames, starting.flips), (0, 0), "{starting:?}");
    // A static car whose state flickers.
    let flickering = of(&[S, S, S, S, S, S, D, S, U, D], &[s; 10]);
    assert_eq!(
        (flickering.late_frames, flickering.flips, flickering.confusion[0]),
        (3, 3, [1, 7, 2])
    );
}

#[test]
fn what_overlaps_nothing_true_is_not_compared() {
    let mut errors = ObjectErrors::default();
    let elsewhere = TrackReport {
        pixels: PIXELS.moved([70, 0]),
        ..track(MotionState::Dynamic, Transform::IDENTITY)
    };
    let unseen =
        // Predicted tracks were not seen in this frame.
        TrackReport { detected: false, ..track(MotionState::Dynamic, Transform::IDENTITY) };
    let frame = TrackedFrame {
        tracks: &[elsewhere, unseen],
        t_world_camera: &Transform::IDENTITY,
        truth: &truth(0, true),
        size: SIZE,
    };
    errors.add(&frame, |_| true);
    assert!(errors.tracks().is_empty() && errors.figures().is_none());
}

#[test]
fn a_turning_car_is_evaluated_as_a_rigid_body() {
    // Twenty metres ahead a car turns by a degree on the spot. The correct motion has no error; the
    // difference of the two positions in the camera, taken for a motion with the same turn, would
    // be off by 35 cm.
    let before = Transform::from_translation([0.0, 1.6, 20.0]);
    let turn = Transform::new(Vector3::new(0.0, 1f64.to_radians(), 0.0), Vector3::zeros());
    let now = before * turn;
    let motion_world = now * before.inverse();
    let [metres, degrees] = motion_error(&before, &now, &motion_world);
    assert!(metres < 1e-12 && degrees < 1e-6, "{metres} {degrees}");
    let difference = Vector3::from(now.translation_m) - Vector3::from(before.translation_m);
    let shortcut = Transform { translation_m: difference.into(), ..turn };
    assert!((motion_error(&before, &now, &shortcut)[0] - 20.0 * 1f64.to_radians()).abs() < 1e-3);
}

#[test]
fn every_comparison_is_a_row_in_the_order_of_frames() {
    let errors = errors_of(
        &[MotionState::Uncertain, MotionState::Dynamic, MotionState::Dynamic],
        &[true; 3],
        &Transform::IDENTITY,
        &Transform::IDENTITY,
    );
    let rows = errors.comparisons();
    // The first frame has no motion that an error could be of.
    assert_eq!(
        rows.iter().map(|(id, one)| (*id, one.at, one.error.is_some())).collect::<Vec<_>>(),
        [(1, 0, false), (1, 1, true), (1, 2, true)]
    );
    let figures = errors.figures().unwrap();
    assert_eq!((figures.association.unwrap().hota, figures.tracks), (1.0, 1));
    assert_eq!((errors.tracks()[&1].motions, errors.tracks()[&1].moving.len()), (2, 3));
}

#[test]
fn late_tracks_are_counted_by_distance_and_by_what_could_be_seen_of_them() {
    use MotionState::{Static as S, Uncertain as U};
    let one =
        |settled: u32, distance_m: f64, state: MotionState, view: Visibility| TrackComparison {
            at: settled as usize,
            truth: 7,
            moving: false,
            state,
            settled,
            distance_m,
            view,
            error: None,
            true_speed_m_s: 0.0,
            speed_m_s: None,
        };
    let tracks = [
        // Not due yet; then late far away, in time near by.
        vec![
            one(4, 28.0, U, Visibility::Whole),
            one(5, 27.0, U, Visibility::Whole),
            one(6, 19.0, S, Visibility::Whole),
        ],
        // LateStates only while it leaves the picture.
        vec![one(5, 12.0, S, Visibility::Whole), one(6, 11.0, U, Visibility::Cut)],
        // LateStates while there is little of it, cut once.
        vec![one(5, 12.0, U, Visibility::Small), one(6, 11.0, U, Visibility::Cut)],
        // Never due, and too far.
        vec![one(3, 12.0, U, Visibility::Whole)],
        vec![one(9, 32.5, U, Visibility::Whole)],
    ];
    let comparisons = (1..).zip(tracks).collect();
    assert_eq!(
        LateStates::from_comparisons(&comparisons, 0.0..NEAR_M),
        LateStates { tracks: 3, late: 2, late_cut: 1, late_small: 1 }
    );
    assert_eq!(
        LateStates::from_comparisons(&comparisons, NEAR_M..FAR_M),
        LateStates { tracks: 1, late: 1, late_cut: 0, late_small: 0 }
    );
}

#[test]
fn an_object_at_the_border_is_cut_and_one_of_few_pixels_small() {
    let of = |left, top, width, height| {
        Visibility::from_box(&PixelBox { left, top, width, height }, SIZE)
    };
    assert_eq!([of(1, 1, 30, 30), of(1, 1, 638, 190)], [Visibility::Whole; 2]);
    assert_eq!([of(1, 1, 29, 90), of(1, 1, 90, 29)], [Visibility::Small; 2]);
    assert_eq!(
        [of(0, 1, 90, 90), of(1, 0, 9, 9), of(550, 1, 90, 90), of(1, 102, 90, 90)],
        [Visibility::Cut; 4]
    );
}
