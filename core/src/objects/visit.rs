//! Objects as state.

use super::{Object, ObjectSummary, Objects};
use crate::{
    geometry::Transform,
    invariants::Invariants,
    state::Visitor,
    tracking::{Class, MotionState},
};

impl Objects<'_> {
    /// Says what must hold of crops and volumes after a frame.
    pub(crate) fn check_invariants(&self, invariants: &mut Invariants) {
        self.crops.check_invariants(invariants);
        for object in &self.volumes.objects {
            // Id 0 is that of no track.
            invariants.require(
                object.summary.is_none_or(|summary| summary.id != 0),
                "an object belongs to a track",
            );
            invariants.require(
                object.summary.is_some() || object.volume.pool().is_empty(),
                "a volume without an object is empty",
            );
            object.volume.check_invariants(invariants);
        }
    }

    /// Visits all that outlives a frame; [`Objects::rebuild`] must follow a reading.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { crops, volumes, config: _, report: _, restarted: _ } = self;
        crops.visit(visitor);
        volumes.objects.iter_mut().for_each(|object| object.visit(visitor));
    }

    /// Rebuilds what was not stored. Whether what was read allows it.
    pub(crate) fn rebuild(&mut self) -> bool {
        self.volumes.objects.iter_mut().all(|object| object.volume.rebuild())
    }
}

impl Object<'_> {
    /// Visits the object: the digest of its volume stands for that.
    pub(super) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { volume, summary } = self;
        // What an object is read into, when a snapshot is restored; all of it is overwritten.
        let blank = || ObjectSummary {
            id: 0,
            segment_id: 0,
            class: Class::Other,
            state: MotionState::Uncertain,
            first_frame: 0,
            last_frame: 0,
            frames: 0,
            t_world_object: Transform::IDENTITY,
        };
        visitor.option(summary, blank, |visitor, summary| summary.visit(visitor));
        visitor.content(volume.digest(), |visitor| volume.visit(visitor));
    }
}

impl ObjectSummary {
    /// Visits every field.
    fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { id, segment_id, class, state, first_frame, last_frame, frames, t_world_object } =
            self;
        visitor.u32s([id, segment_id, first_frame, last_frame, frames]);
        visitor.code(class, Class::code, Class::from_code);
        visitor.code(state, MotionState::code, MotionState::from_code);
        visitor.transform(t_world_object);
    }
}
