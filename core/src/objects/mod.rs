//! Objects: what a frame shows of each is cropped and fused into a volume of its own (Section III-E
//! of Bârsan et al., ICRA 2018).
//!
//! Memory: crops and volumes as their modules say.

mod config;
mod crop;
mod object;
mod posed;
mod reconstruct;
mod report;
#[cfg(test)]
mod tests;
mod visit;

pub use config::ObjectsConfig;
pub(crate) use crop::MAX_CROPS;
pub use crop::Picture;
pub use object::{
    MAX_OBJECTS, NoSink, Object, ObjectSink, ObjectSummary, RetiredObject, Retirement,
};
pub use posed::PosedObject;
pub(crate) use reconstruct::ObjectFrame;
pub use report::ObjectsReport;

use crate::{
    memory::{Capacity, Carver, Footprint},
    state::Visitor,
};
use crop::{Crop, Crops};
use object::ObjectVolumes;

/// The objects' crops and volumes.
#[derive(Debug)]
pub struct Objects<'s> {
    config: ObjectsConfig,
    crops: Crops<'s>,
    volumes: ObjectVolumes<'s>,
    report: ObjectsReport,
    /// Objects that retired before the frame's report began.
    restarted: u32,
}

impl<'s> Objects<'s> {
    /// Bytes of the slab.
    pub(crate) const fn bytes(capacity: &Capacity) -> usize {
        Crops::bytes(capacity) + ObjectVolumes::bytes(capacity)
    }

    /// Bytes of it that belong in large memory.
    pub(crate) const fn cold_bytes(capacity: &Capacity) -> usize {
        ObjectVolumes::cold_bytes(capacity)
    }

    /// Allocates its regions.
    pub(crate) fn new_in(
        capacity: &Capacity,
        config: &ObjectsConfig,
        carver: &mut Carver<'s>,
    ) -> Self {
        Self {
            config: *config,
            crops: Crops::new_in(capacity, carver),
            volumes: ObjectVolumes::new_in(capacity, config, carver),
            report: ObjectsReport::default(),
            restarted: 0,
        }
    }

    /// Visits the crops that are kept for later.
    pub(crate) fn visit_crops(&mut self, visitor: &mut impl Visitor) {
        self.crops.visit(visitor);
    }

    /// Numbers of the objects' tracks, and their digests.
    pub(crate) fn digests(&mut self) -> impl Iterator<Item = (u32, u64)> {
        self.volumes.objects.iter_mut().filter_map(|object| object.digest())
    }

    /// Adds what is in use to a footprint.
    pub(crate) fn note_use(&self, footprint: &mut Footprint) {
        footprint.set_use::<Crop>("objects.crop", self.crops.len(), MAX_CROPS);
    }
}
