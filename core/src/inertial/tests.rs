//! A camera that turns by a known law, with a unit that errs in known ways.

use super::*;
use crate::{
    egomotion::PredictedTurn,
    geometry::{MapSegment, Transform},
};
use nalgebra::Vector3;
use std::vec::Vec;

/// Time between frames and between samples, s.
const FRAME_S: f64 = 0.1;
const SAMPLE_S: f64 = 0.005;

/// Errors of a unit.
#[derive(Clone, Copy)]
struct Flaws {
    bias: [f64; 3],
    /// Added to the samples' stamps, s.
    late_s: f64,
    scale: f64,
    /// One of so many samples is there.
    every: usize,
    /// Axes that readings come from.
    axes: [usize; 3],
    /// Frames from which on and until which readings are the first of them.
    stuck: [usize; 2],
    range: f64,
}

const SOUND: Flaws = Flaws {
    bias: [0.0; 3],
    late_s: 0.0,
    scale: 1.0,
    every: 1,
    axes: [0, 1, 2],
    stuck: [usize::MAX; 2],
    range: f64::MAX,
};

/// Measurement of a frame at a pose, without the motion to it.
fn seen_at(t_world_camera: Transform) -> MeasuredMotion {
    MeasuredMotion {
        t_reference_now: None,
        sigma_rad: 0.0005,
        way_sigma_m: 0.005,
        strong: true,
        over_several: false,
        turned: false,
        refused: false,
        t_world_before: None,
        t_world_camera,
        segment: MapSegment::FIRST,
    }
}

/// Camera to world at a time: turns about all three axes, and a swaying way.
fn pose(t: f64) -> Transform {
    let turn = [0.12 * (2.1 * t).sin(), 0.5 * (1.3 * t).sin(), 0.1 * (1.7 * t).cos()];
    let at = [0.6 * (0.9 * t).sin(), 0.05 * (3.0 * t).sin(), 1.4 * t];
    Transform::new(turn, at)
}

/// Unit to camera: as KITTI's, x ahead, y to the left, z up.
fn mounting() -> Transform {
    let rows = [[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]];
    Transform::from_rotation_matrix(&rows, [-0.3, 0.7, -1.1])
}

/// Readings of a unit without flaws, from differences of poses; down is y.
fn exact(t: f64) -> ([f64; 3], [f64; 3]) {
    let unit = |t: f64| pose(t) * mounting();
    let h = 1e-4;
    let turn = (unit(t - h).inverse() * unit(t + h)).rotation_vector();
    let turn = Vector3::from(turn) / (2.0 * h);
    let at = |t: f64| unit(t).translation();
    let acceleration = (at(t + h) - at(t) * 2.0 + at(t - h)) / (h * h);
    let felt = acceleration + Vector3::new(0.0, -9.81, 0.0);
    (turn.into(), unit(t).inverse().rotate(felt).into())
}

struct Sim {
    prior: InertialPrior,
    flaws: Flaws,
    frame: usize,
    noise: u32,
}

impl Sim {
    fn new(flaws: Flaws) -> Self {
        let unit = InertialUnit { turn_range: 2.0, ..InertialUnit::new(mounting()) };
        Self { prior: InertialPrior::new(&unit), flaws, frame: 0, noise: 1 }
    }

