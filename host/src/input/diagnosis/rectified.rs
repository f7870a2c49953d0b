//! Pairs of a source as the mapper will see them.

use crate::formats::{FormatError, Image};
use crate::input::source::{FrameSource, InputError};
use dynvox_core::geometry::StereoRig;
use dynvox_core::memory::{Carver, SLAB_ALIGN};
use dynvox_core::rectify::{Pair, Rectification, RectifiedImages, Rectifier};
use dynvox_core::{Capacity, Serial};
use std::path::Path;

/// Memory and maps that rectify raw pairs one by one.
pub struct PairRectifier {
    slab: Vec<u8>,
    capacity: Capacity,
    rectification: Rectification,
    rig: StereoRig,
}

impl PairRectifier {
    /// Takes memory for the maps.
    ///
    /// # Errors
    /// The rectification does not fit the core's bounds.
    pub fn new(rectification: &Rectification, rig: &StereoRig) -> Result<Self, String> {
        let raw = [&rectification.left.raw, &rectification.right.raw];
        let side = |sides: [u32; 2]| sides.into_iter().max().unwrap_or(0) as usize;
        let capacity = Capacity {
            image_width: rectification.width as usize,
            image_height: rectification.height as usize,
            raw_width: side(raw.map(|camera| camera.width)),
            raw_height: side(raw.map(|camera| camera.height)),
            colour: false,
            ..Capacity::TINY
        };
        let bytes = Rectifier::bytes(&capacity) + RectifiedImages::bytes(&capacity);
        let slab = vec![0; bytes + SLAB_ALIGN];
        let mut this = Self { slab, capacity, rectification: *rectification, rig: *rig };
        this.with_rectifier(|_, _| ()).map(|()| this)
    }

    /// A raw pair, rectified; `None` where an image is empty.
    pub fn rectify(&mut self, [left, right]: &[Image<u8>; 2]) -> Option<[Image<u8>; 2]> {
        let pair = Pair { left: left.view()?, right: right.view()?, colour: None };
        let rectified = self.with_rectifier(|rectifier, images| {
            let pair = rectifier.rectify(&pair, images, &Serial)?;
            Some([Image::from_view(&pair.left), Image::from_view(&pair.right)])
        });
        rectified.ok().flatten()
    }

    /// Makes the maps and uses them.
    fn with_rectifier<R>(
        &mut self,
        work: impl FnOnce(&Rectifier<'_>, &mut RectifiedImages<'_>) -> R,
    ) -> Result<R, String> {
        let bytes = Rectifier::bytes(&self.capacity) + RectifiedImages::bytes(&self.capacity);
        let mut carver = Carver::new(&mut self.slab, bytes).map_err(|error| error.to_string())?;
        let mut rectifier = Rectifier::new_in(&self.capacity, &mut carver);
        let mut images = RectifiedImages::new_in(&self.capacity, &mut carver);
        let prepared = rectifier.prepare(&self.rectification, &self.rig);
        prepared.map_err(|error| error.to_string())?;
        Ok(work(&rectifier, &mut images))
    }
}

/// A source whose pairs are rectified where they come raw.
pub struct RectifiedSource<'d> {
    source: &'d dyn FrameSource,
    rectifier: Option<PairRectifier>,
}

impl<'d> RectifiedSource<'d> {
    /// Takes memory for the maps of a raw source.
    pub fn new(source: &'d dyn FrameSource) -> Result<Self, InputError> {
        let rig = source.rig();
        let rectifier = source.rectification().map(|raw| PairRectifier::new(raw, &rig));
        let rectifier = rectifier.transpose().map_err(|reason| {
            let name = Path::new(source.name());
            InputError::from(FormatError::content(name, reason, "Check the calibration"))
        })?;
        Ok(Self { source, rectifier })
    }

    /// A frame's pair; `None` where an image is empty.
    pub fn pair(&mut self, index: usize) -> Result<Option<[Image<u8>; 2]>, InputError> {
        let frame = self.source.frame(index)?;
        self.rectify([frame.left, frame.right])
    }

    /// A pair of the source, already decoded; `None` where an image is empty.
    pub fn rectify(&mut self, pair: [Image<u8>; 2]) -> Result<Option<[Image<u8>; 2]>, InputError> {
        Ok(match &mut self.rectifier {
            None => Some(pair),
            Some(rectifier) => rectifier.rectify(&pair),
        })
    }
}
