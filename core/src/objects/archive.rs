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
    /// Writes or reads all that outlives a frame; [`Objects::remake`] must follow a reading.
    pub(crate) fn archive(&mut self, archive: &mut impl Archive) {
        self.crops.archive(archive);
        self.volumes.objects.iter_mut().for_each(|object| object.archive(archive));
    }

    /// Makes anew what was not stored. Whether what was read can be.
    pub(crate) fn remake(&mut self) -> bool {
        self.volumes.objects.iter_mut().all(|object| object.volume.remake())
    }
}

impl Object<'_> {
    fn archive(&mut self, archive: &mut impl Archive) {
        let mut there = u8::from(self.summary.is_some());
        archive.u8(&mut there);
        if there > 0 {
            let mut summary = self.summary.unwrap_or(ObjectSummary {
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
            self.summary = Some(summary);
        }
        self.volume.archive(archive);
    }
}

impl ObjectSummary {
    fn archive(&mut self, archive: &mut impl Archive) {
        let (mut class, mut state, mut pose) = (self.class.code(), self.state.code(), numbers(&self.t_world_object));
        let Self { id, chain, first_frame, last_frame, frames, .. } = self;
        [id, chain, first_frame, last_frame, frames, &mut class, &mut state].into_iter().for_each(|number| archive.u32(number));
        archive.f64s(&mut pose);
        (self.class, self.state, self.t_world_object) = (Class::from_code(class), State::from_code(state), transform(&pose));
    }
}
