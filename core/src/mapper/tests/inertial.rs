//! A turning camera with an inertial unit, whose images are black for a while.

use super::*;
use crate::{
    PoseOrigin,
    inertial::{InertialReport, InertialSample, InertialUnit},
    scene_flow::SceneFlowConfig,
};

/// Frames that are black.
const BLACK: core::ops::Range<usize> = 26..31;
const FRAMES: usize = 34;
const FRAME_NS: u64 = 100_000_000;
/// Samples a frame.
const SAMPLES: usize = 10;

fn pose(at: usize) -> Transform {
    swaying(at, 1.0)
}

/// Pose of a camera that sways so many times as much.
fn swaying(at: usize, scale: f64) -> Transform {
    let t = at as f64 * 0.1;
    let yaw = 0.25 * scale * libm::sin(1.6 * t);
    Transform::new(Vector3::new(0.0, yaw, 0.0), Vector3::new(0.0, 0.0, 0.5 * t))
}

/// Samples of the time up to frame `at`, of a unit in the camera's place and axes.
fn samples(at: usize, scale: f64) -> Vec<InertialSample> {
    let stamp = |part: usize| (10 * FRAME_NS + at as u64 * FRAME_NS) + part as u64 * 10_000_000;
    let sample = |part: usize| {
        let time_ns = stamp(part) - FRAME_NS;
        let t = (time_ns as f64 - 10.0 * FRAME_NS as f64) * 1e-9;
        InertialSample {
            time_ns,
            turn_rate: [0.0, scale * 0.4 * libm::cos(1.6 * t), 0.0],
            force: [0.0, -9.81, 1e-6 * t],
        }
    };
    (1..=SAMPLES).map(sample).collect()
}

fn with_unit() -> Config {
    let unit = InertialUnit::new(Transform::IDENTITY);
    Config { inertial: Some(unit), ..Walk::config() }
}

