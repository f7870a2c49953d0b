//! Sums of a report.

use super::*;
use crate::tracking::{TrackCount, TrackingReport};

#[test]
fn the_sum_of_refusals_counts_every_kind() {
    let detections = [
        DetectionCount { bad_score: 1, ..DetectionCount::default() },
        DetectionCount { bad_box: 1, ..DetectionCount::default() },
        DetectionCount { bad_mask: 1, ..DetectionCount::default() },
        DetectionCount { over_capacity: 1, ..DetectionCount::default() },
        DetectionCount { mask_store_full: 1, ..DetectionCount::default() },
    ];
    for detections in detections {
        let report = TrackingReport { detections, ..TrackingReport::default() };
        assert_eq!(report.refused(), 1, "{detections:?}");
    }
    let tracks = TrackCount { refused: 2, masks_lost: 16, ..TrackCount::default() };
    assert_eq!(TrackingReport { tracks, ..TrackingReport::default() }.refused(), 18);
    let fine = DetectionCount {
        given: 9,
        accepted: 1,
        ignored: 1,
        too_small: 1,
        tracked_only: 1,
        covered: 1,
        ..DetectionCount::default()
    };
    let report = TrackingReport { detections: fine, ..TrackingReport::default() };
    assert_eq!(report.refused(), 0);
}
