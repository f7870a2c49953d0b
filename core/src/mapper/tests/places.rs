//! A camera that comes back, after a loss, to where it has been.

use super::resume::{restored, saved};
use super::*;
use crate::{
    PoseOrigin,
    egomotion::MAX_REFERENCE_FRAMES,
    geometry::MapSegment,
    mapper::LoadPlacesError,
    places::{KEYFRAME_POINTS, MAX_KEYFRAMES},
};

/// Without colour, so that the map's picture does not find the camera first.
const WITH_PLACES: Capacity = Capacity { keyframes: 20, ..CAPACITY };
const SECOND: MapSegment = MapSegment::new(1);
/// Frames until the camera is covered.
const SEEN: usize = 8;

/// Pose of frame `at` of a walk ahead.
fn ahead(at: usize) -> Transform {
    Transform::new([0.0, 0.003 * at as f64, 0.0], [0.0, 0.0, 0.08 * at as f64])
}

/// Pose of frame `at` of a walk that looks back.
fn back(at: usize) -> Transform {
    Transform::new([0.0, 3.1, 0.0], [0.3, 0.0, 0.08 * at as f64])
}

fn step(mapper: &mut Mapper<'_>, pose: Option<Transform>) -> Report {
    let pair = pose.map_or_else(|| [(); 2].map(|()| vec![0; WIDTH * HEIGHT]), |pose| see(&pose));
    let [left, right] = pair.each_ref().map(|pixels| View::new(pixels, WIDTH, HEIGHT).unwrap());
    mapper.step(&StereoFrame::pair(left, right), &Serial).unwrap()
}

