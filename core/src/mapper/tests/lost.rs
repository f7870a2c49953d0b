//! A camera that was covered for long: found again by the map, or in a segment of its own.

use super::resume::{restored, saved};
use super::*;
use crate::{
    PoseOrigin, Severity,
    egomotion::MAX_REFERENCE_FRAMES,
    geometry::MapSegment,
    objects::{ObjectSink, RetiredObject, Retirement},
    view::RaycastView,
    volume::{BlockKey, EvictedBlock, LoadedBlock},
};
use core::cmp::Ordering;

/// Frames until the camera is covered, and the first that is seen again.
const SEEN: usize = 5;
const AGAIN: usize = SEEN + MAX_REFERENCE_FRAMES as usize + 1;
/// The first frame whose motion is estimated again.
const BEGAN: usize = AGAIN + 1;
/// The frame that ends the search in a map whose colours say where the camera is.
const FOUND: usize = BEGAN + 3;
/// The capacity with colour, without which no pose is compared.
const COLOURED: Capacity = Capacity { colour: true, ..CAPACITY };
const SECOND: MapSegment = MapSegment::new(1);

fn pose(at: usize) -> Transform {
    Transform::new(
        Vector3::new(0.0, 0.003 * at as f64, 0.0),
        Vector3::new(0.0, 0.0, 0.06) * at as f64,
    )
}

/// Steps frame `at` of a walk that is covered between [`SEEN`] and [`AGAIN`].
fn step(mapper: &mut Mapper<'_>, at: usize, given: Option<Transform>) -> Report {
    let is_covered = (SEEN..AGAIN).contains(&at);
    let pair = if is_covered { [(); 2].map(|()| vec![0; WIDTH * HEIGHT]) } else { see(&pose(at)) };
    let [left, right] = pair.each_ref().map(|pixels| View::new(pixels, WIDTH, HEIGHT).unwrap());
    let frame = StereoFrame { t_world_camera: given, ..StereoFrame::pair(left, right) };
    mapper.step(&frame, &Serial).unwrap()
}

