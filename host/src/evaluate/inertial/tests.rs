use super::*;
use crate::input::{FrameSource, StreetFrames};
use crate::synth::{Street, StreetConfig, StreetUnit, UnitFault};

/// Unit and true poses of a street of 15 s, with noise in the poses as of a good odometry.
fn street(sway_deg_s: f64, change: impl Fn(&mut StreetUnit)) -> (UnitFindings, f64) {
    let mut unit = StreetUnit {
        rate_hz: 200.0,
        turn_noise: 2.4e-4,
        force_noise: 1.5e-3,
        ..StreetUnit::default()
    };
    change(&mut unit);
    let config = StreetConfig {
        width: 160,
        height: 48,
        frames: 150,
        sway_deg_s,
        inertial: Some(unit),
        ..StreetConfig::static_street()
    };
    let street = Street::new(config.clone()).unwrap();
    let source = StreetFrames::new(config).unwrap();
    let mut random = dynvox_core::random::Random::new(5);
    let mut noise = |size: f64| {
        std::array::from_fn::<f64, 3, _>(|_| size * (f64::from(random.below(2_001)) / 1e3 - 1.0))
    };
    let frames: Vec<FramePose> = (0..150u32)
        .map(|index| {
            let error = Transform::new(noise(3e-4), noise(5e-3));
            FramePose {
                time_ns: (street.time_s(index) * 1e9).round() as i64,
                segment: MapSegment::FIRST,
                t_world_camera: (street.t_world_camera(index) * error).normalized(),
                is_measured: true,
            }
        })
        .collect();
    let found = UnitFindings::new(source.info().inertial.as_ref().unwrap(), &frames);
    let up = nalgebra::Vector3::from(street.up_in_world());
    let error = found.vertical.map_or(f64::NAN, |vertical| {
        up.dot(&nalgebra::Vector3::from(vertical.up_world)).clamp(-1.0, 1.0).acos().to_degrees()
    });
    (found, error)
}

#[test]
fn clock_bias_and_vertical_are_found_on_a_swaying_and_a_calm_camera() {
    for sway_deg_s in [0.0, 40.0, 200.0] {
        let (found, error_deg) = street(sway_deg_s, |unit| {
            unit.clock_offset_s = 0.012;
            unit.turn_bias_rad_s = 0.02;
            unit.force_bias_m_s2 = 0.03;
        });
        let agreement = found.agreement.clone().unwrap();
        assert_eq!(agreement.doubt, None, "{sway_deg_s}: {}", found.sentence());
        for bias in agreement.turn_bias_rad_s {
            assert!((bias - 0.02).abs() < 2e-3, "{sway_deg_s}: {}", found.sentence());
        }
        // A calm camera tells less of the clock, and says so.
        let offset_ms = agreement.clock_offset_ms.unwrap();
        let sigma_ms = agreement.clock_offset_sigma_ms;
        assert!((offset_ms - 12.0).abs() < 3.0 * sigma_ms.max(0.2), "{sway_deg_s}: {offset_ms}");
        assert!(sigma_ms < if sway_deg_s > 0.0 { 1.0 } else { 10.0 }, "{sway_deg_s}: {sigma_ms}");
        let vertical = found.vertical.unwrap();
        assert!(
            error_deg < 0.3 && error_deg < 2.0 * vertical.sigma_deg,
            "{sway_deg_s}: {error_deg}"
        );
        assert!(vertical.sigma_deg < 0.6, "{}", found.sentence());
        let line = found.sentence();
        assert!(line.contains("ms ahead of the cameras'") && line.contains("leans"), "{line}");
    }
}

