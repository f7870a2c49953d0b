//! The synthetic street's own masks: every car it draws, parked ones included, as its renderer
//! knows it.

use super::{MaskSource, class_of};
use crate::input::source::{FrameMasks, InputError, StereoImages, bounding_boxes};

/// Masks from the renderer.
pub(super) struct Exact;

impl MaskSource for Exact {
    fn masks(&self, _: usize, images: &StereoImages) -> Result<FrameMasks, InputError> {
        let Some(exact) = &images.exact else { return Ok(FrameMasks::missing()) };
        let labels = exact.instances.map(|&label| u16::from(label));
        let boxes = bounding_boxes(&labels);
        let mut masks = FrameMasks::default();
        let class = |label: u16| {
            exact
                .classes
                .get(usize::from(label) - 1)
                .and_then(|name| class_of(name))
                .unwrap_or_default()
        };
        let named = boxes.keys().map(|&label| (label, class(label), 1.0)).collect();
        masks.extract(&labels, &boxes, named);
        Ok(masks)
    }
}
