//! A camera that was covered for long: found again in its own street, and in a segment of its own in another one.

use dynvox::synth::{Street, StreetConfig, Traffic};
use dynvox_core::egomotion::{REFERENCE_FRAMES_MAX, SEGMENT_GAP_M};
use dynvox_core::geometry::Transform;
use dynvox_core::image::View;
use dynvox_core::{Capacity, Config, Mapper, PoseOrigin, Report, Serial, Severity, StereoFrame};
use dynvox_tests::HeapSlab;

const SIZE: [usize; 2] = [320, 96];
/// Frames before the camera is covered, and the first that it sees again.
const COVERED: u32 = 12;
const UNCOVERED: u32 = COVERED + REFERENCE_FRAMES_MAX + 4;
const FRAMES: u32 = UNCOVERED + 6;

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
    let capacity = Capacity { colour: true, blocks: 8_000, ..Capacity::TINY };
    let mut slab = HeapSlab::of(&capacity);
    let mut config = Config::for_rig(before.rig());
    config.volume.voxel_size_m = 0.1;
    let mut mapper = Mapper::new(&capacity, &config, slab.bytes()).expect("a slab that fits");
    let black = vec![0; SIZE[0] * SIZE[1]];
    (0..FRAMES)
        .map(|index| {
            let frame = if index < COVERED { before } else { after }.frame(index);
            let covered = (COVERED..UNCOVERED).contains(&index);
            let images = if covered { [&black, &black] } else { [&frame.left_grey, &frame.right_grey] };
            let [left, right] = images.map(|grey| View::new(grey, SIZE[0], SIZE[1]).expect("pixels of the street's size"));
            mapper.step(&StereoFrame::pair(left, right), &Serial).expect("a good frame")
        })
        .collect()
}

fn segments(reports: &[Report]) -> Vec<u32> {
    reports.iter().map(|report| report.segment).collect()
}

#[test]
fn a_covered_camera_is_found_again_in_its_map() {
    let street = street(3);
    let reports = map_covered(&street, &street);
    assert_eq!(segments(&reports), vec![0; FRAMES as usize]);
    let found = &reports[UNCOVERED as usize + 1];
    assert_eq!((found.pose, found.fused, found.severity()), (PoseOrigin::Relocalized, true, Severity::Recovered));
    let t_truth_camera = street.t_world_camera(UNCOVERED + 1).inverse() * found.t_world_camera;
    assert!(t_truth_camera.distance_m() < 0.3, "{} m off", t_truth_camera.distance_m());
    assert_eq!(reports.last().map(Report::severity), Some(Severity::Info));
}

#[test]
fn a_camera_that_sees_another_street_begins_a_segment_apart() {
    let reports = map_covered(&street(3), &street(4));
    let began = UNCOVERED as usize + 1;
    assert_eq!(segments(&reports), [vec![0; began], vec![1; FRAMES as usize - began]].concat());
    assert!(reports[COVERED as usize..].iter().all(|report| report.severity() == Severity::MapAffected), "all of it is told");
    let pose = |index: usize| reports[index].t_world_camera;
    let height_m = |pose: Transform| -pose.translation_m[1];
    assert!((height_m(pose(began)) - height_m(pose(began - 1)) - SEGMENT_GAP_M).abs() < 1.0);
    assert!(!reports[began - 1].fused && reports[began].fused && reports[began].allocation.made > 0);
}
