//! A camera that drives past points seen with noise, through a rig whose disparities are off by
//! what the tests choose.

use super::*;
use crate::{random::Random, state::Hasher};
use std::vec::Vec;

const RIG: StereoRig =
    StereoRig { focal_px: 720.0, center_u_px: 610.0, center_v_px: 175.0, baseline_m: 0.54 };
/// Motion of a frame: a rotation vector, rad, and a way, m.
#[derive(Clone, Copy, Debug)]
struct Motion {
    turn: [f64; 3],
    way_m: [f64; 3],
}

/// Forward a little less than a metre, turning a little.
const DRIVING: Motion = Motion { turn: [0.001, 0.01, -0.002], way_m: [0.02, -0.01, -0.9] };
const STANDING: Motion = Motion { turn: [0.0; 3], way_m: [0.0; 3] };
const TURNING: Motion = Motion { turn: [0.0, 0.05, 0.0], way_m: [0.0; 3] };
const NOISE_PX: f64 = 0.2;
const FAR_M: f64 = 40.0;

/// Points of a street at most `far_m` away, none nearer than 5 m or, of a far scene, 200 m, seen
/// before and after a motion by a rig to whose disparities `error` must be added.
fn street(
    error: &DisparityCorrection,
    motion: &Transform,
    far_m: f64,
    random: &mut Random,
) -> Vec<[StereoObservation; 2]> {
    let mut uniform = move |low: f64, high: f64| {
        low + (high - low) * f64::from(random.next_u32()) / f64::from(u32::MAX)
    };
    let error = error.for_rig(&RIG);
    (0..1_500)
        .filter_map(|_| {
            let z = 1.0 / uniform(1.0 / far_m, if far_m > FAR_M { 0.005 } else { 0.2 });
            let [x, y, _] = [uniform(-0.8, 0.8) * z, uniform(-0.2, 0.2) * z, z];
            let seen = [[x, y, z], motion.transform_point([x, y, z])].map(|point| {
                // The sum of three uniform numbers: nearly normal, and bounded.
                let mut noise = |sigma: f64| {
                    sigma * (uniform(-1.0, 1.0) + uniform(-1.0, 1.0) + uniform(-1.0, 1.0))
                };
                let exact = RIG.project(point)?;
                let [column, _] = error.uncorrected(pixel(&exact));
                Some(StereoObservation {
                    u_left_px: exact.u_left_px + noise(NOISE_PX),
                    v_px: exact.v_px + noise(NOISE_PX * 0.7),
                    u_right_px: f64::from(column) - RIG.center_u_px + noise(NOISE_PX),
                })
            });
            Some([seen[0]?, seen[1]?])
        })
        .collect()
}

/// Returns the pixel in the right image.
fn pixel(seen: &StereoObservation) -> [f32; 2] {
    [(seen.u_right_px + RIG.center_u_px) as f32, (seen.v_px + RIG.center_v_px) as f32]
}

/// The filter after `frames` frames.
fn driven(
    config: &RigConfig,
    error: &DisparityCorrection,
    motion: Motion,
    far_m: f64,
    frames: usize,
) -> SelfCalibration {
    let (mut random, mut calibration) = (Random::new(11), SelfCalibration::new(config));
    let motion = Transform::new(motion.turn, motion.way_m);
    for _ in 0..frames {
        // What is applied changes from frame to frame, and the next frame is seen through it.
        let correction = calibration.applied.for_rig(&RIG);
        let corrected = |seen: StereoObservation| {
            let [column, _] = correction.corrected(pixel(&seen));
            StereoObservation { u_right_px: f64::from(column) - RIG.center_u_px, ..seen }
        };
        let observations =
            street(error, &motion, far_m, &mut random).into_iter().map(|pair| pair.map(corrected));
        calibration.update(&RIG, observations, &motion);
    }
    calibration
}

/// Points of the back of a truck that keeps its distance of 9 m: they do not move in the image.
fn truck(random: &mut Random) -> Vec<[StereoObservation; 2]> {
    let mut uniform = move |low: f64, high: f64| {
        low + (high - low) * f64::from(random.next_u32()) / f64::from(u32::MAX)
    };
    (0..1_500)
        .filter_map(|_| {
            let exact = RIG.project([uniform(-1.2, 1.2), uniform(-2.0, 1.2), 9.0])?;
            let mut noisy = || StereoObservation {
                u_left_px: exact.u_left_px + uniform(-NOISE_PX, NOISE_PX),
                u_right_px: exact.u_right_px + uniform(-NOISE_PX, NOISE_PX),
                ..exact
            };
            Some([noisy(), noisy()])
        })
        .collect()
}

