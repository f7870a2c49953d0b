//! What a frame's instances came to, as plain values.

use super::{Object, ObjectSummary, Objects};
use crate::tracking::{DetectionCount, TrackCount, TrackReport, Tracker, TrackingReport};

/// What became of volumes in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ObjectCount {
    /// Objects with a volume.
    pub objects: u32,
    /// Objects fused in this frame.
    pub fused: u32,
    /// Earlier crops fused because a motion became known.
    pub caught_up: u32,
    /// Volumes begun.
    pub begun: u32,
    /// Volumes handed over.
    pub retired: u32,
    /// Objects for which there was no volume.
    pub refused: u32,
    /// Blocks refused because an object's volume was full, and such beyond its bounds.
    pub blocks_refused: u32,
    /// Crops that had to go although they still waited.
    pub crops_dropped: u32,
    /// Blocks in use over all objects.
    pub blocks: u32,
}

/// One frame's instances.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct InstancesReport {
    /// What became of the detections.
    pub detections: DetectionCount,
    /// What became of the tracks.
    pub tracks: TrackCount,
    /// What became of the volumes.
    pub objects: ObjectCount,
    /// Matches kept out of the camera's own motion.
    pub matches_withheld: u32,
    /// Pixels whose depth was kept out of the static map.
    pub pixels_cleared: u32,
}

impl InstancesReport {
    /// Whether anything that should have been used was not.
    pub fn refused(&self) -> u32 {
        self.detections.refused() + self.tracks.refused + self.objects.refused + self.objects.blocks_refused
    }
}

impl<'s> Objects<'s> {
    /// What the last frame came to, with what its tracking came to.
    pub fn report(&self, tracking: &TrackingReport) -> InstancesReport {
        let &TrackingReport { detections, tracks, matches_withheld, pixels_cleared } = tracking;
        InstancesReport { detections, tracks, objects: self.report, matches_withheld, pixels_cleared }
    }

    /// The tracks as they stand, with the blocks of their volumes.
    pub fn tracks<'a>(&'a self, tracker: &'a Tracker<'_>) -> impl Iterator<Item = TrackReport> + 'a {
        tracker.tracks().map(|track| {
            let object = self.volumes.of(track.id).and_then(|at| self.volumes.objects.get(at));
            TrackReport { blocks: object.map_or(0, |object| object.volume.pool().len() as u32), ..track }
        })
    }

    /// The objects that have a volume now.
    pub fn objects(&self) -> impl Iterator<Item = (&ObjectSummary, &Object<'s>)> {
        self.volumes.objects.iter().filter_map(|object| Some((object.summary()?, &**object)))
    }
}
