//! A mapper that is given samples of an inertial unit, and what is refused of them.
#![allow(missing_docs, clippy::unwrap_used, clippy::indexing_slicing)]
#![expect(
    clippy::undocumented_unsafe_blocks,
    reason = "each call keeps the header's promises, but for the one it breaks on purpose"
)]

mod support;

use dynvox_capi::*;
use std::ptr;
use support::*;

/// A unit in the camera's place and axes, with all defaults.
fn unit() -> DynvoxInertialUnit {
    let mut unit: DynvoxInertialUnit = unsafe { std::mem::zeroed() };
    unit.t_camera_unit.rotation = [1.0, 0.0, 0.0, 0.0];
    unit
}

fn with_unit(unit: &DynvoxInertialUnit) -> Result<DynvoxConfig, DynvoxStatus> {
    let mut config = config();
    match unsafe { dynvox_config_inertial(unit, &raw mut config) } {
        DynvoxStatus::Ok => Ok(config),
        status => Err(status),
    }
}

/// So many samples of a unit at rest in the tenth of a second before a frame.
fn at_rest(frame: u64, count: usize) -> Vec<DynvoxInertialSample> {
    let apart_ns = 100_000_000 / count.max(1) as u64;
    let sample = |part: u64| DynvoxInertialSample {
        time_ns: 1_000_000_000 + frame * 100_000_000 - part * apart_ns,
        turn_rate: [0.0, 1e-6 * (frame + part) as f64, 0.0],
        force: [0.0, -9.81, 0.0],
    };
    (0..count as u64).rev().map(sample).collect()
}

/// Reports of a camera that stands, with `count` samples of each frame.
fn standing(config: &DynvoxConfig, count: usize) -> Vec<DynvoxReport> {
    let mut buffer = Buffer::new();
    // The pair repeats, as of a camera that stands.
    let mapper = create(&mut buffer, config).unwrap();
    let (left, mut right) = (pixels(), pixels());
    right.rotate_left(8);
    let report = |at: u64| {
        let (samples, time_ns) = (at_rest(at, count), 1_000_000_000 + at * 100_000_000);
        let mut given = frame(&left);
        given.right.pixels = right.as_ptr();
        given.time_ns = &raw const time_ns;
        (given.inertial, given.inertial_count) = (samples.as_ptr(), samples.len());
        let mut report: DynvoxReport = unsafe { std::mem::zeroed() };
        let status = unsafe { dynvox_step(mapper, &raw const given, ptr::null(), &raw mut report) };
        assert_eq!(status, DynvoxStatus::Ok, "{at}");
        report
    };
    (0..20).map(report).collect()
}

#[test]
fn samples_of_a_frame_are_read_up_to_their_bound_and_tell_which_way_is_up() {
    let reports = standing(&with_unit(&unit()).unwrap(), 10);
    let last = reports.last().unwrap().inertial;
    assert_eq!((last.samples, last.ignored, last.bridged), (10, 0, 0));
    assert_eq!(last.doubt, DynvoxInertialDoubt::None);
    // The first camera's y axis points down.
    let [x, y, z] = last.up_world;
    assert!(y < -0.999 && x.abs() < 0.02 && z.abs() < 0.02, "{last:?}");
    assert!(last.up_sigma_rad > 0.0 && last.up_sigma_rad < 0.05, "{last:?}");
    let many = standing(&with_unit(&unit()).unwrap(), 1_030)[0].inertial;
    assert_eq!((many.samples, many.ignored), (1_030, 6), "1,024 are read");
    assert!(last.turn_bias.iter().all(|bias| bias.abs() < 0.01), "{last:?}");
}

#[test]
fn samples_say_nothing_without_a_unit_and_a_unit_nothing_without_samples() {
    let (without, silent) = (standing(&config(), 10), standing(&with_unit(&unit()).unwrap(), 0));
    for report in without.iter().chain(&silent) {
        let DynvoxInertialReport { trusted, doubt, turned, refused, up_world, .. } =
            report.inertial;
        assert_eq!((trusted, turned, refused, up_world), (false, false, false, [0.0; 3]));
        assert_eq!(doubt, DynvoxInertialDoubt::None);
    }
    assert_eq!(without[0].inertial.clock_offset_sigma_s, 0.0, "all 0 without a unit");
    let poses = |reports: &[DynvoxReport]| -> Vec<DynvoxPose> {
        reports.iter().map(|report| report.t_world_camera).collect()
    };
    assert_eq!(poses(&without), poses(&silent));
    assert_eq!(poses(&without), poses(&standing(&config(), 0)));
}

#[test]
fn a_unit_that_cannot_be_used_is_refused() {
    let mut config = config();
    let add = |unit: *const DynvoxInertialUnit, config: *mut DynvoxConfig| unsafe {
        dynvox_config_inertial(unit, config)
    };
    assert_eq!(add(ptr::null(), &raw mut config), DynvoxStatus::Null);
    let sound = unit();
    assert_eq!(add(&raw const sound, ptr::null_mut()), DynvoxStatus::Null);
    let refused = |change: fn(&mut DynvoxInertialUnit)| {
        let mut unit = unit();
        change(&mut unit);
        with_unit(&unit).unwrap_err()
    };
    assert_eq!(refused(|unit| unit.t_camera_unit.rotation = [0.0; 4]), DynvoxStatus::Pose);
    assert_eq!(refused(|unit| unit.t_camera_unit.rotation = [2.0; 4]), DynvoxStatus::Pose);
    assert_eq!(refused(|unit| unit.clock_offset_s = 1.5), DynvoxStatus::Config);
    assert_eq!(refused(|unit| unit.turn_range = -1.0), DynvoxStatus::Config);
    assert_eq!(refused(|unit| unit.turn_density = f64::NAN), DynvoxStatus::Config);
}

#[test]
fn samples_must_be_there_and_not_in_the_buffer() {
    let mut buffer = Buffer::new();
    let config = with_unit(&unit()).unwrap();
    let mapper = create(&mut buffer, &config).unwrap();
    let pixels = pixels();
    let mut given = frame(&pixels);
    let samples = at_rest(0, 1);
    for (inertial, count, expected) in [
        (ptr::null(), 1, DynvoxStatus::Null),
        (samples.as_ptr().wrapping_byte_add(1), 1, DynvoxStatus::Misaligned),
        (samples.as_ptr(), usize::MAX, DynvoxStatus::Size),
        (buffer.at(64).cast_const().cast(), 1, DynvoxStatus::Overlap),
        (ptr::null(), 0, DynvoxStatus::Ok),
    ] {
        (given.inertial, given.inertial_count) = (inertial, count);
        assert_eq!(step(mapper, &given), expected);
    }
}