    /// Uniform between -1 and 1.
    fn noise(&mut self) -> f64 {
        self.noise = self.noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.noise >> 8) / f64::from(1 << 23) - 1.0
    }

    fn samples(&mut self) -> Vec<InertialSample> {
        let (flaws, frame) = (self.flaws, self.frame);
        let per_frame = (FRAME_S / SAMPLE_S).round() as usize;
        let is_stuck = (flaws.stuck[0]..flaws.stuck[1]).contains(&frame);
        // Stamps since the frame before; the first frame is at 10 s.
        (1..=per_frame)
            .step_by(flaws.every)
            .map(|at| {
                let stamp_s = (frame as f64 - 1.0) * FRAME_S + at as f64 * SAMPLE_S;
                let (turn, force) = exact(if is_stuck { 0.0 } else { stamp_s - flaws.late_s });
                let mut rate = |axis: usize| {
                    let noise = if is_stuck { 0.0 } else { 0.002 * self.noise() };
                    let rate = turn[flaws.axes[axis]] * flaws.scale + flaws.bias[axis] + noise;
                    if rate.abs() > flaws.range { flaws.range.copysign(rate) } else { rate }
                };
                InertialSample {
                    time_ns: ((10.0 + stamp_s) * 1e9).round() as u64,
                    turn_rate: [rate(0), rate(1), rate(2)],
                    force,
                }
            })
            .collect()
    }

    /// One frame; the camera sees its own motion to a part of a milliradian.
    fn step(&mut self) -> (Option<PredictedTurn>, InertialReport) {
        let samples = self.samples();
        let t = self.frame as f64 * FRAME_S;
        let time_ns = ((10.0 + t) * 1e9).round() as u64;
        let predicted = self.prior.predict(Some(time_ns), &samples, 0, &pose(t - FRAME_S));
        let off = [self.noise(), self.noise(), self.noise()].map(|noise| 0.0005 * noise);
        let before = pose(t - FRAME_S);
        let motion = before.inverse() * pose(t) * Transform::new(off, [0.0; 3]);
        self.prior.observe(&MeasuredMotion {
            t_reference_now: (self.frame > 0).then_some(motion),
            t_world_before: (self.frame > 0).then_some(before),
            ..seen_at(pose(t))
        });
        self.frame += 1;
        (predicted, self.prior.report())
    }

    fn run(&mut self, frames: usize) -> InertialReport {
        (0..frames).map(|_| self.step().1).last().unwrap()
    }
}

#[test]
fn a_sound_unit_is_trusted_and_predicts_the_turn() {
    let mut sim = Sim::new(SOUND);
    let report = sim.run(30);
    assert!(report.trusted && report.doubt.is_none(), "{report:?}");
    for frame in 30..60 {
        let predicted = sim.step().0.expect("it is trusted").last;
        let t = frame as f64 * FRAME_S;
        let exact = pose(t - FRAME_S).inverse() * pose(t);
        let off = (exact.inverse() * predicted.t_before_now).angle_rad();
        assert!(off < 0.002, "{off}");
        assert!(off < 3.0 * predicted.variance.sqrt(), "{off} {}", predicted.variance.sqrt());
    }
}

#[test]
fn a_bias_of_a_tenth_is_found() {
    let bias = [0.1, -0.1, 0.05];
    let report = Sim::new(Flaws { bias, ..SOUND }).run(60);
    assert!(report.trusted, "{report:?}");
    for (found, bias) in report.turn_bias.iter().zip(bias) {
        let off = (f64::from(*found) - bias).abs();
        assert!(off < 0.003 && off < 4.0 * f64::from(report.turn_bias_sigma), "{report:?}");
    }
}

#[test]
fn a_camera_in_the_dark_goes_on_by_forces_once_up_is_known() {
    let mut sim = Sim::new(Flaws { bias: [0.01, -0.02, 0.01], ..SOUND });
    sim.run(60);
    // Five dark frames at ten places of the way.
    let mut sums = [0.0; 2];
    for _ in 0..10 {
        sim.run(7);
        let begin = sim.frame as f64 * FRAME_S - FRAME_S;
        let (mut guess, mut way_on) = (pose(begin), pose(begin));
        let last = pose(begin - FRAME_S).inverse() * pose(begin);
        for _ in 0..5 {
            let samples = sim.samples();
            let t = sim.frame as f64 * FRAME_S;
            let time_ns = ((10.0 + t) * 1e9).round() as u64;
            let predicted = sim.prior.predict(Some(time_ns), &samples, 0, &guess);
            guess = guess * predicted.expect("it is trusted").last.t_before_now;
            way_on = way_on * last;
            sim.prior.observe(&MeasuredMotion { strong: false, turned: true, ..seen_at(guess) });
            sim.frame += 1;
        }
        let truth = pose(begin + 5.0 * FRAME_S);
        let off = (guess.inverse() * truth).distance_m();
        let off_on = (way_on.inverse() * truth).distance_m();
        assert!(off < 0.03, "{off} m, as before {off_on}");
        sums = [sums[0] + off, sums[1] + off_on];
    }
    assert!(sums[0] < 0.3 * sums[1], "{sums:?}");
}