/// Hands a mapper that was lost, with the report of frame [`BEGAN`], to `test`.
fn with_lost<R>(capacity: &Capacity, test: impl FnOnce(&mut Mapper<'_>, Report) -> R) -> R {
    with_lost_by(capacity, &Walk::config(), test)
}

/// Does so with settings of one's own.
fn with_lost_by<R>(
    capacity: &Capacity,
    config: &Config,
    test: impl FnOnce(&mut Mapper<'_>, Report) -> R,
) -> R {
    let mut slab = vec![0u8; capacity.bytes() + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut mapper = Mapper::new(capacity, config, &mut slab[start..]).unwrap();
    let mut last = Report::default();
    for at in 0..=BEGAN {
        last = step(&mut mapper, at, None);
        let expected = if at == 0 {
            PoseOrigin::First
        } else if at < SEEN {
            PoseOrigin::Estimated
        } else {
            PoseOrigin::Extrapolated
        };
        assert!(last.pose == expected || at == BEGAN, "frame {at}: {:?}", last.pose);
        assert!(
            !last.fused || last.pose != PoseOrigin::Extrapolated,
            "a frame whose pose is a guess is not fused"
        );
    }
    test(&mut mapper, last)
}

#[test]
fn a_camera_that_was_lost_is_found_where_the_map_looks_like_the_image() {
    with_lost(&COLOURED, |mapper, began| {
        let mut reports = vec![began];
        reports.extend((BEGAN + 1..=FOUND + 1).map(|at| step(mapper, at, None)));
        for (at, report) in (BEGAN..).zip(&reports) {
            // Nothing is believed before all steps of the search agree.
            let expected = match at.cmp(&FOUND) {
                Ordering::Less => (PoseOrigin::Extrapolated, false),
                Ordering::Equal => (PoseOrigin::Relocalized, true),
                Ordering::Greater => (PoseOrigin::Estimated, true),
            };
            assert_eq!((report.pose, report.fused), expected, "frame {at}");
            assert_eq!(report.segment, MapSegment::FIRST);
            let off_m = (report.t_world_camera.inverse() * pose(at)).distance_m();
            assert!(off_m < 0.1 || at < FOUND, "frame {at}: {off_m} m");
        }
    });
}

#[test]
fn a_search_stopped_after_any_frame_goes_on_as_if_it_never_stopped() {
    with_lost(&COLOURED, |mapper, _| {
        for at in BEGAN + 1..=FOUND {
            let bytes = saved(mapper);
            let expected = step(mapper, at, None);
            let resumed =
                restored(&COLOURED, &Walk::config(), &bytes, |mapper| step(mapper, at, None))
                    .unwrap();
            let outcome = |report: &Report| (report.digest, report.pose, report.t_world_camera);
            assert_eq!(outcome(&resumed), outcome(&expected), "stopped before frame {at}");
        }
    });
}

#[test]
fn a_pose_given_during_a_search_ends_it() {
    with_lost(&COLOURED, |mapper, _| {
        let given = step(mapper, BEGAN + 1, Some(pose(BEGAN + 1)));
        assert_eq!((given.pose, given.fused), (PoseOrigin::Given, true));
        let next = step(mapper, BEGAN + 2, None);
        assert_eq!((next.pose, next.work.cast_pixels), (PoseOrigin::Estimated, 0));
    });
}

#[test]
fn a_search_begins_anew_where_the_camera_is_covered_again() {
    with_lost(&COLOURED, |mapper, began| {
        assert_eq!(began.pose, PoseOrigin::Extrapolated);
        // Covered for as long as before, a frame into the search.
        let covered = MAX_REFERENCE_FRAMES as usize + 1;
        for _ in 0..covered {
            assert_eq!(step(mapper, SEEN, None).pose, PoseOrigin::Extrapolated);
        }
        let again: Vec<_> = (BEGAN..=BEGAN + 4).map(|at| step(mapper, at, None).pose).collect();
        let expected = [[PoseOrigin::Extrapolated; 4].as_slice(), &[PoseOrigin::Relocalized]];
        assert_eq!(again, expected.concat(), "one frame to compare with, then all four steps");
    });
}

#[test]
fn a_camera_that_was_lost_begins_a_segment_at_its_origin() {
    with_lost(&CAPACITY, |mapper, report| {
        assert_eq!((report.pose, report.segment), (PoseOrigin::Estimated, SECOND));
        assert_eq!(report.t_world_camera, Transform::IDENTITY);
        assert!(report.fused && report.allocate.made > 0, "a map without a picture is not asked");
        let next = step(mapper, BEGAN + 1, None);
        let motion = pose(BEGAN).inverse() * pose(BEGAN + 1);
        let off_m = (next.t_world_camera.inverse() * motion).distance_m();
        assert!(off_m < 0.02 && next.segment == SECOND, "{off_m} m");
    });
}

#[test]
fn a_camera_that_was_lost_where_nothing_is_mapped_does_not_guess_its_way() {
    // All that is seen lies beyond the map's range, as a yard does for a rig meant for a desk.
    let mut config = Walk::config();
    (config.volume.near_m, config.volume.far_m) = (0.1, 0.5);
    with_lost_by(&CAPACITY, &config, |mapper, report| {
        assert_eq!((report.pose, report.segment), (PoseOrigin::Estimated, SECOND));
        let next = step(mapper, BEGAN + 1, None);
        assert_eq!(next.blocks.used, 0, "nothing is mapped");
        assert_eq!(next.severity(), Severity::MapAffected);
    });
}

#[test]
fn each_segment_can_be_looked_at_from_its_own_poses() {
    with_lost(&CAPACITY, |mapper, _| {
        let mut shown = |segment, at: &Transform| {
            let view = RaycastView { segment, ..at.into() };
            let cast = mapper.raycast(view, &Serial).unwrap();
            Vec::from(cast.depth_m().unwrap().pixels())
        };
        let origin = Transform::IDENTITY;
        let (first, second) = (shown(Some(MapSegment::FIRST), &origin), shown(None, &origin));
        assert!(
            second == shown(Some(SECOND), &origin),
            "the camera's segment, unless one is named"
        );
        // The second segment begins where the camera had moved to: what stands ahead is nearer.
        let ahead_m = pose(BEGAN).translation_m[2] as f32;
        let both = first.iter().zip(&second).filter(|(a, b)| **a > 0.0 && **b > 0.0);
        let nearer = both.filter(|(a, b)| (**a - **b - ahead_m).abs() < 0.2).count();
        assert!(nearer > 3_000, "{nearer} px");
        let third = shown(Some(MapSegment::new(2)), &origin);
        assert!(third.iter().all(|depth_m| *depth_m == 0.0), "it has not begun");
    });
}

#[test]
fn a_snapshot_of_the_second_segment_goes_on_in_it() {
    let go_on = |mapper: &mut Mapper<'_>| {
        let report = step(mapper, BEGAN + 1, None);
        let cast = mapper.raycast(&report.t_world_camera, &Serial).unwrap();
        let depth_m = Vec::from(cast.depth_m().unwrap().pixels());
        let keys: Vec<BlockKey> = mapper
            .static_map()
            .pool()
            .live()
            .filter_map(|slot| mapper.static_map().blocks().key(slot))
            .collect();
        (report.digest, report.segment, depth_m, keys)
    };
    let (bytes, expected) = with_lost(&CAPACITY, |mapper, _| (saved(mapper), go_on(mapper)));
    assert_eq!(expected.1, SECOND);
    for segment in [MapSegment::FIRST, SECOND] {
        assert!(expected.3.iter().any(|key| key.segment == segment), "{segment:?} is in the pool");
    }
    let resumed = restored(&CAPACITY, &Walk::config(), &bytes, go_on).unwrap();
    assert!(resumed == expected, "digest {:x} and {:x}", resumed.0, expected.0);
}

#[test]
fn a_pose_given_after_a_loss_leads_back_to_the_first_segment() {
    with_lost(&CAPACITY, |mapper, _| {
        let given = step(mapper, BEGAN + 1, Some(pose(BEGAN + 1)));
        assert_eq!((given.pose, given.segment), (PoseOrigin::Given, MapSegment::FIRST));
        let next = step(mapper, BEGAN + 2, None);
        let off_m = (next.t_world_camera.inverse() * pose(BEGAN + 2)).distance_m();
        assert!(off_m < 0.02 && next.segment == MapSegment::FIRST, "{off_m} m");
    });
}

/// Reasons why objects retired.
#[derive(Default)]
struct Reasons(Vec<Retirement>);

impl ObjectSink for Reasons {
    fn retire(&mut self, object: RetiredObject<'_, '_>) {
        self.0.push(object.reason);
    }
}

/// Keys of the blocks that were stored.
#[derive(Default)]
struct Keys(Vec<BlockKey>);

impl BlockStore for Keys {
    fn store(&mut self, block: EvictedBlock<'_>) -> bool {
        self.0.push(block.key);
        true
    }

    fn load(&mut self, _: LoadedBlock<'_>) -> bool {
        false
    }
}

#[test]
fn objects_of_the_first_segment_retire_where_the_second_begins() {
    let walk = Walk { pairs: (0..=BEGAN + 1).map(|at| see(&pose(at))).collect(), ..Walk::new(0) };
    let dark = vec![0; WIDTH * HEIGHT];
    let mut slab = vec![0u8; CAPACITY.bytes() + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut mapper = Mapper::new(&CAPACITY, &Walk::config(), &mut slab[start..]).unwrap();
    let mut reasons = Reasons::default();
    for at in 0..=BEGAN {
        let report = walk.with_frame(at, |frame| {
            let dark = View::new(&dark, WIDTH, HEIGHT).unwrap();
            let covered = StereoFrame { left: dark, right: dark, ..*frame };
            let frame = if (SEEN..AGAIN).contains(&at) { &covered } else { frame };
            mapper.step_with(frame, &Serial, &mut Keys::default(), &mut reasons).unwrap()
        });
        let has_object = mapper.posed_objects().count();
        if at == SEEN - 1 {
            assert_eq!((has_object, reasons.0.len()), (1, 0), "the car is mapped");
        }
        if at == BEGAN {
            assert_eq!((report.segment, report.objects.retired), (SECOND, 1));
            assert_eq!((has_object, &reasons.0[..]), (0, &[Retirement::Restarted][..]));
        }
    }
    let track = mapper.tracks().next().expect("the track goes on");
    assert_eq!((track.id, mapper.tracks().count()), (1, 1), "with its number");
    let mut store = Keys::default();
    mapper.stream_out(&mut store);
    let segments: std::collections::BTreeSet<_> = store.0.iter().map(|key| key.segment).collect();
    assert_eq!(Vec::from_iter(segments), [MapSegment::FIRST, SECOND]);
}

#[test]
fn a_camera_that_is_found_again_costs_less_than_a_whole_picture_a_frame() {
    let mut config = Walk::config();
    let bound = COLOURED.work(&config).cast_pixels;
    assert!(bound <= 3 * (WIDTH * HEIGHT) as u64 / 4, "three pictures of a quarter of the pixels");
    with_lost(&COLOURED, |mapper, report| {
        let mut pixels = vec![report.work.cast_pixels];
        pixels.extend((BEGAN + 1..=FOUND + 1).map(|at| step(mapper, at, None).work.cast_pixels));
        let third = bound / 3;
        let expected = [2 * third, 2 * third, bound, bound, 0];
        assert_eq!(pixels, expected, "each picture was needed, in the frame that took it");
    });
    config.mapper.egomotion = MotionSource::Icp;
    assert_eq!(COLOURED.work(&config).cast_pixels, (WIDTH * HEIGHT) as u64);
}
