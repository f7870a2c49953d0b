//! Which matches the camera's own motion is estimated from.

use super::{
    Class, MotionState, Tracker,
    match_assignment::{MatchOwner, OwnerCode, pixel},
    track::Track,
};
use crate::{
    geometry::Transform,
    masks::{MaskHandle, MaskStore},
    scene_flow::Match,
};
use heapless::Vec;

/// Motion of the camera in a frame.
#[derive(Clone, Copy, Debug)]
pub struct CameraMotion {
    /// Camera to world, now.
    pub t_world_camera: Transform,
    /// Previous camera to current camera; `None` in the first frame and where it is only
    /// extrapolated.
    pub t_current_previous: Option<Transform>,
}

/// Most objects found by their motion whose matches are excluded before they are found again.
const MAX_MOVING: usize = 16;

/// The matches that egomotion may use: none on a dynamic object, and none on a large one of unknown
/// state, which may be most of what the camera sees. Among the rest RANSAC decides. Objects found
/// by their motion are only found again once the camera's is known: of these the matches that came
/// from the last mask are excluded.
#[derive(Clone, Debug)]
pub struct EgomotionMask<'t, 's> {
    owner_codes: &'t [OwnerCode],
    refined: &'t [Match],
    previous: &'t MaskStore<'s>,
    /// Last masks of objects that were found by their motion.
    moving: Vec<MaskHandle, MAX_MOVING>,
    /// A bit for each instance whose matches are excluded.
    excluded: u64,
}

impl EgomotionMask<'_, '_> {
    /// Returns true if egomotion may use the refined match at that position.
    pub fn includes(&self, index: u32) -> bool {
        match self.owner_codes.get(index as usize).map(|code| code.get()) {
            Some(MatchOwner::Ambiguous) => self.excluded == 0,
            Some(MatchOwner::Instance(instance)) => self.excluded >> instance & 1 == 0,
            Some(MatchOwner::None) => !self.is_on_moving(index),
            None => true,
        }
    }

    /// Returns true if the match was under the last mask of an object that was found by its motion.
    fn is_on_moving(&self, index: u32) -> bool {
        let at = self
            .refined
            .get(index as usize)
            .filter(|_| !self.moving.is_empty())
            .map(|m| pixel(m.previous_left));
        at.is_some_and(|(u, v)| self.moving.iter().any(|mask| self.previous.contains(mask, u, v)))
    }
}

impl<'s> Tracker<'s> {
    pub(super) fn egomotion_mask<'t>(&'t self, refined: &'t [Match]) -> EgomotionMask<'t, 's> {
        let [width, height] = self.size;
        let large_px = f64::from(self.config.large_share) * width as f64 * height as f64;
        let mut excluded = 0u64;
        for (bit, instance) in self.instances.all().iter().enumerate() {
            let state = self
                .track_of(instance)
                .map_or(MotionState::Uncertain, |track| track.motion_state.state());
            let is_excluded = match state {
                MotionState::Dynamic => true,
                MotionState::Static => false,
                MotionState::Uncertain => {
                    self.masks.current().area(&instance.mask) as f64 > large_px
                }
            };
            excluded |= u64::from(is_excluded) << bit;
        }
        let is_missing = |track: &&Track| {
            track.class() == Class::MovingObject
                && track.moves()
                && !track.instance.is_some()
                && self.frame.wrapping_sub(track.last_frame) == 1
        };
        let moving = self
            .tracks
            .all()
            .iter()
            .filter(is_missing)
            .map(|track| track.mask)
            .take(MAX_MOVING)
            .collect();
        EgomotionMask {
            owner_codes: self.refined_owner,
            refined,
            previous: self.masks.previous(),
            moving,
            excluded,
        }
    }
}
