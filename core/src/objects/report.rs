//! Report of a frame's objects, as plain values.

use super::{Object, ObjectSummary, Objects};
use crate::tracking::{TrackReport, Tracker};

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

impl ObjectsReport {
    /// Returns the number of items that should have been used and were refused: objects, their
    /// blocks and crops.
    pub fn refusals(&self) -> u32 {
        self.refused + self.blocks_refused + self.crops_dropped
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
