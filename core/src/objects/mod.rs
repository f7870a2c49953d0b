//! Objects: what a frame shows of each is cut out and goes into a volume of its own (Section III-E of Bârsan et al., ICRA 2018).
//!
//! Memory: crops and volumes as their modules say.

mod crop;
mod object;
mod placed;
mod reconstruct;
mod report;
#[cfg(test)]
mod tests;
mod visit;

pub use crop::{CROPS_MAX, Picture};
pub use object::{MAX_OBJECTS, NoSink, Object, ObjectSink, ObjectSummary, RetiredObject, Retirement};
pub use placed::PlacedObject;
pub use reconstruct::ObjectFrame;
pub use report::{InstancesReport, ObjectCount};

use crate::{
    memory::{Capacity, Carver, Footprint},
    state::Visitor,
    tracking::ObjectVolumeConfig,
};
use crop::{Crop, Crops};
use object::ObjectVolumes;

/// The objects' crops and volumes.
#[derive(Debug)]
pub struct Objects<'s> {
    config: ObjectVolumeConfig,
    crops: Crops<'s>,
    volumes: ObjectVolumes<'s>,
    report: ObjectCount,
}

impl<'s> Objects<'s> {
    /// Bytes of the slab.
    pub const fn bytes(capacity: &Capacity) -> usize {
        Crops::bytes(capacity) + ObjectVolumes::bytes(capacity)
    }

    /// Cuts its regions.
    pub fn new_in(capacity: &Capacity, config: &ObjectVolumeConfig, carver: &mut Carver<'s>) -> Self {
        Self {
            config: *config,
            crops: Crops::new_in(capacity, carver),
            volumes: ObjectVolumes::new_in(capacity, config, carver),
            report: ObjectCount::default(),
        }
    }

    /// Visits the crops that wait to be fused.
    pub(crate) fn visit_crops(&mut self, visitor: &mut impl Visitor) {
        self.crops.visit(visitor);
    }

    /// Numbers of the objects' tracks, and their digests.
    pub fn digests(&mut self) -> impl Iterator<Item = (u32, u64)> {
        self.volumes.objects.iter_mut().filter_map(|object| object.digest())
    }

    /// Enters what is in use into a footprint.
    pub fn note_use(&self, footprint: &mut Footprint) {
        footprint.set_use::<Crop>("instances.crop", self.crops.len(), CROPS_MAX);
    }
}