#[test]
fn a_truck_that_keeps_its_distance_is_no_offset() {
    let (mut random, motion) = (Random::new(5), Transform::new(DRIVING.turn, DRIVING.way_m));
    let mut calibration = SelfCalibration::new(&RigConfig::default());
    for _ in 0..40 {
        let street = street(&offset(0.0), &motion, FAR_M, &mut random);
        calibration.update(&RIG, street.into_iter().chain(truck(&mut random)), &motion);
        assert!(calibration.applied.is_zero(), "{:?}", calibration.report());
    }
    let report = calibration.report();
    assert!(report.found().is_none() && report.frames_disturbed > 30, "{report:?}");
    // Once it is gone, the rig is known to be sound.
    for _ in 0..20 {
        calibration.update(&RIG, street(&offset(0.0), &motion, FAR_M, &mut random), &motion);
    }
    let report = calibration.report();
    assert!(report.known && calibration.applied.offset_px == 0.0, "{report:?}");
}

#[test]
fn frames_count_by_the_way_and_not_by_the_rate() {
    // A tenth of the baseline a frame: twenty frames are worth two.
    let slowly = Motion { way_m: DRIVING.way_m.map(|m| m * 0.06), ..DRIVING };
    let report = driven(&RigConfig::default(), &offset(0.0), slowly, 15.0, 20).report();
    assert!(report.frames == 0 || report.frames_independent < 2.1, "{report:?}");
    assert!(!report.known, "{report:?}");
    let report = driven(&RigConfig::default(), &offset(0.0), DRIVING, FAR_M, 20).report();
    assert_eq!(report.frames_independent, f64::from(report.frames));
    assert!((report.way_m - 0.9 * f64::from(report.frames)).abs() < 0.1, "{report:?}");
}

#[test]
fn a_correction_that_frames_speak_against_is_taken_back() {
    // As a file of another rig may bring it, with all firmness.
    let config = RigConfig {
        disparity_correction: offset(1.5),
        correction_evidence: CorrectionEvidence { sigma_px: 0.02, frames: 40, way_m: 40.0 },
        ..RigConfig::default()
    };
    assert_eq!(SelfCalibration::new(&config).report().found().unwrap().offset_px, 1.5);
    let calibration = driven(&config, &offset(0.0), DRIVING, FAR_M, 30);
    assert!(calibration.start_refuted && calibration.applied.offset_px == 0.0);
    let report = calibration.report();
    assert!(report.known && report.offset_px.abs() < 0.06, "{report:?}");
}

#[test]
fn a_run_that_begins_with_evidence_keeps_what_was_found() {
    let correction_evidence = CorrectionEvidence { sigma_px: 0.02, frames: 40, way_m: 40.0 };
    let config = RigConfig {
        disparity_correction: offset(1.0),
        correction_evidence,
        ..RigConfig::default()
    };
    // A stretch whose own error is a quarter of a pixel, as a curve may have.
    for frames in [1, 5, 10] {
        let report = driven(&config, &offset(0.75), DRIVING, FAR_M, frames).report();
        assert!(report.known && report.offset_px > 0.85, "{frames}: {report:?}");
    }
    let without = RigConfig { disparity_correction: offset(1.0), ..RigConfig::default() };
    let report = driven(&without, &offset(0.75), DRIVING, FAR_M, 10).report();
    assert!(report.offset_px < 0.85, "without evidence it is a mere start: {report:?}");
}

fn offset(offset_px: f64) -> DisparityCorrection {
    DisparityCorrection { offset_px, ..DisparityCorrection::default() }
}

#[test]
fn an_offset_is_found_and_taken_out() {
    for planted in [-1.0, -0.7, -0.3, 0.3, 0.7] {
        let calibration = driven(&RigConfig::default(), &offset(planted), DRIVING, FAR_M, 30);
        let report = calibration.report();
        assert!(report.known && (report.offset_px - planted).abs() < 0.05, "{planted}: {report:?}");
        assert!(
            (report.offset_px - planted).abs() < 4.0 * report.offset_sigma_px,
            "{planted}: {report:?}"
        );
        assert!((report.applied_offset_px - planted).abs() < 0.05, "{planted}: {report:?}");
        assert_eq!(report.found().unwrap().offset_px, report.offset_px);
    }
}

#[test]
fn what_the_lenses_left_is_found() {
    let error = DisparityCorrection {
        offset_px: 0.2,
        slope_px: 0.4,
        quartic_px: 1.2,
        row_quadratic_px: -0.4,
    };
    let found = driven(&RigConfig::default(), &error, DRIVING, FAR_M, 60).report().found().unwrap();
    assert!((found.row_quadratic_px + 0.4).abs() < 0.1, "{found:?}");
    assert!(
        (found.slope_px - 0.4).abs() < 0.15 && (found.quartic_px - 1.2).abs() < 0.3,
        "{found:?}"
    );
}

#[test]
fn a_sound_rig_is_left_alone() {
    let report = driven(&RigConfig::default(), &offset(0.0), DRIVING, FAR_M, 60).report();
    assert!(
        report.known && report.offset_px.abs() < 0.05 && report.applied_offset_px == 0.0,
        "{report:?}"
    );
    assert_eq!(report.state(), CalibrationState::Sound);
}

#[test]
fn standing_turning_on_the_spot_and_a_far_scene_say_nothing() {
    for (motion, far_m) in [(STANDING, FAR_M), (TURNING, FAR_M), (DRIVING, 4_000.0)] {
        let calibration = driven(&RigConfig::default(), &offset(0.7), motion, far_m, 40);
        let report = calibration.report();
        assert!(!report.known && calibration.applied.is_zero(), "{motion:?}: {report:?}");
        assert!(report.offset_sigma_px > 0.2, "{report:?}");
    }
}