/// Steps through all frames, with samples that are `scale` times the true ones; none at 0.
fn run(config: &Config, scale: f64, mut each: impl FnMut(usize, &Report, &mut Mapper<'_>)) {
    let mut slab = vec![0u8; CAPACITY.bytes() + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut mapper = Mapper::new(&CAPACITY, config, &mut slab[start..]).unwrap();
    for at in 0..FRAMES {
        let report = step(&mut mapper, at, scale);
        each(at, &report, &mut mapper);
    }
}

fn step(mapper: &mut Mapper<'_>, at: usize, scale: f64) -> Report {
    let is_black = BLACK.contains(&at);
    let pair = if is_black { [(); 2].map(|()| vec![0; WIDTH * HEIGHT]) } else { see(&pose(at)) };
    let samples = if scale == 0.0 { Vec::new() } else { samples(at, scale) };
    step_with(mapper, at, &pair, &samples)
}

fn step_with(
    mapper: &mut Mapper<'_>,
    at: usize,
    pair: &[Vec<u8>; 2],
    samples: &[InertialSample],
) -> Report {
    let [left, right] = pair.each_ref().map(|pixels| View::new(pixels, WIDTH, HEIGHT).unwrap());
    let frame = StereoFrame {
        inertial: samples,
        time_ns: Some((10 + at as u64) * FRAME_NS),
        ..StereoFrame::pair(left, right)
    };
    mapper.step(&frame, &Serial).unwrap()
}

/// Angle between the poses and the true ones, rad, and the units' reports.
fn errors(config: &Config, scale: f64) -> Vec<(f64, PoseOrigin, Option<InertialReport>)> {
    let mut errors = Vec::new();
    run(config, scale, |at, report, _| {
        let off = (report.t_world_camera.inverse() * pose(at)).angle_rad();
        errors.push((off, report.pose, report.inertial));
    });
    errors
}

#[test]
fn black_frames_turn_by_the_unit_and_not_on_as_before() {
    let (without, with) = (errors(&Walk::config(), 0.0), errors(&with_unit(), 1.0));
    let last = BLACK.end - 1;
    assert!(without[last].0 > 0.05, "the turn ends in the dark: {}", without[last].0);
    assert!(with[last].0 < 0.005, "{}", with[last].0);
    for at in BLACK {
        let (_, origin, report) = with[at];
        let report = report.unwrap();
        assert!(origin == PoseOrigin::Extrapolated && report.turned && report.trusted, "{at}");
        assert!(!report.refused && report.doubt.is_none());
    }
    let (off, origin, _) = with[FRAMES - 1];
    assert!(origin == PoseOrigin::Estimated && off < 0.005, "{origin:?} {off}");
}

#[test]
fn a_turn_beyond_the_search_is_followed_with_the_unit_and_lost_without() {
    // The camera sways by 0.9 rad/s, 21 px a frame, and matches are sought within 16.
    const SCALE: f64 = 2.2;
    let radius = |config: Config| {
        let scene_flow = SceneFlowConfig { search_radius_px: 16, ..config.scene_flow };
        Config { scene_flow, ..config }
    };
    let lost = |config: &Config| {
        let mut slab = vec![0u8; CAPACITY.bytes() + SLAB_ALIGN];
        let start = slab.as_ptr().align_offset(SLAB_ALIGN);
        let mut mapper = Mapper::new(&CAPACITY, config, &mut slab[start..]).unwrap();
        let mut lost = 0;
        let mut errors = Vec::new();
        // The unit earns its trust while the turn is slow, between frames 5 and 15.
        for at in 5..FRAMES {
            let report = step_with(&mut mapper, at, &see(&swaying(at, SCALE)), &samples(at, SCALE));
            lost += u32::from(at > 16 && report.pose == PoseOrigin::Extrapolated);
            errors.push((report.t_world_camera, swaying(at, SCALE)));
        }
        let [from, to] = [errors[10], errors[FRAMES - 6]];
        let off = (from.0.inverse() * to.0).inverse() * (from.1.inverse() * to.1);
        (lost, off.angle_rad())
    };
    let (without, with) = (lost(&radius(Walk::config())), lost(&radius(with_unit())));
    assert!(without.0 >= 4 && with.0 == 0, "{without:?} {with:?}");
    assert!(with.1 < 0.02, "{without:?} {with:?}");
}

#[test]
fn a_unit_without_samples_and_one_that_lies_leave_the_poses_as_they_were() {
    let poses = |config: &Config, scale: f64| {
        let mut poses = Vec::new();
        run(config, scale, |_, report, _| poses.push(report.t_world_camera));
        poses
    };
    let without = poses(&Walk::config(), 0.0);
    assert_eq!(without, poses(&with_unit(), 0.0));
    // The wrong way round: it is never trusted.
    assert_eq!(without, poses(&with_unit(), -1.0));
    let reports = errors(&with_unit(), -1.0);
    assert!(reports[BLACK.start - 1].2.is_some_and(|report| report.doubt.is_some()));
}

#[test]
fn a_run_that_is_resumed_in_the_dark_goes_on_to_the_bit() {
    let (mut digests, mut bytes) = (Vec::new(), Vec::new());
    let resumed = BLACK.start + 2;
    run(&with_unit(), 1.0, |at, report, mapper| {
        digests.push(report.digest);
        if at + 1 == resumed {
            mapper
                .save(&mut |piece: &[u8]| {
                    bytes.extend_from_slice(piece);
                    Ok::<(), ()>(())
                })
                .unwrap();
        }
    });
    let mut slab = vec![0u8; CAPACITY.bytes() + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut left = &bytes[..];
    let mut source = |piece: &mut [u8]| {
        let (now, later) = left.split_at(piece.len());
        piece.copy_from_slice(now);
        left = later;
        Ok::<(), ()>(())
    };
    let mut mapper =
        Mapper::restore(&CAPACITY, &with_unit(), &mut slab[start..], &mut source).unwrap();
    for (at, digest) in digests.iter().enumerate().skip(resumed) {
        assert_eq!(step(&mut mapper, at, 1.0).digest, *digest, "frame {at}");
    }
}