#[test]
fn a_way_of_what_moves_is_not_believed_once_and_is_if_it_repeats() {
    let mut sim = Sim::new(SOUND);
    sim.run(60);
    // Somebody who walks by carries the camera 0.3 m to the right in a frame.
    let mut aside_m = 0.0;
    let mut frame = || {
        let before = Transform::from_translation([aside_m, 0.0, 0.0])
            * pose(sim.frame as f64 * FRAME_S - FRAME_S);
        aside_m += 0.3;
        let t = sim.frame as f64 * FRAME_S;
        let now = Transform::from_translation([aside_m, 0.0, 0.0]) * pose(t);
        let samples = sim.samples();
        let time_ns = ((10.0 + t) * 1e9).round() as u64;
        let predicted = sim.prior.predict(Some(time_ns), &samples, 0, &before).unwrap();
        sim.prior.observe(&MeasuredMotion {
            t_reference_now: Some(pose(t - FRAME_S).inverse() * pose(t)),
            t_world_before: Some(before),
            ..seen_at(now)
        });
        sim.frame += 1;
        // Way in the world that forces led to, less the true one.
        let led = before * predicted.last.t_before_now;
        let way = led.translation() - before.translation();
        (way - (pose(t).translation() - pose(t - FRAME_S).translation())).x
    };
    let first = [frame(), frame()];
    assert!(first.iter().all(|off_m: &f64| off_m.abs() < 0.01), "{first:?}");
    let last = (0..10).map(|_| frame()).last().unwrap();
    assert!((last - 0.3).abs() < 0.05, "{last}");
}

#[test]
fn stamps_late_or_early_by_30_ms_are_found() {
    for late_s in [0.03, -0.03, 0.012] {
        let report = Sim::new(Flaws { late_s, ..SOUND }).run(80);
        let off = (f64::from(report.clock_offset_s) + late_s).abs();
        assert!(report.trusted && off < 0.003, "{late_s}: {report:?}");
        assert!(off < 4.0 * f64::from(report.clock_offset_sigma_s), "{late_s}: {report:?}");
    }
}

#[test]
fn few_samples_of_a_clock_a_frame_ahead_earn_trust_once_they_cover_a_turn() {
    // Ten samples a second that come a frame late: none ever reaches a frame's own end.
    let mut sim = Sim::new(Flaws { late_s: 0.1, every: 20, ..SOUND });
    let report = sim.run(80);
    assert!(report.trusted && report.doubt.is_none(), "{report:?}");
    let off = (f64::from(report.clock_offset_s) + 0.1).abs();
    assert!(off < 2.0 * f64::from(report.clock_offset_sigma_s), "{report:?}");
    // A turn whose end is open is known that badly.
    assert!(report.turn_sigma_rad > 0.005, "{report:?}");
    // The same with axes exchanged is never trusted.
    let mut sim = Sim::new(Flaws { late_s: 0.1, every: 20, axes: [2, 0, 1], ..SOUND });
    assert_eq!((0..80).filter(|_| sim.step().0.is_some()).count(), 0);
}

#[test]
fn axes_degrees_and_range_are_named_and_such_units_not_used() {
    let cases = [
        Flaws { axes: [2, 0, 1], ..SOUND },
        Flaws { scale: 57.3, ..SOUND },
        Flaws { scale: 57.3, range: 1.9, ..SOUND },
        Flaws { scale: -1.0, ..SOUND },
    ];
    for flaws in cases {
        let mut sim = Sim::new(flaws);
        let used = (0..80).filter(|_| sim.step().0.is_some()).count();
        let report = sim.prior.report();
        assert!(report.doubt.is_some() && !report.trusted, "{report:?}");
        assert_eq!(used, 0, "{report:?}");
    }
    let doubt = |flaws| Sim::new(flaws).run(60).doubt;
    assert_eq!(doubt(Flaws { axes: [2, 0, 1], ..SOUND }), Some(InertialDoubt::WrongAxes));
    assert_eq!(doubt(Flaws { range: 2.0, scale: 9.0, ..SOUND }), Some(InertialDoubt::Saturated));
    // A unit with a range of 2,000 degrees a second, in degrees.
    let mut sim = Sim::new(Flaws { scale: 57.29578, ..SOUND });
    let unit = InertialUnit { turn_range: 2_000.0, ..InertialUnit::new(mounting()) };
    sim.prior = InertialPrior::new(&unit);
    assert_eq!(sim.run(60).doubt, Some(InertialDoubt::Degrees));
}

