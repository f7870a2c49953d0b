//! Health of a run: what was refused or lost.

use super::{Finished, FrameContext, ObserveError, ObservedRun, Observer};
use crate::input::MaskRefusals;
use dynvox_core::Severity;
use dynvox_core::tracking::DetectionCount;
use serde::{Deserialize, Serialize};

/// Counts of everything refused or lost.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct HealthSection {
    /// The worst event of all frames and of the end.
    pub worst: Severity,
    /// Features and matches for which there was no memory.
    pub matches_dropped: u64,
    /// Invalid values of given depth images.
    pub depth_values_refused: u64,
    /// Masks of the source that could not be used.
    pub mask_refusals: MaskRefusals,
    /// Detections by outcome.
    pub detections: DetectionCount,
    /// Tracks and object volumes for which there was no memory.
    pub tracks_refused: u64,
    /// Contradictions that the core found in what it keeps; each is a fault of dynvox.
    pub internal_faults: u64,
}

/// Counts refusals.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct HealthObserver {
    sums: HealthSection,
}

impl Observer for HealthObserver {
    type Section = HealthSection;

    fn frame(
        &mut self,
        _: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        let (sums, row) = (&mut self.sums, frame.row);
        let (tracking, objects) = (&row.report.tracking, &row.report.objects);
        sums.matches_dropped += u64::from(row.report.dropped_features());
        sums.depth_values_refused += u64::from(row.depth_refused);
        sums.mask_refusals.add(&row.mask_refusals);
        sums.detections = sum(sums.detections, &tracking.detections);
        sums.tracks_refused += u64::from(tracking.tracks.refused + objects.refused);
        sums.internal_faults += u64::from(row.report.internal_faults);
        // The order of severities is that of how bad they are.
        sums.worst = sums.worst.max(row.severity());
        Ok(())
    }

    fn finish(
        self,
        _: &ObservedRun<'_>,
        finished: &Finished,
    ) -> Result<HealthSection, ObserveError> {
        let store = &finished.store;
        // A block that is lost at the end is missing from the map.
        let end = if u64::from(store.end.lost) + store.unreadable > 0 {
            Severity::MapAffected
        } else {
            Severity::Info
        };
        Ok(HealthSection { worst: self.sums.worst.max(end), ..self.sums })
    }
}

fn sum(a: DetectionCount, b: &DetectionCount) -> DetectionCount {
    DetectionCount {
        given: a.given + b.given,
        accepted: a.accepted + b.accepted,
        bad_score: a.bad_score + b.bad_score,
        bad_box: a.bad_box + b.bad_box,
        bad_mask: a.bad_mask + b.bad_mask,
        ignored: a.ignored + b.ignored,
        too_small: a.too_small + b.too_small,
        tracked_only: a.tracked_only + b.tracked_only,
        over_capacity: a.over_capacity + b.over_capacity,
        mask_store_full: a.mask_store_full + b.mask_store_full,
        covered: a.covered + b.covered,
    }
}
