//! A source of frames with depth or masks laid over it.

use super::{
    FrameInfo, FrameSource, InertialUnitData, InputError, LidarScan, SourceInfo, StereoImages,
    StreamState,
};
use crate::formats::Image;
use std::sync::Arc;

/// Adds depth or masks to the frames of a data set.
pub trait OverlaySource: Send + Sync {
    /// Adds to a frame of `dataset`.
    ///
    /// # Errors
    /// What is to be added cannot be read.
    fn add(
        &self,
        dataset: &dyn FrameSource,
        index: usize,
        images: &mut StereoImages,
    ) -> Result<(), InputError>;
}

/// A data set whose frames get what `source` adds; everything else is the data set's own.
pub struct Overlay<L> {
    dataset: Box<dyn FrameSource>,
    source: L,
    info: SourceInfo,
}

impl<L: OverlaySource> Overlay<L> {
    /// Lays `source` over `dataset`; `note` is a note about it for the user.
    pub fn new(dataset: Box<dyn FrameSource>, source: L, note: String) -> Self {
        let mut info = dataset.info().clone();
        info.notes.push(note);
        Self { dataset, source, info }
    }

    /// Tells which pixels of the frames are not used.
    pub fn ignoring(mut self, ignored: Arc<Image<u8>>) -> Self {
        self.info.ignored = Some(ignored);
        self
    }
}

/// Leaves frames as they are.
struct Unchanged;

impl OverlaySource for Unchanged {
    fn add(&self, _: &dyn FrameSource, _: usize, _: &mut StereoImages) -> Result<(), InputError> {
        Ok(())
    }
}

/// A data set with an inertial unit and notes about it.
pub fn with_inertial_unit(
    dataset: Box<dyn FrameSource>,
    unit: Option<InertialUnitData>,
    notes: Vec<String>,
) -> Box<dyn FrameSource> {
    let mut info = dataset.info().clone();
    info.inertial = unit.map(Arc::new);
    info.notes.extend(notes);
    Box::new(Overlay { dataset, source: Unchanged, info })
}

impl<L: OverlaySource> FrameSource for Overlay<L> {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn frame_info(&self, index: usize) -> FrameInfo {
        self.dataset.frame_info(index)
    }

    fn frame(&self, index: usize) -> Result<StereoImages, InputError> {
        let mut images = self.dataset.frame(index)?;
        self.source.add(self.dataset.as_ref(), index, &mut images)?;
        Ok(images)
    }

    fn stream(&self) -> Option<StreamState> {
        self.dataset.stream()
    }

    fn has_lidar(&self, index: usize) -> bool {
        self.dataset.has_lidar(index)
    }

    fn lidar(&self, index: usize) -> Result<Option<LidarScan>, InputError> {
        self.dataset.lidar(index)
    }
}
