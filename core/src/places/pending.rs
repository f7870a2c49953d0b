//! Place that frames begin to recognise.

use super::{
    recognition::{Candidate, agree},
    table::SegmentPose,
};
use crate::{
    geometry::{MapSegment, Transform},
    state::Visitor,
};

/// Frames that must recognise one place.
const CONSISTENT: u32 = 3;
/// Frames in a row without a place after which the ones before are forgotten.
const MISSES_MAX: u32 = 5;

/// Place that frames recognise, followed by the camera's motion until enough of them do.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pending {
    /// Pose of the camera in the segment recognised.
    t_world_camera: Transform,
    segment: MapSegment,
    /// Frames that recognised it; 0 where no place is pending.
    pub frames: u32,
    /// Frames since the last one that did.
    misses: u32,
}

impl Pending {
    pub(super) fn pose(&self) -> SegmentPose {
        SegmentPose { segment: self.segment, t_world_camera: self.t_world_camera }
    }

    /// Moves the place on with the camera; without a motion it is forgotten.
    pub(super) fn advance(&mut self, t_current_previous: Option<&Transform>) {
        match t_current_previous {
            Some(motion) => {
                self.t_world_camera = (self.t_world_camera * motion.inverse()).normalized();
            }
            None => *self = Self::default(),
        }
    }

    /// Takes in a frame that was compared. Returns whether enough frames recognised one place.
    pub(super) fn take(&mut self, found: Option<&Candidate>, depth_m: f64) -> bool {
        match found {
            Some(found) => {
                let goes_on = self.frames > 0 && agree(&self.pose(), &found.pose, depth_m);
                *self = Self {
                    t_world_camera: found.pose.t_world_camera,
                    segment: found.pose.segment,
                    frames: if goes_on { self.frames.saturating_add(1) } else { 1 },
                    misses: 0,
                };
            }
            None => {
                self.misses = self.misses.saturating_add(1);
                if self.misses > MISSES_MAX {
                    *self = Self::default();
                }
            }
        }
        // A place without a frame of its own is none, however many frames recognised one before.
        found.is_some() && self.frames >= CONSISTENT
    }

    pub(super) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { t_world_camera, segment, frames, misses } = self;
        visitor.transform(t_world_camera);
        visitor.code(
            segment,
            |segment| u32::from(segment.get()),
            |code| MapSegment::new(code as u16),
        );
        visitor.u32s([frames, misses]);
    }
}
