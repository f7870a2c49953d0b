//! Uncertain, static, dynamic: the motion state of an object, with hysteresis.
//!
//! A frame's motion has a speed, an error of it (one sigma) and a bias the cameras may add. It is
//! classified *dynamic* when the speed less the bias and `sigmas` times the error is above
//! `dynamic_m_s`; *static* when that is below `static_m_s` and the speed plus `static_sigmas` times
//! the error in all directions is below `slow_m_s`, for a dynamic object below `dynamic_m_s`;
//! otherwise neither. So a far car that may be static and is certainly slower than a pedestrian is
//! static, and one that may be faster stays uncertain; but a dynamic object must be measured to
//! have stopped. With `sigmas` 0, `confirm_frames` 1 and `slow_m_s` equal to `static_m_s` this is
//! the published rule (Section III-D).
//!
//! ```text
//!      confirm_static_frames or confirm_frames agree         change_frames agree
//! uncertain ----------------------> static or dynamic <-------------------> the other
//!     ^                                    |
//!     +------------------------------------+  no motion for more than static_frames or dynamic_frames frames
//! ```
//!
//! A frame in which the object is not detected is a frame without a motion. It neither confirms nor
//! refutes: what the frames before were classified as still counts until the state is lost, or for
//! as long without a state.

use super::config::StateConfig;
use crate::state::Visitor;
use bytemuck::{Pod, Zeroable};

/// Motion state of an object: uncertain, static or dynamic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MotionState {
    /// It may move or not.
    #[default]
    Uncertain,
    /// It does not move.
    Static,
    /// It moves.
    Dynamic,
}

impl MotionState {
    /// Name in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Uncertain => "uncertain",
            Self::Static => "static",
            Self::Dynamic => "dynamic",
        }
    }

    /// The code, as tables keep it.
    pub(crate) const fn code(self) -> u32 {
        self as u32
    }

    /// The state of a code; [`MotionState::Uncertain`] for an unknown one.
    pub(crate) fn from_code(code: u32) -> Self {
        match code {
            1 => Self::Static,
            2 => Self::Dynamic,
            _ => Self::Uncertain,
        }
    }
}

/// Measurement of an object's speed in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MotionEvidence {
    /// Speed over ground, m/s.
    pub speed_m_s: f32,
    /// Standard deviation along the direction of motion, m/s.
    pub sigma_m_s: f32,
    /// Standard deviation in all directions together, m/s: the direction of an apparently static
    /// object is meaningless.
    pub spread_m_s: f32,
    /// By how much the cameras' own errors may make it too high, m/s: they can make a static object
    /// seem to move.
    pub bias_m_s: f32,
}

impl MotionEvidence {
    /// The state it is classified as; `Uncertain` when neither, or not a number.
    fn classify(&self, config: &StateConfig, state: MotionState) -> MotionState {
        let least = self.speed_m_s - self.bias_m_s - config.sigmas * self.sigma_m_s;
        let most = self.speed_m_s + config.static_sigmas * self.spread_m_s;
        let slow_m_s =
            if state == MotionState::Dynamic { config.dynamic_m_s } else { config.slow_m_s };
        if least > config.dynamic_m_s {
            MotionState::Dynamic
        } else if least < config.static_m_s && most < slow_m_s {
            MotionState::Static
        } else {
            MotionState::Uncertain
        }
    }
}

/// The motion state of one track, with its hysteresis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct MotionHysteresis {
    state: u32,
    /// Classification of the last frames, and the number of them in a row.
    classified: u32,
    consecutive: u32,
    /// Frames since a motion was measured.
    since_motion: u32,
}

impl MotionHysteresis {
    pub fn state(&self) -> MotionState {
        MotionState::from_code(self.state)
    }

