use super::*;
use crate::input::{FrameSource, StreetFrames};
use crate::synth::{Street, StreetConfig, StreetUnit, UnitFault};
use dynvox_core::inertial::InertialDoubt;

fn config(sway_deg_s: f64, unit: StreetUnit) -> StreetConfig {
    StreetConfig {
        width: 160,
        height: 48,
        frames: 150,
        sway_deg_s,
        inertial: Some(StreetUnit { rate_hz: 200.0, ..unit }),
        ..StreetConfig::static_street()
    }
}

/// Findings of a run over the street's true poses disturbed as by a good odometry, with a unit
/// whose turn is `map` of the camera's and what the mapper reports otherwise.
fn found(
    sway_deg_s: f64,
    report: &InertialReport,
    map: impl Fn([f64; 3]) -> [f64; 3],
) -> UnitFindings {
    let config = config(sway_deg_s, StreetUnit::default());
    let street = Street::new(config.clone()).unwrap();
    let source = StreetFrames::new(config).unwrap();
    let unit = source.info().inertial.clone().unwrap();
    let mut random = dynvox_core::random::Random::new(5);
    let mut noise = |size: f64| {
        std::array::from_fn::<f64, 3, _>(|_| size * (f64::from(random.below(2_001)) / 1e3 - 1.0))
    };
    let (mut record, mut before) = (UnitRecord::default(), Transform::IDENTITY);
    for index in 0..150u32 {
        let pose = street.t_world_camera(index);
        let turn = rotation_vector(&(before.inverse() * pose));
        before = pose;
        // The unit's own axes are those that are mixed up.
        let mapped = map(unit.t_camera_unit.inverse().rotate(turn));
        let turn = unit.t_camera_unit.rotate(mapped).map(|rad| rad as f32);
        let mut report = *report;
        report.turn_rad = (index > 0).then_some(turn);
        let frame = FramePose {
            time_ns: (street.time_s(index) * 1e9).round() as i64,
            segment: MapSegment::FIRST,
            t_world_camera: (pose * Transform::new(noise(3e-4), noise(5e-3))).normalized(),
            is_measured: true,
        };
        record.add(&frame, Some(&report));
    }
    record.findings(&unit)
}

/// Report of a mapper that knows its unit.
fn known() -> InertialReport {
    let mut report = InertialReport::default();
    report.samples = 20;
    report.trusted = true;
    report.turn_bias = [0.02; 3];
    report.clock_offset_s = -0.012;
    report.clock_offset_sigma_s = 0.002;
    report.vertical = Some(Vertical { up_world: [0.0, -1.0, 0.0], sigma_rad: 0.005 });
    report
}

#[test]
fn what_the_mapper_knows_is_told_in_a_line_and_in_figures() {
    let found = found(40.0, &known(), |turn| turn);
    let agreement = found.agreement.unwrap();
    assert_eq!((agreement.intervals, found.frames_without), (149, 0));
    assert!(agreement.difference_deg < 0.03 && agreement.turn_deg > 1.0, "{agreement:?}");
    assert!((found.clock_ms().unwrap()[0] - 12.0).abs() < 1e-3);
    assert!(!found.is_doubted());
    let line = found.sentence();
    assert!(line.contains("its clock is 12.0 ms ahead of the cameras' (sigma 2.0)"), "{line}");
    assert!(line.contains("bias 0.0346 rad/s") && line.contains("leans 0.0 degrees"), "{line}");
}

#[test]
fn a_clock_that_turns_hardly_tell_is_not_told() {
    let mut report = known();
    (report.clock_offset_s, report.clock_offset_sigma_s) = (-0.01, 0.03);
    let vague = found(0.0, &report, |turn| turn);
    assert_eq!(vague.clock_ms(), None);
    assert!(vague.sentence().contains("could not be compared"), "{}", vague.sentence());
    // A large offset is told with its sigma, however large.
    report.clock_offset_s = -0.09;
    let large = found(0.0, &report, |turn| turn);
    assert!(large.sentence().contains("90.0 ms ahead"), "{}", large.sentence());
}

#[test]
fn exchanged_axes_are_named_also_where_the_camera_hardly_turns_about_them() {
    for sway_deg_s in [0.0, 60.0] {
        let doubted = found(sway_deg_s, &known(), |[x, y, z]| [y, x, z]);
        let fit = UnitDoubt::Axes { fit: ["y", "x", "z"] };
        // A camera that turns about the vertical shows only that axis.
        if sway_deg_s == 0.0 {
            assert_eq!(doubted.doubt, Some(fit), "{}", doubted.sentence());
            assert_eq!(doubted.vertical, None);
        }
        let turned = found(sway_deg_s, &known(), |[x, y, z]| [x, -z, y]);
        let fit = UnitDoubt::Axes { fit: ["x", "z", "-y"] };
        assert_eq!(turned.doubt, Some(fit), "{sway_deg_s}: {}", turned.sentence());
    }
    assert_eq!(found(60.0, &known(), |turn| turn).doubt, None);
}

#[test]
fn doubts_of_the_mapper_have_a_sentence_each() {
    let doubt = |doubt| {
        let mut report = known();
        (report.trusted, report.doubt) = (false, Some(doubt));
        let found = found(60.0, &report, |turn| turn);
        assert_eq!((found.vertical, found.clock_ms()), (None, None));
        found.doubt.unwrap()
    };
    use InertialDoubt as Known;
    let pairs = [
        (Known::Degrees, UnitDoubt::Degrees),
        (Known::Stuck, UnitDoubt::Stuck),
        (Known::Saturated, UnitDoubt::Saturated),
        (Known::ClocksApart, UnitDoubt::ClocksApart),
        (Known::Contradicts, UnitDoubt::Disagrees),
        (Known::WrongAxes, UnitDoubt::Disagrees),
    ];
    for (known, expected) in pairs {
        assert_eq!(doubt(known), expected);
    }
}

#[test]
fn the_range_of_a_sensor_is_told_by_the_rates_that_end_at_it() {
    let range = |fault| {
        let unit = StreetUnit { fault, ..StreetUnit::default() };
        let source = StreetFrames::new(config(60.0, unit)).unwrap();
        source.info().inertial.as_ref().unwrap().config().turn_range
    };
    assert_eq!((range(UnitFault::None), range(UnitFault::Saturated)), (34.0, 0.3));
}

#[test]
fn frames_without_samples_are_counted_and_too_few_turns_say_nothing() {
    let unit = StreetFrames::new(config(0.0, StreetUnit::default())).unwrap();
    let unit = unit.info().inertial.clone().unwrap();
    let mut record = UnitRecord::default();
    for at in 0..5 {
        let frame = FramePose {
            time_ns: at * 100_000_000,
            segment: MapSegment::FIRST,
            t_world_camera: Transform::IDENTITY,
            is_measured: true,
        };
        let mut report = known();
        report.samples = u32::from(at % 2 == 0);
        record.add(&frame, Some(&report));
    }
    let found = record.findings(&unit);
    assert_eq!((found.frames_without, found.agreement, &found.doubt), (2, None, &None));
    assert!(found.sentence().contains("2 frames without"), "{}", found.sentence());
    assert!(found.sentence().contains("too few turns"), "{}", found.sentence());
}
