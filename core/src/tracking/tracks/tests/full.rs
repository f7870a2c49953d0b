//! A full table of tracks: who goes, who stays, and what is counted.

use super::*;

/// Takes a frame without matches; the tracks it sees.
fn take(
    tracker: &mut Tracker<'_>,
    estimator: &mut Estimator<'_>,
    frame: u32,
    detections: &[Detection<'_>],
) -> Vec<u32> {
    take_frame(tracker, estimator, frame, detections, [&[], &[]]);
    tracker.tracks().filter(|track| track.detected).map(|track| track.id).collect()
}

#[test]
fn a_full_mask_store_replaces_an_unseen_tracks_mask_by_its_box() {
    with(&Capacity { mask_words: 130, ..CAPACITY }, &any_size(), |tracker, estimator| {
        assert_eq!(take(tracker, estimator, 0, &[car(100)]), [1]);
        assert_eq!(take(tracker, estimator, 1, &[car(250)]), [2]);
        assert_eq!(tracker.report.tracks.masks_lost, 1);
        assert_eq!(take(tracker, estimator, 2, &[car(250)]), [2]);
        assert_eq!(tracker.report.tracks.masks_lost, 0, "a box takes no mask words");
        assert_eq!(take(tracker, estimator, 3, &[car(100)]), [1]);
    });
}

#[test]
fn of_tracks_the_one_unseen_for_longest_goes_and_of_equals_the_older() {
    let left = |first: [&[i32]; 3]| {
        with(&Capacity { tracks: 3, ..CAPACITY }, &any_size(), |tracker, estimator| {
            for (frame, lefts) in (0..).zip(first) {
                let cars: Vec<_> = lefts.iter().map(|left| car(*left)).collect();
                take(tracker, estimator, frame, &cars);
            }
            assert_eq!(take(tracker, estimator, 6, &[car(310)]), [4]);
            assert_eq!(tracker.report.tracks.evicted, 1);
            tracker.tracks().map(|track| track.id).collect::<Vec<_>>()
        })
    };
    assert_eq!(left([&[10], &[110], &[210]]), [2, 3, 4]);
    assert_eq!(left([&[10], &[110, 210], &[10]]), [1, 3, 4], "1 was seen again");
}

#[test]
fn when_one_track_goes_the_others_keep_their_detections() {
    with(&Capacity { tracks: 3, ..CAPACITY }, &any_size(), |tracker, estimator| {
        take(tracker, estimator, 0, &[car(10), car(110), car(210)]);
        for frame in 1..3 {
            take(tracker, estimator, frame, &[car(110), car(210)]);
        }
        assert_eq!(take(tracker, estimator, 3, &[car(110), car(210), car(310)]), [2, 3, 4]);
        for detection in tracker.instances.all() {
            let track = tracker.tracked().track_of(detection).unwrap();
            assert_eq!(track.mask.pixels, detection.mask.pixels, "track {}", track.id);
        }
    });
}
