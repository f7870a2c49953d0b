//! Objects that leave the mapper.

use crate::observe::RetiredVolume;
use crate::volume_copy::VolumeCopy;
use dynvox_core::objects::{ObjectSink, RetiredObject};

/// Copies the objects that leave during a step.
#[derive(Default)]
pub(super) struct RetiredVolumes(pub Vec<RetiredVolume>);

impl ObjectSink for RetiredVolumes {
    fn retire(&mut self, object: RetiredObject<'_, '_>) {
        self.0.push(RetiredVolume {
            summary: object.summary,
            volume: VolumeCopy::new(object.volume),
        });
    }
}
