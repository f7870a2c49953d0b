//! Uncertain, static, dynamic: the motion state of an object, with hysteresis.
//!
//! A frame's motion has a speed, an error of it (one sigma) and a bias the cameras may add. It is
//! classified *dynamic* when the speed less the bias and 2.5 times the error is above
//! `dynamic_m_s`; *static* when that is below `static_m_s` and the speed plus one times
//! the error in all directions is below `slow_m_s`, for a dynamic object below `dynamic_m_s`;
//! otherwise neither. So a far car that may be static and is certainly slower than a pedestrian is
//! static, and one that may be faster stays uncertain; but a dynamic object must be measured to
//! have stopped. With an error of 0, `confirm_frames` 1 and `slow_m_s` equal to `static_m_s` this is
//! the published rule (Section III-D).
//!
//! ```text
//!      confirm_static_frames or confirm_frames agree         2 frames agree
//! uncertain ----------------------> static or dynamic <-------------------> the other
//!     ^                                    |
//!     +------------------------------------+  no motion for more than 5 (static) or
//!                                             dynamic_frames frames
//! ```
//!
//! A frame in which the object is not detected is a frame without a motion. It neither confirms nor
//! refutes: what the frames before were classified as still counts until the state is lost, or for
//! as long without a state.

use super::{MotionEvidence, MotionState, StateConfig};
use crate::state::Visitor;
use bytemuck::{Pod, Zeroable};

/// Consecutive frames that change a dynamic object to static, or the other way round. The published
/// code has no such change.
const CHANGE_FRAMES: u8 = 2;
/// Frames without a motion over which a static object stays static.
const STATIC_FRAMES: u8 = 5;

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
            _ => CHANGE_FRAMES,
        };
        if classified != MotionState::Uncertain && self.consecutive >= u32::from(required) {
            self.state = classified.code();
        }
    }

    /// Counts a frame without a motion.
    fn expire(&mut self, config: &StateConfig) {
        self.since_motion = self.since_motion.saturating_add(1);
        let most = match self.state() {
            MotionState::Static => STATIC_FRAMES,
            MotionState::Dynamic | MotionState::Uncertain => config.dynamic_frames,
        };
        if self.since_motion > u32::from(most) {
            (self.state, self.classified, self.consecutive) = (MotionState::Uncertain.code(), 0, 0);
        }
    }
}

#[cfg(test)]
mod tests;
