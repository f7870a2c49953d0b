//! A source of frames with depth or masks laid over it.

use super::{AvailableMasks, FrameSource, InputError, LidarScan, StereoImages, StreamState};
use dynvox_core::geometry::{StereoRig, Transform};
use dynvox_core::rectify::Rectification;

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
    notes: Vec<String>,
}

impl<L: OverlaySource> Overlay<L> {
    /// Lays `source` over `dataset`; `note` is a note about it for the user.
    pub fn new(dataset: Box<dyn FrameSource>, source: L, note: String) -> Self {
        let mut notes = dataset.notes().to_vec();
        notes.push(note);
        Self { dataset, source, notes }
    }
}

impl<L: OverlaySource> FrameSource for Overlay<L> {
    fn frame(&self, index: usize) -> Result<StereoImages, InputError> {
        let mut images = self.dataset.frame(index)?;
        self.source.add(self.dataset.as_ref(), index, &mut images)?;
        Ok(images)
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn name(&self) -> &str {
        self.dataset.name()
    }

    fn len(&self) -> usize {
        self.dataset.len()
    }

    fn stream(&self) -> Option<StreamState> {
        self.dataset.stream()
    }

    fn size(&self) -> (usize, usize) {
        self.dataset.size()
    }

    fn full_size(&self) -> (usize, usize) {
        self.dataset.full_size()
    }

    fn stem(&self, index: usize) -> Option<String> {
        self.dataset.stem(index)
    }

    fn masks(&self) -> AvailableMasks {
        self.dataset.masks()
    }

    fn rig(&self) -> StereoRig {
        self.dataset.rig()
    }

    fn stamp_ns(&self, index: usize) -> Option<u64> {
        self.dataset.stamp_ns(index)
    }

    fn rectification(&self) -> Option<&Rectification> {
        self.dataset.rectification()
    }

    fn time_s(&self, index: usize) -> f64 {
        self.dataset.time_s(index)
    }

    fn has_lidar(&self, index: usize) -> bool {
        self.dataset.has_lidar(index)
    }

    fn lidar(&self, index: usize) -> Result<Option<LidarScan>, InputError> {
        self.dataset.lidar(index)
    }

    fn truth(&self) -> Option<&[Transform]> {
        self.dataset.truth()
    }
}