/// Hands a mapper to `test` that has walked ahead, was covered for long, and saw the first frame
/// of `again` at the number returned by it.
fn with_lost<R>(
    capacity: &Capacity,
    again: fn(usize) -> Transform,
    test: impl FnOnce(&mut Mapper<'_>, usize) -> R,
) -> R {
    let mut slab = vec![0u8; capacity.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(capacity, &Walk::config(), &mut slab).unwrap();
    (0..SEEN).for_each(|at| {
        let report = step(&mut mapper, Some(ahead(at)));
        assert!(report.segment == MapSegment::FIRST && report.internal_faults == 0);
    });
    (0..=MAX_REFERENCE_FRAMES).for_each(|_| {
        step(&mut mapper, None);
    });
    step(&mut mapper, Some(again(SEEN)));
    test(&mut mapper, SEEN + 1)
}

#[test]
fn a_camera_that_comes_back_goes_on_in_the_segment_it_left() {
    with_lost(&WITH_PLACES, ahead, |mapper, first| {
        let reports: Vec<Report> =
            (first..first + 5).map(|at| step(mapper, Some(ahead(at)))).collect();
        assert_eq!(reports[0].segment, SECOND, "one frame proves nothing");
        let joined = reports.iter().position(|report| report.segment == MapSegment::FIRST);
        let joined = joined.expect("the place is recognised");
        assert_eq!(reports[joined].pose, PoseOrigin::Relocalized);
        for (at, report) in (first..).zip(&reports).skip(joined) {
            let off = report.t_world_camera.inverse() * ahead(at);
            assert!(off.distance_m() < 0.08 && off.angle_rad() < 0.01, "{off:?}");
            assert!(report.segment == MapSegment::FIRST && report.fused);
        }
    });
}

#[test]
fn a_camera_that_sees_another_place_stays_in_its_own_segment() {
    with_lost(&WITH_PLACES, back, |mapper, first| {
        for at in first..first + 8 {
            assert_eq!(step(mapper, Some(back(at))).segment, SECOND);
        }
    });
}

#[test]
fn without_keyframes_no_segment_is_joined() {
    with_lost(&CAPACITY, ahead, |mapper, first| {
        (first..first + 5).for_each(|at| assert_eq!(step(mapper, Some(ahead(at))).segment, SECOND));
    });
}

#[test]
fn keyframes_change_no_bit_of_a_camera_that_is_never_lost() {
    let digests = |capacity: &Capacity| -> Vec<u64> {
        let mut slab = vec![0u8; capacity.bytes() + SLAB_ALIGN];
        let mut mapper = Mapper::new(capacity, &Walk::config(), &mut slab).unwrap();
        (0..6).map(|at| step(&mut mapper, Some(ahead(at))).digest).collect()
    };
    assert_eq!(digests(&WITH_PLACES), digests(&CAPACITY));
}

#[test]
fn a_snapshot_between_two_frames_of_one_place_joins_in_the_same_frame() {
    let go_on = |mapper: &mut Mapper<'_>| -> Vec<(u64, MapSegment)> {
        let at = SEEN + 2..SEEN + 6;
        at.map(|at| step(mapper, Some(ahead(at))))
            .map(|report| (report.digest, report.segment))
            .collect()
    };
    let (bytes, expected) = with_lost(&WITH_PLACES, ahead, |mapper, first| {
        step(mapper, Some(ahead(first)));
        (saved(mapper), go_on(mapper))
    });
    assert!(expected.iter().any(|(_, segment)| *segment == MapSegment::FIRST));
    assert_eq!(restored(&WITH_PLACES, &Walk::config(), &bytes, go_on), Ok(expected));
}

#[test]
fn keyframes_cost_what_is_stated_and_nothing_where_there_are_none() {
    let more = |keyframes: usize| {
        Capacity { keyframes, ..CAPACITY }.bytes() - Capacity { keyframes: 0, ..CAPACITY }.bytes()
    };
    assert_eq!(more(0), 0);
    assert!(more(1_000) <= 12 << 20, "{} bytes", more(1_000));
    assert_eq!(KEYFRAME_POINTS, 128);
    let footprint = Capacity { keyframes: 1_000, ..CAPACITY }.footprint();
    let names = ["places", "volume.submaps"];
    let bytes = names.map(|name| footprint.region(name).expect("it is listed").bytes);
    assert_eq!(bytes.iter().sum::<usize>(), more(1_000));
    assert!(CAPACITY.footprint().region("places").is_none());
    let most = Capacity { keyframes: MAX_KEYFRAMES + 1, ..CAPACITY };
    assert_eq!(most.validate().map_err(|problem| problem.bound), Err("keyframes"));
}

/// Places of a walk ahead, as they are saved.
fn saved_places() -> Vec<u8> {
    let mut slab = vec![0u8; WITH_PLACES.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&WITH_PLACES, &Walk::config(), &mut slab).unwrap();
    (0..SEEN).for_each(|at| {
        step(&mut mapper, Some(ahead(at)));
    });
    assert!(mapper.keyframes() > 0);
    let mut bytes = Vec::new();
    let mut sink = |piece: &[u8]| -> Result<(), ()> {
        bytes.extend_from_slice(piece);
        Ok(())
    };
    mapper.save_places(&mut sink).unwrap();
    bytes
}

/// Hands a mapper to `test` that loaded places, with what came of it.
fn with_loaded<R>(
    capacity: &Capacity,
    bytes: &[u8],
    test: impl FnOnce(&mut Mapper<'_>, Result<u32, LoadPlacesError<()>>) -> R,
) -> R {
    let mut slab = vec![0u8; capacity.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(capacity, &Walk::config(), &mut slab).unwrap();
    let mut rest = bytes;
    let loaded = mapper.load_places(&mut |piece: &mut [u8]| {
        crate::state::in_memory::take(&mut rest, piece).ok_or(())
    });
    test(&mut mapper, loaded)
}

#[test]
fn another_run_is_placed_in_an_old_map_and_stays_there() {
    // Half a step aside of the old way, so that no image is the same.
    let aside = |at: usize| ahead(at) * Transform::from_translation([0.05, 0.0, 0.04]);
    with_loaded(&WITH_PLACES, &saved_places(), |mapper, loaded| {
        let keyframes = loaded.unwrap();
        let reports: Vec<Report> = (0..9).map(|at| step(mapper, Some(aside(at)))).collect();
        assert_eq!(reports[1].segment, SECOND, "lost until a place is recognised");
        let placed = reports.iter().position(|report| report.segment == MapSegment::FIRST);
        let placed = placed.expect("it sees what the old run saw");
        for (at, report) in reports.iter().enumerate().skip(placed) {
            let off = report.t_world_camera.inverse() * aside(at);
            assert!(off.distance_m() < 0.1 && off.angle_rad() < 0.01, "frame {at}: {off:?}");
            assert_eq!(report.segment, MapSegment::FIRST);
        }
        assert_eq!(mapper.keyframes(), keyframes, "the old places stay as they were");
    });
}

#[test]
fn another_run_elsewhere_is_not_placed() {
    with_loaded(&WITH_PLACES, &saved_places(), |mapper, loaded| {
        loaded.unwrap();
        (0..8).for_each(|at| assert_eq!(step(mapper, Some(back(at))).segment, SECOND));
    });
}

#[test]
fn places_that_cannot_be_used_are_refused_and_leave_none() {
    let bytes = saved_places();
    let refused = |capacity: &Capacity, bytes: &[u8]| {
        with_loaded(capacity, bytes, |mapper, loaded| {
            assert_eq!(mapper.keyframes(), 0);
            assert_eq!(step(mapper, Some(ahead(0))).segment, MapSegment::FIRST);
            loaded.unwrap_err()
        })
    };
    let changed = |at: usize| {
        let mut bytes = bytes.clone();
        bytes[at] ^= 1;
        bytes
    };
    assert_eq!(refused(&WITH_PLACES, &changed(0)), LoadPlacesError::Foreign);
    assert_eq!(refused(&WITH_PLACES, &changed(8)), LoadPlacesError::Version(0));
    // The sign and exponent of the focal length.
    assert_eq!(refused(&WITH_PLACES, &changed(19)), LoadPlacesError::Rig);
    assert_eq!(refused(&WITH_PLACES, &changed(bytes.len() / 2)), LoadPlacesError::Damaged);
    assert_eq!(refused(&WITH_PLACES, &bytes[..bytes.len() - 1]), LoadPlacesError::Source(()));
    let too_many = refused(&CAPACITY, &bytes);
    assert!(matches!(too_many, LoadPlacesError::Capacity { keyframes } if keyframes > 0));
}
