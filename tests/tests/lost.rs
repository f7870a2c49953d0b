//! A camera that was covered for long: found again in its own street, and in a segment of its own
//! in another one.
#![allow(unsafe_code)]

use dynvox::synth::{Street, StreetConfig, Traffic};
use dynvox_capi::{
    DynvoxCapacity, DynvoxConfig, DynvoxFrame, DynvoxImage, DynvoxReport, DynvoxRig,
    DynvoxSeverity, DynvoxStatus, dynvox_alignment, dynvox_bytes, dynvox_config_default,
    dynvox_config_set, dynvox_create, dynvox_step,
};
use dynvox_core::egomotion::MAX_REFERENCE_FRAMES;
use dynvox_core::geometry::Transform;
use dynvox_core::image::View;
use dynvox_core::{Capacity, Config, Mapper, PoseOrigin, Report, Serial, Severity, StereoFrame};
use dynvox_tests::HeapSlab;

const SIZE: [usize; 2] = [320, 96];
const CAPACITY: Capacity = Capacity { colour: true, blocks: 8_000, ..Capacity::TINY };
/// Frames before the camera is covered, and the first that it sees again.
const COVERED: u32 = 12;
const UNCOVERED: u32 = COVERED + MAX_REFERENCE_FRAMES + 4;
/// The frame in which a search for the camera ends: the fourth with an estimated motion.
const FOUND: u32 = UNCOVERED + 4;
const FRAMES: u32 = UNCOVERED + 9;

fn street(seed: u64) -> Street {
    let [width, height] = SIZE.map(|side| side as u32);
    let traffic = Traffic::None;
    let config = StreetConfig {
        width,
        height,
        frames: FRAMES,
        seed,
        speed_m_s: 3.0,
        shake: 0.0,
        ..StreetConfig::default()
    };
    Street::new(StreetConfig { traffic, ..config }).expect("a sound street")
}

/// Reports of `before` until the camera is covered, and of `after` from when it sees again.
fn map_covered(before: &Street, after: &Street) -> Vec<Report> {
    let mut slab = HeapSlab::of(&CAPACITY);
    let mut config = Config::for_rig(before.rig());
    config.volume.voxel_size_m = 0.1;
    let mut mapper = Mapper::new(&CAPACITY, &config, slab.bytes()).expect("a slab that fits");
    (0..FRAMES)
        .map(|index| {
            let images = images(before, after, index);
            let [left, right] = images.each_ref().map(|grey| {
                View::new(grey, SIZE[0], SIZE[1]).expect("pixels of the street's size")
            });
            mapper.step(&StereoFrame::pair(left, right), &Serial).expect("a good frame")
        })
        .collect()
}

/// Maps the covered street through the C interface.
fn map_covered_in_c(before: &Street, after: &Street) -> Vec<DynvoxReport> {
    let (rig, capacity) = (DynvoxRig::from(&before.rig()), DynvoxCapacity::from(&CAPACITY));
    let (mut len, mut mapper, mut config) =
        (0, std::ptr::null_mut(), std::mem::MaybeUninit::<DynvoxConfig>::uninit());
    // SAFETY: both pointers are to values that outlive the call.
    assert_eq!(unsafe { dynvox_bytes(&raw const capacity, &raw mut len) }, DynvoxStatus::Ok);
    let mut buffer = vec![0; len + dynvox_alignment()];
    let start = buffer.as_ptr().align_offset(dynvox_alignment());
    let slab = &mut buffer[start..];
    // SAFETY: every pointer is to a value that outlives its call; the first call writes the
    // configuration; the slab outlives the mapper.
    unsafe {
        assert_eq!(dynvox_config_default(&raw const rig, config.as_mut_ptr()), DynvoxStatus::Ok);
        assert_eq!(
            dynvox_config_set(
                config.as_mut_ptr(),
                c"volume.voxel_size_m".as_ptr(),
                c"0.1".as_ptr()
            ),
            DynvoxStatus::Ok
        );
        let created = dynvox_create(
            &raw const capacity,
            config.as_ptr(),
            slab.as_mut_ptr(),
            slab.len(),
            &raw mut mapper,
        );
        assert_eq!(created, DynvoxStatus::Ok);
    }
    // Null stands for an image that is not there.
    let no_image = DynvoxImage { pixels: std::ptr::null(), stride: 0 };
    (0..FRAMES)
        .map(|index| {
            let [left, right] = images(before, after, index);
            let image = |pixels: &Vec<u8>| DynvoxImage { pixels: pixels.as_ptr(), stride: SIZE[0] };
            let frame = DynvoxFrame {
                width: SIZE[0],
                height: SIZE[1],
                left: image(&left),
                right: image(&right),
                colour: no_image,
                detections: std::ptr::null(),
                detection_count: 0,
                t_world_camera: std::ptr::null(),
                time_ns: std::ptr::null(),
                disparity_q8: std::ptr::null(),
                inertial: std::ptr::null(),
                inertial_count: 0,
                layout: dynvox_capi::DYNVOX_SAMPLES_BYTES,
                ignored: no_image,
            };
            let mut report = std::mem::MaybeUninit::uninit();
            // SAFETY: the mapper and the images are there; a step that succeeds has written the
            // report.
            unsafe {
                assert_eq!(
                    dynvox_step(mapper, &raw const frame, std::ptr::null(), report.as_mut_ptr()),
                    DynvoxStatus::Ok
                );
                report.assume_init()
            }
        })
        .collect()
}