    /// Visits every field.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { state, classified, consecutive, since_motion } = self;
        visitor.u32s([state, classified, consecutive, since_motion]);
    }

    /// Updates by a frame, with a motion or without. Returns the new state.
    pub fn update(
        &mut self,
        config: &StateConfig,
        motion_evidence: Option<MotionEvidence>,
    ) -> MotionState {
        match motion_evidence {
            Some(observed) => self.confirm(config, observed.classify(config, self.state())),
            None => self.expire(config),
        }
        self.state()
    }

    /// Counts a frame with a motion.
    fn confirm(&mut self, config: &StateConfig, classified: MotionState) {
        self.since_motion = 0;
        self.consecutive = if classified.code() == self.classified {
            self.consecutive.saturating_add(1)
        } else {
            1
        };
        self.classified = classified.code();
        let required = match (self.state(), classified) {
            (MotionState::Uncertain, MotionState::Static) => config.confirm_static_frames,
            (MotionState::Uncertain, _) => config.confirm_frames,
            _ => config.change_frames,
        };
        if classified != MotionState::Uncertain && self.consecutive >= u32::from(required) {
            self.state = classified.code();
        }
    }

    /// Counts a frame without a motion.
    fn expire(&mut self, config: &StateConfig) {
        self.since_motion = self.since_motion.saturating_add(1);
        let most = match self.state() {
            MotionState::Static => config.static_frames,
            MotionState::Dynamic | MotionState::Uncertain => config.dynamic_frames,
        };
        if self.since_motion > u32::from(most) {
            (self.state, self.classified, self.consecutive) = (MotionState::Uncertain.code(), 0, 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{MotionState::*, *};

    /// The published thresholds at 10 Hz: 0.03 m and 0.55 m a frame, no error, no confirmation.
    const PUBLISHED: StateConfig = StateConfig {
        dynamic_m_s: 5.5,
        static_m_s: 0.3,
        slow_m_s: 0.3,
        sigmas: 0.0,
        static_sigmas: 0.0,
        confirm_frames: 1,
        confirm_static_frames: 1,
        change_frames: 2,
        static_frames: 5,
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

    fn states(
        config: &StateConfig,
        frames: &[Option<MotionEvidence>],
    ) -> std::vec::Vec<MotionState> {
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
        assert_eq!(
            states(&PUBLISHED, &script),
            [Uncertain, Uncertain, Static, Static, Static, Static]
        );
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
        assert_eq!(
            last(&[seen(1.0), seen(1.0), None, None, seen(1.0), seen(1.0), seen(1.0)]),
            Dynamic
        );
    }

    #[test]
    fn a_mover_must_be_seen_to_stop_before_it_is_static() {
        let config = StateConfig {
            confirm_frames: 1,
            confirm_static_frames: 1,
            change_frames: 1,
            ..StateConfig::default()
        };
        let far = |speed_m_s| {
            Some(MotionEvidence { speed_m_s, sigma_m_s: 0.5, spread_m_s: 0.5, bias_m_s: 0.0 })
        };
        assert_eq!(states(&config, &[far(0.6)]), [Static]);
        assert_eq!(states(&config, &[far(0.8)]), [Uncertain], "it may be walking");
        assert_eq!(states(&config, &[seen(1.0), far(0.6), far(0.05)]), [Dynamic, Dynamic, Static]);
    }

    #[test]
    fn a_noisy_motion_proves_nothing() {
        let config = StateConfig { sigmas: 2.0, static_sigmas: 2.0, slow_m_s: 5.5, ..PUBLISHED };
        let classified = |speed_m_s, sigma_m_s| {
            MotionEvidence { speed_m_s, sigma_m_s, spread_m_s: sigma_m_s, bias_m_s: 0.0 }
                .classify(&config, Uncertain)
        };
        assert_eq!([classified(8.0, 1.0), classified(8.0, 1.5)], [Dynamic, Uncertain]);
        // A far car that seems to do 2 m/s, give or take 1.5, stands as far as one can tell; give
        // or take 2 nothing can be told.
        assert_eq!(
            [classified(2.0, 1.5), classified(2.0, 2.0), classified(2.0, 0.5)],
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
        assert_eq!(
            [classified(f32::NAN, 0.0), classified(0.0, f32::INFINITY)],
            [Uncertain, Uncertain]
        );
    }
}
