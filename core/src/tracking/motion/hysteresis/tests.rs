//! The hysteresis, on scripts of speeds.

use super::{MotionState::*, *};

/// The published thresholds at 10 Hz: 0.03 m and 0.55 m a frame, no error, no confirmation.
const PUBLISHED: StateConfig = StateConfig {
    dynamic_m_s: 5.5,
    static_m_s: 0.3,
    slow_m_s: 0.3,
    confirm_frames: 1,
    confirm_static_frames: 1,
    dynamic_frames: 1,
};

fn seen(metres_per_frame: f32) -> Option<MotionEvidence> {
    Some(MotionEvidence {
        speed_m_s: metres_per_frame * 10.0,
        sigma_m_s: 0.0,
        spread_m_s: 0.0,
        bias_m_s: 0.0,
    })
}

fn states(config: &StateConfig, frames: &[Option<MotionEvidence>]) -> std::vec::Vec<MotionState> {
    let mut hysteresis = MotionHysteresis::default();
    frames.iter().map(|observed| hysteresis.update(config, *observed)).collect()
}

#[test]
fn published_thresholds_decide_to_the_millimetre() {
    assert_eq!(states(&PUBLISHED, &[seen(0.031), seen(0.549)]), [Uncertain, Uncertain]);
    assert_eq!(states(&PUBLISHED, &[seen(0.031), seen(0.029)]), [Uncertain, Static]);
    assert_eq!(states(&PUBLISHED, &[seen(0.549), seen(0.551)]), [Uncertain, Dynamic]);
}

#[test]
fn a_mover_outlives_one_frame_without_motion_and_a_parked_one_five() {
    let gap = |first: f32, frames: usize| {
        let mut script = std::vec![seen(first)];
        script.resize(1 + frames, None);
        *states(&PUBLISHED, &script).last().unwrap()
    };
    assert_eq!([1, 2].map(|frames| gap(0.6, frames)), [Dynamic, Uncertain]);
    assert_eq!([1, 5, 6].map(|frames| gap(0.0, frames)), [Static, Static, Uncertain]);
}

#[test]
fn every_motion_starts_the_count_of_frames_without_one_anew() {
    let script = [seen(0.6), None, seen(0.4), None, seen(0.4), None, None];
    assert_eq!(
        states(&PUBLISHED, &script),
        [Dynamic, Dynamic, Dynamic, Dynamic, Dynamic, Dynamic, Uncertain]
    );
}

#[test]
fn between_the_thresholds_a_state_is_kept_and_none_is_won() {
    let script = [seen(0.3), seen(0.3), seen(0.01), seen(0.3), seen(0.3), seen(0.3)];
    assert_eq!(states(&PUBLISHED, &script), [Uncertain, Uncertain, Static, Static, Static, Static]);
}

#[test]
fn stopping_and_starting_need_two_frames_in_a_row() {
    let script = [
        seen(1.0),
        seen(0.0),
        seen(1.0),
        seen(0.0),
        seen(0.0),
        seen(1.0),
        seen(0.0),
        seen(1.0),
        seen(1.0),
    ];
    assert_eq!(
        states(&PUBLISHED, &script),
        [Dynamic, Dynamic, Dynamic, Dynamic, Static, Static, Static, Static, Dynamic]
    );
}

#[test]
fn confirmation_is_counted_in_motions_in_a_row() {
    let config = StateConfig { confirm_frames: 3, ..PUBLISHED };
    let script = [seen(1.0), seen(1.0), seen(0.2), seen(1.0), seen(1.0), seen(1.0)];
    let mut expected = [Uncertain; 6];
    expected[5] = Dynamic;
    assert_eq!(states(&config, &script), expected);
}

#[test]
fn standing_and_moving_are_confirmed_by_counts_of_their_own() {
    let config = StateConfig { confirm_frames: 3, confirm_static_frames: 2, ..PUBLISHED };
    assert_eq!(states(&config, &[seen(0.0), seen(0.0)]), [Uncertain, Static]);
    assert_eq!(
        states(&config, &[seen(1.0), seen(1.0), seen(1.0)]),
        [Uncertain, Uncertain, Dynamic]
    );
    assert_eq!(
        states(&config, &[seen(0.0), seen(0.2), seen(0.0), seen(0.0)]),
        [Uncertain, Uncertain, Uncertain, Static]
    );
}

#[test]
fn one_frame_without_a_motion_does_not_undo_a_state_but_two_do() {
    let config = StateConfig { confirm_frames: 3, ..PUBLISHED };
    let last = |script: &[Option<MotionEvidence>]| *states(&config, script).last().unwrap();
    assert_eq!(last(&[seen(1.0), seen(1.0), None, seen(1.0)]), Dynamic);
    assert_eq!(last(&[seen(1.0), seen(1.0), None, None, seen(1.0)]), Uncertain);
    assert_eq!(last(&[seen(1.0), seen(1.0), None, None, seen(1.0), seen(1.0), seen(1.0)]), Dynamic);
}

#[test]
fn a_mover_must_be_seen_to_stop_before_it_is_static() {
    let config =
        StateConfig { confirm_frames: 1, confirm_static_frames: 1, ..StateConfig::default() };
    let far = |speed_m_s| {
        Some(MotionEvidence { speed_m_s, sigma_m_s: 0.5, spread_m_s: 0.5, bias_m_s: 0.0 })
    };
    assert_eq!(states(&config, &[far(0.6)]), [Static]);
    assert_eq!(states(&config, &[far(0.8)]), [Uncertain], "it may be walking");
    assert_eq!(
        states(&config, &[seen(1.0), far(0.6), far(0.6), far(0.05), far(0.05)]),
        [Dynamic, Dynamic, Dynamic, Dynamic, Static]
    );
}

#[test]
fn a_noisy_motion_proves_nothing() {
    let config = StateConfig { slow_m_s: 5.5, ..PUBLISHED };
    let classified = |speed_m_s, sigma_m_s| {
        MotionEvidence { speed_m_s, sigma_m_s, spread_m_s: sigma_m_s, bias_m_s: 0.0 }
            .classify(&config, Uncertain)
    };
    assert_eq!([classified(8.1, 1.0), classified(8.1, 1.5)], [Dynamic, Uncertain]);
    // A far car that seems to do 2 m/s, give or take 1.5, stands as far as one can tell; give
    // or take 4 nothing can be told.
    assert_eq!(
        [classified(2.0, 1.5), classified(2.0, 4.0), classified(2.0, 0.5)],
        [Static, Uncertain, Uncertain]
    );
    let biased = |bias_m_s| {
        MotionEvidence { speed_m_s: 8.0, sigma_m_s: 0.0, spread_m_s: 0.0, bias_m_s }
            .classify(&config, Uncertain)
    };
    assert_eq!(
        [biased(2.0), biased(3.0)],
        [Dynamic, Uncertain],
        "nor does one the lens could make"
    );
    assert_eq!([classified(f32::NAN, 0.0), classified(0.0, f32::INFINITY)], [Uncertain, Uncertain]);
}
