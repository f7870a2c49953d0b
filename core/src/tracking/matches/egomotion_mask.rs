//! Which matches the camera's own motion is estimated from.

use super::{MatchOwner, OwnerCode, pixel};
use crate::{
    masks::{MaskHandle, MaskStore},
    scene_flow::Match,
};
use heapless::Vec;

/// Most objects found by their motion whose matches are excluded before they are found again.
pub const MAX_MOVING: usize = 16;

/// Objects whose matches egomotion may not use.
#[derive(Clone, Debug, Default)]
pub struct Excluded {
    /// A bit for each instance whose matches are excluded.
    pub instances: u64,
    /// Last masks of objects that were found by their motion.
    pub moving: Vec<MaskHandle, MAX_MOVING>,
}

/// The matches that egomotion may use: none on a dynamic object, and none on a large one of unknown
/// state, which may be most of what the camera sees. Among the rest RANSAC decides. Objects found
/// by their motion are only found again once the camera's is known: of these the matches that came
/// from the last mask are excluded.
#[derive(Clone, Debug)]
pub struct EgomotionMask<'t, 's> {
    pub(super) owner_codes: &'t [OwnerCode],
    pub(super) refined: &'t [Match],
    pub(super) previous: &'t MaskStore<'s>,
    pub(super) excluded: Excluded,
}

impl EgomotionMask<'_, '_> {
    /// Returns true if egomotion may use the refined match at that position.
    pub fn includes(&self, index: u32) -> bool {
        match self.owner_codes.get(index as usize).map(|code| code.get()) {
            Some(MatchOwner::Ambiguous) => self.excluded.instances == 0,
            Some(MatchOwner::Instance(instance)) => self.excluded.instances >> instance & 1 == 0,
            Some(MatchOwner::None) => !self.is_on_moving(index),
            None => true,
        }
    }

    /// Returns true if the match was under the last mask of an object that was found by its motion.
    fn is_on_moving(&self, index: u32) -> bool {
        let at = self
            .refined
            .get(index as usize)
            .filter(|_| !self.excluded.moving.is_empty())
            .map(|m| pixel(m.previous_left));
        at.is_some_and(|(u, v)| {
            self.excluded.moving.iter().any(|mask| self.previous.contains(mask, u, v))
        })
    }
}
