//! Objects in a snapshot.

use super::{Object, ObjectSummary, Objects};
use crate::{
    geometry::Transform,
    snapshot::Archive,
    tracking::{
        Class, State,
        pose::{numbers, transform},
    },
};

impl Objects<'_> {
    /// Visits all that outlives a frame; [`Objects::remake`] must follow a reading.
    pub(crate) fn archive(&mut self, archive: &mut impl Archive) {
        let Self { crops, volumes, config: _, report: _ } = self;
        crops.archive(archive);
        volumes.objects.iter_mut().for_each(|object| object.archive(archive));
    }

    /// Makes anew what was not stored. Whether what was read can be.
    pub(crate) fn remake(&mut self) -> bool {
        self.volumes.objects.iter_mut().all(|object| object.volume.remake())
    }
}

impl Object<'_> {
    /// Visits the object: the digest of its volume stands for that.
    pub(super) fn archive(&mut self, archive: &mut impl Archive) {
        let Self { volume, summary } = self;
        let mut there = u8::from(summary.is_some());
        archive.u8(&mut there);
        if there > 0 {
            let summary = summary.get_or_insert(ObjectSummary {
                id: 0,
                chain: 0,
                class: Class::Other,
                state: State::Uncertain,
                first_frame: 0,
                last_frame: 0,
                frames: 0,
                t_world_object: Transform::IDENTITY,
            });
            summary.archive(archive);
        } else {
            *summary = None;
        }
        archive.content(volume.digest(), |archive| volume.archive(archive));
    }
}

impl ObjectSummary {
    /// Visits every field.
    fn archive(&mut self, archive: &mut impl Archive) {
        let Self { id, chain, class, state, first_frame, last_frame, frames, t_world_object } = self;
        let (mut class_code, mut state_code, mut pose) = (class.code(), state.code(), numbers(t_world_object));
        [id, chain, first_frame, last_frame, frames, &mut class_code, &mut state_code].into_iter().for_each(|number| archive.u32(number));
        archive.f64s(&mut pose);
        (*class, *state, *t_world_object) = (Class::from_code(class_code), State::from_code(state_code), transform(&pose));
    }
}
