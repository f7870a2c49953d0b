//! Reports of a frame's instances, as plain values.

use super::{Object, ObjectSummary, Objects};
use crate::{
    segmentation::SegmentationReport,
    tracking::{DetectionCount, TrackCount, TrackReport, Tracker, TrackingReport},
};

/// Counts of volumes in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct ObjectsReport {
    /// Objects with a volume.
    pub objects: u32,
    /// Objects fused in this frame.
    pub fused: u32,
    /// Earlier crops fused because a motion became known.
    pub caught_up: u32,
    /// Volumes begun.
    pub begun: u32,
    /// Objects that retired.
    pub retired: u32,
    /// Objects refused because all volumes were in use.
    pub refused: u32,
    /// Blocks refused because an object's volume was full, and blocks outside its coordinates.
    pub blocks_refused: u32,
    /// Crops kept for later that were dropped.
    pub crops_dropped: u32,
    /// Blocks in use over all objects.
    pub blocks: u32,
    /// Pixels of crops that would have been enough for this frame: what `capacity.crop_pixels`
    /// bounds.
    pub crop_pixels: u32,
}

/// One frame's instances.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct InstancesReport {
    /// Counts of detections.
    pub detections: DetectionCount,
    /// Counts of objects that were found by their motion.
    pub segmentation: SegmentationReport,
    /// Counts of associations with tracks.
    pub tracks: TrackCount,
    /// Counts of volumes.
    pub objects: ObjectsReport,
    /// Matches excluded from the camera's own motion.
    pub matches_excluded: u32,
    /// Pixels whose depth was kept out of the static map.
    pub pixels_masked: u32,
    /// Most words of masks in use: what `capacity.mask_words` bounds.
    pub mask_words: u32,
}

impl InstancesReport {
    /// The report of a frame, from those of its stages. `matches_excluded` is the camera's.
    pub(crate) fn of(
        tracking: &TrackingReport,
        segmentation: SegmentationReport,
        objects: ObjectsReport,
        matches_excluded: u32,
    ) -> Self {
        let &TrackingReport { detections, tracks, pixels_masked, mask_words } = tracking;
        Self {
            detections,
            segmentation,
            tracks,
            objects,
            matches_excluded,
            pixels_masked,
            mask_words,
        }
    }

    /// Returns the number of items that should have been used and were refused: detections, tracks,
    /// masks, objects, their blocks and crops.
    pub(crate) fn refused(&self) -> u32 {
        let ObjectsReport { refused, blocks_refused, crops_dropped, .. } = self.objects;
        let segmentation = self.segmentation.refused;
        self.detections.refused()
            + segmentation
            + self.tracks.refused
            + self.tracks.masks_lost
            + refused
            + blocks_refused
            + crops_dropped
    }
}

impl<'s> Objects<'s> {
    /// The report of the last frame: that of the volumes.
    pub(crate) fn report(&self) -> ObjectsReport {
        self.report
    }

    /// The tracks as they stand, with the blocks of their volumes.
    pub(crate) fn tracks<'a>(
        &'a self,
        tracker: &'a Tracker<'_>,
    ) -> impl Iterator<Item = TrackReport> + 'a {
        tracker.tracks().map(|track| {
            let object =
                self.volumes.position_of(track.id).and_then(|at| self.volumes.objects.get(at));
            TrackReport {
                blocks: object.map_or(0, |object| object.volume.pool().len() as u32),
                ..track
            }
        })
    }

    /// The objects that have a volume now.
    pub(crate) fn objects(&self) -> impl Iterator<Item = (&ObjectSummary, &Object<'s>)> {
        self.volumes.objects.iter().filter_map(|object| Some((object.summary()?, &**object)))
    }
}
