//! Objects that are in the world now, with their poses.
//!
//! | object | pose |
//! |---|---|
//! | its track is in the trajectory segment it was fused in | the track's |
//! | that segment ended, and it was last static | its last one |
//! | that segment ended, and it moved | unknown: it is not in the world |

use super::{Object, ObjectSummary, Objects};
use crate::{
    geometry::Transform,
    tracking::{MotionState, Track, Tracker},
};

/// An object with its pose.
#[derive(Clone, Copy, Debug)]
pub struct PosedObject<'i, 's> {
    /// Summary of the object.
    pub summary: &'i ObjectSummary,
    /// Object with its volume, in its own frame.
    pub object: &'i Object<'s>,
    /// Current pose of the object in the world.
    pub t_world_object: Transform,
}

impl<'s> Objects<'s> {
    /// The objects that are in the world after the last frame, in the order of their volumes.
    pub(crate) fn posed<'a>(
        &'a self,
        tracker: &'a Tracker<'_>,
    ) -> impl Iterator<Item = PosedObject<'a, 's>> {
        self.objects().filter_map(move |(summary, object)| {
            // A volume belongs to one segment of a trajectory; in a later one its pose is unknown.
            let is_fused_segment = |track: &&Track| {
                track.id == summary.id
                    && track.segment_len > 0
                    && track.segment_id == summary.segment_id
            };
            let t_world_object = match tracker
                .tracks_with_instances()
                .map(|(track, _)| track)
                .find(is_fused_segment)
            {
                Some(track) => track.t_world_object,
                // A static object stays where it was, out of view, too.
                None if summary.state == MotionState::Static => summary.t_world_object,
                None => return None,
            };
            Some(PosedObject { summary, object, t_world_object })
        })
    }
}