#[test]
fn the_correction_changes_gently() {
    let mut random = Random::new(11);
    let (mut calibration, motion) =
        (SelfCalibration::new(&RigConfig::default()), Transform::new(DRIVING.turn, DRIVING.way_m));
    for _ in 0..20 {
        let before = calibration.applied;
        calibration.update(&RIG, street(&offset(1.0), &motion, FAR_M, &mut random), &motion);
        let now = calibration.applied;
        assert!(
            (now.offset_px - before.offset_px).abs() <= CHANGE_MAX_PX + 1e-12,
            "{before:?} {now:?}"
        );
    }
}

#[test]
fn what_is_only_to_be_reported_is_not_applied() {
    let with = |self_calibration| RigConfig { self_calibration, ..RigConfig::default() };
    let reported = driven(&with(SelfCalibrationMode::Report), &offset(0.7), DRIVING, FAR_M, 30);
    assert!(reported.applied.is_zero() && (reported.report().offset_px - 0.7).abs() < 0.05);
    assert_eq!(reported.report().state(), CalibrationState::Inaccurate);
}

#[test]
fn an_offset_that_harms_the_map_is_named_without_self_calibration() {
    let off = RigConfig { self_calibration: SelfCalibrationMode::Off, ..RigConfig::default() };
    for planted in [-0.9, 0.9] {
        let report = driven(&off, &offset(planted), DRIVING, FAR_M, 10).report();
        assert!((report.offset_px - planted).abs() < 0.1, "{planted}: {report:?}");
        assert!(report.is_uncorrected() && report.applied_offset_px == 0.0, "{report:?}");
    }
    let sound = driven(&off, &offset(0.1), DRIVING, FAR_M, 30);
    assert_eq!(sound.report(), SelfCalibrationReport::default(), "what harms nothing is not said");
    // An offset that is taken out by hand is none.
    let by_hand = RigConfig { disparity_correction: offset(0.9), ..off };
    let report = driven(&by_hand, &offset(0.9), DRIVING, FAR_M, 30).report();
    assert!(!report.is_uncorrected(), "{report:?}");
}

#[test]
fn a_run_begins_where_another_ended() {
    let start =
        driven(&RigConfig::default(), &offset(0.7), DRIVING, FAR_M, 30).report().found().unwrap();
    let config = RigConfig { disparity_correction: start, ..RigConfig::default() };
    let again = SelfCalibration::new(&config);
    assert_eq!(again.applied, start);
    assert_eq!(again.report().found(), None, "until it has frames of its own");
    let report = driven(&config, &offset(0.7), DRIVING, FAR_M, 30).report();
    assert!((report.offset_px - 0.7).abs() < 0.05, "{report:?}");
}

#[test]
fn observations_that_make_no_sense_change_nothing() {
    let motion = Transform::new(DRIVING.turn, DRIVING.way_m);
    let mut calibration = SelfCalibration::new(&RigConfig::default());
    // As a mismatch or a broken calibration may give them.
    let bad = [f64::NAN, f64::INFINITY, -1e300, 1e300].map(|value| {
        let seen = StereoObservation { u_left_px: value, v_px: value, u_right_px: 3.0 };
        [seen, seen]
    });
    calibration.update(&RIG, bad, &motion);
    calibration.update(&RIG, [], &motion);
    assert_eq!(calibration.report().frames, 0);
    let mut random = Random::new(1);
    let good = street(&offset(0.5), &motion, FAR_M, &mut random);
    // A frame of bad and good observations must give what the good ones alone give.
    let mut mixed = calibration.clone();
    calibration.update(&RIG, good.clone(), &motion);
    mixed.update(&RIG, good.into_iter().chain(bad), &motion);
    let digest = |calibration: &mut SelfCalibration| {
        let mut hasher = Hasher::default();
        calibration.visit(&mut hasher);
        hasher.0.finish()
    };
    assert_eq!(digest(&mut calibration), digest(&mut mixed));
    assert_eq!(calibration.report().frames, 1);
}

#[test]
fn settings_out_of_range_are_named() {
    let mut problems = crate::settings::Problems::new();
    RigConfig::default().validate(&mut problems);
    assert!(problems.is_empty());
    // Beyond the limits on both sides, and not a number.
    let wrong = DisparityCorrection {
        offset_px: 6.0,
        slope_px: f64::NAN,
        quartic_px: -9.0,
        row_quadratic_px: 5.1,
    };
    RigConfig { baseline_scale: 0.0, disparity_correction: wrong, ..RigConfig::default() }
        .validate(&mut problems);
    let keys: Vec<_> = problems.iter().map(|problem| problem.key).collect();
    let part = |name: &str| std::format!("rig.disparity_correction.{name}_px");
    assert_eq!(
        keys,
        [
            "rig.baseline_scale",
            &part("offset"),
            &part("slope"),
            &part("quartic"),
            &part("row_quadratic")
        ]
    );
}
