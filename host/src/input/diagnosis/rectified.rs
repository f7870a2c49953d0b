//! Pairs of a source as the mapper will see them.

use crate::formats::{FormatError, Image};
use crate::input::source::{FrameSource, InputError};
use dynvox_core::memory::{Carver, SLAB_ALIGN};
use dynvox_core::rectify::{Pair, Rectification, RectifiedImages, Rectifier};
use dynvox_core::{Capacity, Serial};
use std::path::Path;

/// A source whose pairs are rectified where they come raw.
pub struct RectifiedSource<'d> {
    source: &'d dyn FrameSource,
    slab: Vec<u8>,
    capacity: Capacity,
    rectification: Option<Rectification>,
}

impl<'d> RectifiedSource<'d> {
    /// Takes memory for the maps of a raw source.
    pub fn new(source: &'d dyn FrameSource) -> Result<Self, InputError> {
        let rectification = source.rectification().copied();
        let side = |of: fn(&Rectification) -> [u32; 2]| {
            rectification.as_ref().map_or(0, |raw| of(raw).into_iter().max().unwrap_or(0) as usize)
        };
        let (image_width, image_height) = source.size();
        let capacity = Capacity {
            image_width,
            image_height,
            raw_width: side(|raw| [raw.left.raw.width, raw.right.raw.width]),
            raw_height: side(|raw| [raw.left.raw.height, raw.right.raw.height]),
            colour: false,
            ..Capacity::TINY
        };
        let bytes = Rectifier::bytes(&capacity) + RectifiedImages::bytes(&capacity);
        let mut this = Self { source, slab: vec![0; bytes + SLAB_ALIGN], capacity, rectification };
        this.with_rectifier(|_, _| ()).map(|_| this)
    }

    /// A frame's pair; `None` where an image is empty.
    pub fn pair(&mut self, index: usize) -> Result<Option<[Image<u8>; 2]>, InputError> {
        let frame = self.source.frame(index)?;
        self.rectify([frame.left, frame.right])
    }

    /// A pair of the source, already decoded; `None` where an image is empty.
    pub fn rectify(&mut self, pair: [Image<u8>; 2]) -> Result<Option<[Image<u8>; 2]>, InputError> {
        if self.rectification.is_none() {
            return Ok(Some(pair));
        }
        let [Some(left), Some(right)] = pair.each_ref().map(Image::view) else { return Ok(None) };
        let pair = Pair { left, right, colour: None };
        let rectified = self.with_rectifier(|rectifier, images| {
            let pair = rectifier.rectify(&pair, images, &Serial)?;
            Some([Image::from_view(&pair.left), Image::from_view(&pair.right)])
        })?;
        Ok(rectified.flatten())
    }

    /// Makes the maps and uses them; `None` where the source is rectified.
    fn with_rectifier<R>(
        &mut self,
        work: impl FnOnce(&Rectifier<'_>, &mut RectifiedImages<'_>) -> R,
    ) -> Result<Option<R>, InputError> {
        let Some(rectification) = self.rectification else { return Ok(None) };
        let refused = |reason: String| {
            InputError::from(FormatError::content(
                Path::new(self.source.name()),
                reason,
                "Check the calibration",
            ))
        };
        let bytes = Rectifier::bytes(&self.capacity) + RectifiedImages::bytes(&self.capacity);
        let mut carver =
            Carver::new(&mut self.slab, bytes).map_err(|error| refused(error.to_string()))?;
        let mut rectifier = Rectifier::new_in(&self.capacity, &mut carver);
        let mut images = RectifiedImages::new_in(&self.capacity, &mut carver);
        rectifier
            .prepare(&rectification, &self.source.rig())
            .map_err(|error| refused(error.to_string()))?;
        Ok(Some(work(&rectifier, &mut images)))
    }
}