#[test]
fn planted_faults_are_named_and_tell_no_vertical() {
    for (fault, expected) in [
        (UnitFault::Axes, UnitDoubt::Axes { fit: ["y", "x", "z"] }),
        (UnitFault::Degrees, UnitDoubt::Degrees),
    ] {
        for sway_deg_s in [0.0, 60.0] {
            let (found, _) = street(sway_deg_s, |unit| unit.fault = fault);
            let doubt = found.agreement.as_ref().and_then(|found| found.doubt.clone());
            // A camera that turns about the vertical shows only that axis.
            let is_hidden = fault == UnitFault::Axes && sway_deg_s > 0.0;
            assert!(
                is_hidden || doubt == Some(expected.clone()),
                "{sway_deg_s}: {}",
                found.sentence()
            );
            assert!(is_hidden || found.vertical.is_none() && found.is_doubted());
        }
    }
    let doubt = |fault| {
        let (found, _) = street(60.0, |unit| unit.fault = fault);
        found.agreement.and_then(|found| found.doubt)
    };
    assert!(matches!(doubt(UnitFault::Stuck), Some(UnitDoubt::Stuck(share)) if share > 0.5));
    assert_eq!(doubt(UnitFault::Saturated), Some(UnitDoubt::Saturated(0.3)));
    assert_eq!(doubt(UnitFault::None), None);
}

#[test]
fn gaps_are_counted_and_what_lies_in_them_is_not_compared() {
    let (found, error_deg) = street(40.0, |unit| unit.gap_s = 0.25);
    assert_eq!(found.frames_without, 16, "twice in each of eight gaps");
    assert!((found.longest_gap_s - 0.255).abs() < 1e-9);
    let agreement = found.agreement.clone().unwrap();
    assert!(agreement.doubt.is_none() && agreement.intervals < 130, "{}", found.sentence());
    assert!(error_deg < 0.5, "{error_deg}");
    assert!(found.sentence().contains("16 frames without (longest gap 0.26 s)"));
}

#[test]
fn too_few_frames_say_nothing() {
    let config = StreetConfig {
        width: 160,
        height: 48,
        frames: 4,
        inertial: Some(StreetUnit { rate_hz: 100.0, ..StreetUnit::default() }),
        ..StreetConfig::static_street()
    };
    let source = StreetFrames::new(config).unwrap();
    let unit = source.info().inertial.clone().unwrap();
    let found = UnitFindings::new(&unit, &[]);
    assert_eq!((found.agreement, found.vertical, found.frames_without), (None, None, 0));
}

#[dynvox_needs::clips("kitti-odometry/inertial/r1405.csv")]
#[test]
fn a_car_s_own_unit_agrees_with_its_odometry_over_gaps() {
    let data = std::path::Path::new(dynvox_needs::data_folder!()).join("kitti-odometry");
    let options = crate::input::OpenOptions {
        inertial: crate::input::InertialChoice::File(data.join("inertial/r1405.csv")),
        ..Default::default()
    };
    let source = crate::input::open(&data.join("sequences/r1405"), &options).unwrap();
    let poses = crate::formats::read_poses(&data.join("poses/r1405.vo.txt")).unwrap().poses;
    let frame = |(at, t_world_camera): (usize, &Transform)| FramePose {
        time_ns: source.stamp_ns(at).unwrap() as i64,
        segment: MapSegment::FIRST,
        t_world_camera: *t_world_camera,
        is_measured: true,
    };
    let frames: Vec<FramePose> = poses.iter().enumerate().map(frame).collect();
    let found = UnitFindings::new(source.info().inertial.as_deref().unwrap(), &frames);
    println!("{}", found.sentence());
    let agreement = found.agreement.clone().unwrap();
    assert_eq!(agreement.doubt, None, "{}", found.sentence());
    assert!(agreement.intervals > 60 && found.frames_without > 0, "{}", found.sentence());
    assert!(agreement.difference_deg < 0.2, "{}", found.sentence());
    let vertical = found.vertical.unwrap();
    // The camera is mounted upright on a car on a level street.
    assert!(vertical.lean_deg() < 3.0 + vertical.sigma_deg, "{}", found.sentence());
}
