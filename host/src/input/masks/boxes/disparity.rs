//! Disparity of a frame before it is mapped.

use crate::input::source::{FrameSource, InputError, StereoImages};
use crate::slab::HostSlab;
use dynvox_core::Serial;
use dynvox_core::image::View;
use dynvox_core::memory::{Capacity, Carver};
use dynvox_core::stereo::{StereoConfig, StereoMatcher};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Gives the disparity of each frame's left image.
pub(in super::super) struct FrameDisparity {
    capacity: Capacity,
    slab: Mutex<HostSlab>,
}

impl FrameDisparity {
    /// For the frames of a data set, as they are mapped.
    ///
    /// # Errors
    /// The images are raw, or the memory is not there.
    pub fn new(dataset: &dyn FrameSource) -> Result<Self, InputError> {
        let refused = |reason: &str| InputError::masks(Path::new(dataset.name()), reason);
        if dataset.rectification().is_some() {
            return Err(refused(
                "boxes are made masks on rectified images, and these are raw. Rectify them first, \
                 or give masks",
            ));
        }
        let (image_width, image_height) = dataset.size();
        let capacity = Capacity { image_width, image_height, ..Capacity::TINY };
        let slab = HostSlab::map(StereoMatcher::bytes(&capacity))
            .ok_or_else(|| refused("there is no memory for stereo matching"))?;
        Ok(Self { capacity, slab: Mutex::new(slab) })
    }

    /// Calls `read` with the disparity of a frame, in 1/256 px: the given one, else that of the
    /// core's stereo matching.
    ///
    /// # Errors
    /// The images are not of the data set's size.
    pub fn with<R>(
        &self,
        images: &StereoImages,
        read: impl FnOnce(View<'_, u16>) -> R,
    ) -> Result<R, InputError> {
        if let Some(given) = images.depth.as_ref().and_then(|depth| depth.disparity_q8.view()) {
            return Ok(read(given));
        }
        let mut slab = self.slab.lock().unwrap_or_else(PoisonError::into_inner);
        let matched = Carver::new(slab.bytes_mut(), StereoMatcher::bytes(&self.capacity))
            .ok()
            .and_then(|mut carver| {
                let mut matcher = StereoMatcher::new_in(&self.capacity, &mut carver);
                matcher.compute(
                    &StereoConfig::default(),
                    images.left.view()?,
                    images.right.view()?,
                    &Serial,
                );
                Some(read(matcher.disparity_q8()))
            });
        matched.ok_or_else(|| {
            InputError::masks(Path::new("boxes"), "the images of the frame are empty")
        })
    }
}
