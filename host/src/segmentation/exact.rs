//! The synthetic street's own masks: every car it draws, parked ones included, as its renderer knows it.

use super::{Segmenter, Sightings, class_of, sighting};
use crate::dataset::{DatasetError, StereoImages};

/// Masks from the renderer.
pub(super) struct Exact;

impl Segmenter for Exact {
    fn sightings(&self, _: usize, images: &StereoImages) -> Result<Sightings, DatasetError> {
        let Some(exact) = &images.exact else { return Ok(Sightings::missing()) };
        let labels = exact.instances.map(|&label| u16::from(label));
        let boxes = sighting::boxes(&labels);
        let mut seen = Sightings::default();
        let class = |label: u16| exact.classes.get(usize::from(label) - 1).and_then(|name| class_of(name)).unwrap_or_default();
        let named = boxes.keys().map(|&label| (label, class(label), 1.0)).collect();
        seen.cut(&labels, &boxes, named);
        Ok(seen)
    }
}