#[test]
fn a_unit_that_is_stuck_for_a_while_is_used_again_when_it_agrees() {
    let mut sim = Sim::new(Flaws { stuck: [40, 60], ..SOUND });
    assert!(sim.run(40).trusted);
    let stuck = sim.run(10);
    assert_eq!((stuck.trusted, stuck.doubt), (false, Some(InertialDoubt::Stuck)));
    let after = sim.run(40);
    assert_eq!((after.trusted, after.doubt), (true, None));
}

#[test]
fn clocks_of_another_day_are_named() {
    let report = Sim::new(Flaws { late_s: 0.0, ..SOUND }).run(20);
    assert!(report.doubt.is_none());
    let mut sim = Sim::new(SOUND);
    let samples = sim.samples();
    for frame in 0..5u64 {
        let time_ns = Some(900_000_000_000 + frame * 100_000_000);
        sim.prior.predict(time_ns, &samples, 0, &Transform::IDENTITY);
    }
    assert_eq!(sim.prior.report().doubt, Some(InertialDoubt::ClocksApart));
}

#[test]
fn the_vertical_is_right_within_its_sigma_on_a_swaying_way() {
    let mut sim = Sim::new(SOUND);
    assert_eq!(sim.run(9).vertical, None, "too early to tell");
    sim.run(41);
    for _ in 0..100 {
        let vertical = sim.step().1.vertical.expect("after five seconds");
        let up = Vector3::from(vertical.up_world.map(f64::from));
        let off = up.cross(&Vector3::new(0.0, -1.0, 0.0)).norm().asin();
        assert!(off.to_degrees() < 0.3, "{}", off.to_degrees());
        assert!(off < 2.0 * f64::from(vertical.sigma_rad), "{off} {}", vertical.sigma_rad);
    }
}

#[test]
fn a_force_of_no_unit_is_forgotten() {
    let mut sim = Sim::new(SOUND);
    sim.run(60);
    let t = sim.frame as f64 * FRAME_S;
    let mut samples = sim.samples();
    samples.iter_mut().for_each(|sample| sample.force = [1e300, -1e300, 1e300]);
    let time_ns = Some(((10.0 + t) * 1e9).round() as u64);
    sim.prior.predict(time_ns, &samples, 0, &pose(t - FRAME_S));
    sim.prior
        .observe(&MeasuredMotion { t_world_before: Some(pose(t - FRAME_S)), ..seen_at(pose(t)) });
    sim.frame += 1;
    let vertical = sim.run(30).vertical.expect("it is known still");
    let up = Vector3::from(vertical.up_world.map(f64::from));
    let off = up.cross(&Vector3::new(0.0, -1.0, 0.0)).norm().asin();
    assert!(off.to_degrees() < 0.3, "{}", off.to_degrees());
    let t = sim.frame as f64 * FRAME_S;
    let samples = sim.samples();
    let time_ns = Some(((10.0 + t) * 1e9).round() as u64);
    let predicted = sim.prior.predict(time_ns, &samples, 0, &pose(t - FRAME_S));
    let way_sigma_m = predicted.and_then(|predicted| predicted.way_sigma_m);
    assert!(way_sigma_m.is_some_and(|sigma_m| sigma_m < 0.02), "{way_sigma_m:?}");
}

#[test]
fn a_turn_over_several_frames_adds_up_and_ends_where_samples_are_missing() {
    let mut sim = Sim::new(SOUND);
    sim.run(30);
    let mut whole = None;
    for since in 0..4u32 {
        let samples = sim.samples();
        let time_ns = ((10.0 + sim.frame as f64 * FRAME_S) * 1e9).round() as u64;
        let before = pose(sim.frame as f64 * FRAME_S - FRAME_S);
        whole = sim.prior.predict(Some(time_ns), &samples, since, &before).unwrap().whole;
        sim.frame += 1;
    }
    let exact = pose(2.9).inverse() * pose(3.3);
    let off = (exact.inverse() * whole.unwrap().t_before_now).angle_rad();
    assert!(off < 0.003, "{off}");
    // A second without samples: no turn, nor one since the reference after it.
    let at = |frame: usize| Some(((10.0 + frame as f64 * FRAME_S) * 1e9).round() as u64);
    sim.frame += 10;
    assert!(sim.prior.predict(at(sim.frame - 1), &[], 4, &Transform::IDENTITY).is_none());
    let samples = sim.samples();
    let after = sim.prior.predict(at(sim.frame), &samples, 5, &Transform::IDENTITY);
    assert!(after.is_none_or(|turn| turn.whole.is_none()));
}
