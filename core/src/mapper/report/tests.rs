//! Each event's severity, one at a time.

use super::*;
use std::vec;

/// The severity of a report in which one event took place.
fn severity_of(event: impl FnOnce(&mut Report)) -> Severity {
    let mut report = Report::default();
    event(&mut report);
    report.severity()
}

#[test]
fn nothing_that_took_place_is_nothing_to_say() {
    for pose in [PoseOrigin::First, PoseOrigin::Estimated, PoseOrigin::Given] {
        assert_eq!(severity_of(|report| report.pose = pose), Severity::Info, "{pose:?}");
    }
    assert_eq!(severity_of(|report| report.prune.blocks_freed = 9), Severity::Info);
    assert_eq!(severity_of(|report| report.allocate.made = 9), Severity::Info);
    assert_eq!(
        severity_of(|report| report.allocate.eviction.stored = 9),
        Severity::Info,
        "a block that was stored is not lost"
    );
}

#[test]
fn a_guessed_pose_and_all_that_rests_on_it_affect_the_map() {
    assert_eq!(severity_of(|report| report.pose = PoseOrigin::Extrapolated), Severity::MapAffected);
    assert_eq!(severity_of(|report| report.segment = MapSegment::new(1)), Severity::MapAffected);
    assert_eq!(
        severity_of(|report| report.precision = PosePrecision::Displaced),
        Severity::MapAffected
    );
    assert_eq!(severity_of(|report| report.pose = PoseOrigin::Relocalized), Severity::Recovered);
}

#[test]
fn everything_refused_or_lost_affects_the_map() {
    let counters: [fn(&mut Report) -> &mut u32; 16] = [
        |report| &mut report.allocate.refused,
        |report| &mut report.allocate.beyond,
        |report| &mut report.allocate.unlisted,
        |report| &mut report.allocate.eviction.lost,
        |report| &mut report.tracking.detections.bad_score,
        |report| &mut report.tracking.detections.bad_box,
        |report| &mut report.tracking.detections.bad_mask,
        |report| &mut report.tracking.detections.over_capacity,
        |report| &mut report.tracking.detections.mask_store_full,
        |report| &mut report.segmentation.refused,
        |report| &mut report.tracking.tracks.refused,
        |report| &mut report.tracking.tracks.masks_lost,
        |report| &mut report.objects.refused,
        |report| &mut report.objects.blocks_refused,
        |report| &mut report.objects.crops_dropped,
        |report| &mut report.internal_faults,
    ];
    for (at, counter) in counters.iter().enumerate() {
        assert_eq!(
            severity_of(|report| *counter(report) = 1),
            Severity::MapAffected,
            "counter {at}"
        );
    }
    // No counter cancels another.
    let both = |one: usize, other: usize| {
        severity_of(|report| {
            *counters[one](report) = 1;
            *counters[other](report) = 1;
        })
    };
    assert!((0..16).all(|one| (0..one).all(|other| both(one, other) == Severity::MapAffected)));
}

#[test]
fn what_was_made_good_within_the_frame_is_recovered() {
    let counters: [fn(&mut Report) -> &mut u32; 5] = [
        |report| &mut report.scene_flow.left.dropped,
        |report| &mut report.scene_flow.right.dropped,
        |report| &mut report.scene_flow.sparse.dropped,
        |report| &mut report.scene_flow.dense.dropped,
        |report| &mut report.prune.early,
    ];
    for (at, counter) in counters.iter().enumerate() {
        assert_eq!(severity_of(|report| *counter(report) = 1), Severity::Recovered, "counter {at}");
    }
    // Powers of two: each counter adds its own bit to the sum.
    let mut all = Report::default();
    for (at, counter) in counters.iter().enumerate().take(4) {
        *counter(&mut all) = 1 << at;
    }
    assert_eq!(all.dropped_features(), 15);
    all.prune.early = 1;
    assert_eq!(all.severity(), Severity::Recovered);
}

#[test]
fn a_rig_that_is_off_recovers_if_corrected_and_affects_the_map_if_not() {
    let severity = |known: bool, offset_px: f64, corrected: bool| {
        severity_of(|report| {
            report.self_calibration = SelfCalibrationReport {
                known,
                offset_px,
                corrected,
                ..SelfCalibrationReport::default()
            }
        })
    };
    // Which way the rig is off does not matter.
    for sign in [1.0, -1.0] {
        for (offset_px, corrected, expected) in [
            (0.3, true, Severity::Info),
            (0.3, false, Severity::Info),
            (0.31, true, Severity::Recovered),
            (0.31, false, Severity::MapAffected),
            (1.0, true, Severity::Recovered),
            (1.1, true, Severity::Recovered),
            (1.1, false, Severity::MapAffected),
        ] {
            assert_eq!(
                severity(true, sign * offset_px, corrected),
                expected,
                "{offset_px} px, corrected {corrected}"
            );
            assert_eq!(
                severity(false, sign * offset_px, corrected),
                Severity::Info,
                "too little is known"
            );
        }
    }
}

#[test]
fn a_dropped_feature_does_not_hide_a_refused_block() {
    let both =
        severity_of(|report| (report.scene_flow.left.dropped, report.allocate.refused) = (9, 1));
    assert_eq!(both, Severity::MapAffected);
}

#[test]
fn names_are_those_of_the_tables() {
    let names = [Severity::Info, Severity::Recovered, Severity::MapAffected].map(Severity::name);
    assert_eq!(names, ["info", "recovered", "map affected"]);
}

#[test]
fn the_digest_of_a_rectified_frame_holds_that_of_its_images() {
    let report = Report { digest: 7, ..Report::default() };
    let plain = report.with_input(5, None);
    assert_eq!((plain.digests.input, plain.digest, plain.rectify.is_none()), (5, 7, true));
    let rectified = |digest: u64| {
        report.with_input(5, Some(RectifyReport { digest, ..RectifyReport::default() }))
    };
    assert_eq!(rectified(1).digests.input, 5);
    assert!(rectified(1).rectify.is_some());
    let mut digests = vec![plain.digest, rectified(1).digest, rectified(2).digest];
    digests.sort_unstable();
    digests.dedup();
    assert_eq!(digests.len(), 3, "each has its own");
}