/// The images of a frame, black while the camera is covered.
fn images(before: &Street, after: &Street, index: u32) -> [Vec<u8>; 2] {
    if (COVERED..UNCOVERED).contains(&index) {
        return [vec![0; SIZE[0] * SIZE[1]], vec![0; SIZE[0] * SIZE[1]]];
    }
    let frame = if index < COVERED { before } else { after }.frame(index);
    [frame.left_grey, frame.right_grey]
}

fn segments(reports: &[Report]) -> Vec<u16> {
    reports.iter().map(|report| report.segment.get()).collect()
}

#[test]
fn a_covered_camera_is_found_again_in_its_map() {
    let street = street(3);
    let reports = map_covered(&street, &street);
    assert_eq!(segments(&reports), vec![0; FRAMES as usize]);
    let found = &reports[FOUND as usize];
    let searched = &reports[UNCOVERED as usize..FOUND as usize];
    assert!(searched.iter().all(|report| report.pose == PoseOrigin::Extrapolated && !report.fused));
    assert_eq!(
        (found.pose, found.fused, found.severity()),
        (PoseOrigin::Relocalized, true, Severity::Recovered)
    );
    let t_truth_camera = street.t_world_camera(FOUND).inverse() * found.t_world_camera;
    assert!(t_truth_camera.distance_m() < 0.3, "{} m off", t_truth_camera.distance_m());
    assert_eq!(reports.last().map(Report::severity), Some(Severity::Info));
}

#[dynvox_needs::long]
#[test]
fn the_c_interface_reports_the_same() {
    let street = street(3);
    let (expected, reports) = (map_covered(&street, &street), map_covered_in_c(&street, &street));
    let digests: Vec<u64> = reports.iter().map(|report| report.digest).collect();
    assert_eq!(digests, expected.iter().map(|report| report.digest).collect::<Vec<_>>());
    let found = &reports[FOUND as usize];
    assert_eq!((found.severity, found.fused, found.segment), (DynvoxSeverity::Recovered, true, 0));
}

#[test]
fn a_camera_that_sees_another_street_begins_a_segment_apart() {
    // Two streets have nothing in common by which the camera could be found.
    let reports = map_covered(&street(3), &street(4));
    // The first frame with a motion, and the second, register the guess with the wrong map.
    let began = UNCOVERED as usize + 2;
    assert_eq!(segments(&reports), [vec![0; began], vec![1; FRAMES as usize - began]].concat());
    assert!(
        reports[COVERED as usize..].iter().all(|report| report.severity() == Severity::MapAffected),
        "all of it is told"
    );
    let pose = |index: usize| reports[index].t_world_camera;
    assert_eq!(pose(began), Transform::IDENTITY, "its first camera is its world");
    // From its own first camera on, the second segment must be as good as any.
    let last = FRAMES as usize - 1;
    let truth = street(4);
    let true_motion =
        truth.t_world_camera(began as u32).inverse() * truth.t_world_camera(FRAMES - 1);
    let off_m = (true_motion.inverse() * pose(last)).distance_m();
    assert!(off_m < 0.1, "{off_m} m off");
    assert!(!reports[began - 1].fused && reports[began].fused && reports[began].allocate.made > 0);
}
