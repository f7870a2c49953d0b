//! Which matches the camera's own motion is estimated from.

use super::{
    MotionState, Tracker,
    match_assignment::{MatchOwner, OwnerCode},
};
use crate::geometry::Transform;

/// What the camera did in a frame.
#[derive(Clone, Copy, Debug)]
pub struct CameraMotion {
    /// Camera to world, now.
    pub t_world_camera: Transform,
    /// Previous camera to current camera; `None` in the first frame and where it is only extrapolated.
    pub t_current_previous: Option<Transform>,
}

/// The matches that egomotion may use: none on a dynamic object, and none on a large one of unknown state, which may be most of what
/// the camera sees. Among the rest RANSAC decides.
#[derive(Clone, Copy, Debug)]
pub struct EgomotionMask<'t> {
    owners: &'t [OwnerCode],
    /// A bit for each instance whose matches are excluded.
    excluded: u64,
}

impl EgomotionMask<'_> {
    /// Whether the refined match at that position may be used.
    pub fn includes(&self, index: u32) -> bool {
        match self.owners.get(index as usize).map(|owner| owner.get()) {
            Some(MatchOwner::Ambiguous) => self.excluded == 0,
            Some(MatchOwner::Instance(instance)) => self.excluded >> instance & 1 == 0,
            Some(MatchOwner::None) | None => true,
        }
    }
}

impl Tracker<'_> {
    pub(super) fn egomotion_mask(&self) -> EgomotionMask<'_> {
        let [width, height] = self.size;
        let large_px = f64::from(self.config.large_share) * width as f64 * height as f64;
        let mut excluded = 0u64;
        for (bit, instance) in self.instances.all().iter().enumerate() {
            let state = self.track_of(instance).map_or(MotionState::Uncertain, |track| track.motion_state.state());
            let is_excluded = match state {
                MotionState::Dynamic => true,
                MotionState::Static => false,
                MotionState::Uncertain => self.masks.current().area(&instance.mask) as f64 > large_px,
            };
            excluded |= u64::from(is_excluded) << bit;
        }
        EgomotionMask { owners: self.owner, excluded }
    }
}
