//! Which objects there are in the world now, and where.
//!
//! | object | where |
//! |---|---|
//! | its track's poses still connect to those it was fused at | where the track is |
//! | they do not any more, and it was last known to stand | where it was last |
//! | they do not any more, and it moved | nowhere: it has gone on, nobody knows where to |

use super::{Object, ObjectSummary, Objects};
use crate::{
    geometry::Transform,
    tracking::{State, Track, Tracker, pose::transform},
};

/// An object in the world.
#[derive(Clone, Copy, Debug)]
pub struct PlacedObject<'i, 's> {
    /// What is known of it.
    pub summary: &'i ObjectSummary,
    /// Its map, in its own frame.
    pub object: &'i Object<'s>,
    /// Its frame to the world, now.
    pub t_world_object: Transform,
}

impl<'s> Objects<'s> {
    /// The objects that are in the world after the last frame, in a stated order: by the place of their volumes.
    pub fn placed<'a>(&'a self, tracker: &'a Tracker<'_>) -> impl Iterator<Item = PlacedObject<'a, 's>> {
        self.objects().filter_map(move |(summary, object)| {
            let follows = |track: &&Track| track.id == summary.id && track.chain > 0 && track.chains == summary.chain;
            let t_world_object = match tracker.all().iter().find(follows) {
                Some(track) => transform(&track.t_world_object),
                None if summary.state == State::Static => summary.t_world_object,
                None => return None,
            };
            Some(PlacedObject { summary, object, t_world_object })
        })
    }
}
