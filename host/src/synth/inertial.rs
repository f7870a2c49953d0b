//! Samples of an inertial unit on the street's camera: exact ones from the path, and what noise,
//! bias, a clock apart and faults make of them.
//!
//! Turn rates are those between two poses of the path a millisecond to either side, forces their
//! second differences with gravity, both in the unit's axes. Each sample's noise is a function of
//! the seed and its number.

use super::inertial_unit::{StreetUnit, UnitFault};
use super::random::Rng;
use super::street::Street;
use crate::formats::{GRAVITY_M_S2, TimedReading};
use dynvox_core::geometry::Transform;
use nalgebra::Vector3;

/// Half the time over which turns are measured, s.
const TURN_HALF_S: f64 = 1e-3;
/// Time between the three positions of an acceleration, s.
const FORCE_STEP_S: f64 = 2e-3;
/// Time before the first frame from which there are samples, s.
const BEFORE_S: f64 = 1.0;
/// Position of the unit in camera coordinates, m.
const LEVER_M: [f64; 3] = [0.27, -0.05, -0.12];
/// Rows of the rotation of the unit's axes (x forward, y left, z up) to the camera's.
const R_CAMERA_UNIT: [[f64; 3]; 3] = [[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]];
/// Turn rate at which a saturated unit ends, rad/s.
const SATURATED_RAD_S: f64 = 0.3;

/// Time from which a stuck unit repeats itself, s.
const STUCK_FROM_S: f64 = 3.0;
/// Time from gap to gap, s.
const GAP_EVERY_S: f64 = 2.0;

/// Placement of the unit in camera coordinates.
pub fn t_camera_unit() -> Transform {
    Transform::from_rotation_matrix(&R_CAMERA_UNIT, LEVER_M).normalized()
}

/// A camera that carries a unit.
pub struct Carried<'a> {
    /// The unit.
    pub unit: &'a StreetUnit,
    /// Chooses the noise.
    pub seed: u64,
    /// Time of the last frame, s.
    pub last_s: f64,
    /// Pose of the camera at a time, in a world whose y axis points down.
    pub pose: &'a dyn Fn(f64) -> Transform,
}

impl Street {
    /// Samples of the unit from a second before the first frame to the last, in order of their
    /// times, which count from frame 0; none where the street has no unit.
    pub fn inertial(&self) -> Vec<TimedReading> {
        let config = self.config();
        let Some(unit) = &config.inertial else { return Vec::new() };
        Carried {
            unit,
            seed: config.seed,
            last_s: self.time_s(config.frames.saturating_sub(1)),
            pose: &|time_s| self.t_street_camera(time_s),
        }
        .readings()
    }
}

impl Carried<'_> {
    /// Samples from a second before the first frame to the last, in order of their times; none of a
    /// unit without a rate.
    pub fn readings(&self) -> Vec<TimedReading> {
        let Self { unit, last_s, .. } = self;
        if unit.rate_hz <= 0.0 {
            return Vec::new();
        }
        let count = libm::ceil((last_s + BEFORE_S) * unit.rate_hz) as u64 + 1;
        let samples = (0..count).map(|at| (at, at as f64 / unit.rate_hz - BEFORE_S));
        samples
            .filter(|(_, time_s)| {
                let since_gap_s = time_s - GAP_EVERY_S * libm::floor(time_s / GAP_EVERY_S);
                since_gap_s >= unit.gap_s || *time_s < 0.0
            })
            .map(|(at, time_s)| self.reading(at, time_s))
            .collect()
    }

    /// Sample `at`, of a time.
    fn reading(&self, at: u64, time_s: f64) -> TimedReading {
        let unit = self.unit;
        let shown_s = match unit.fault {
            UnitFault::Stuck if time_s > STUCK_FROM_S => STUCK_FROM_S,
            _ => time_s,
        };
        let (mut turn_rate, mut force) = self.exact_reading(shown_s);
        let noise = |density: f64| density * unit.rate_hz.sqrt();
        // A stuck unit's noise is stuck, too.
        let number = if shown_s == time_s { at as i64 } else { -1 };
        let mut rng = Rng::new(self.seed, 0x01_3E27, number);
        for axis in 0..3 {
            turn_rate[axis] += unit.turn_bias_rad_s + noise(unit.turn_noise) * gaussian(&mut rng);
            force[axis] += unit.force_bias_m_s2 + noise(unit.force_noise) * gaussian(&mut rng);
        }
        match unit.fault {
            UnitFault::None | UnitFault::Stuck => {}
            UnitFault::Axes => {
                turn_rate.swap(0, 1);
                force.swap(0, 1);
            }
            UnitFault::Degrees => turn_rate = turn_rate.map(f64::to_degrees),
            UnitFault::Saturated => {
                turn_rate = turn_rate.map(|rate| rate.clamp(-SATURATED_RAD_S, SATURATED_RAD_S));
            }
        }
        let time_ns = libm::round((time_s + unit.clock_offset_s) * 1e9) as i64;
        TimedReading { time_ns, turn_rate, force }
    }

    /// Turn rate and force at a time, in the unit's axes.
    fn exact_reading(&self, time_s: f64) -> ([f64; 3], [f64; 3]) {
        let pose = |time_s: f64| (self.pose)(time_s) * t_camera_unit();
        let (before, after) = (pose(time_s - TURN_HALF_S), pose(time_s + TURN_HALF_S));
        let turned = (before.inverse() * after).normalized();
        // Rotations this small are their quaternion's vector, to a part in 10^9.
        let [x, y, z, w] = turned.rotation;
        let turn = Vector3::new(x, y, z) * (2.0 * w.signum() / (2.0 * TURN_HALF_S));
        let at = |step: f64| Vector3::from(pose(time_s + step * FORCE_STEP_S).translation_m);
        let acceleration = (at(1.0) - at(0.0) * 2.0 + at(-1.0)) / (FORCE_STEP_S * FORCE_STEP_S);
        // The street's y axis points down.
        let felt = acceleration - Vector3::new(0.0, GRAVITY_M_S2, 0.0);
        let force: [f64; 3] = pose(time_s).inverse().rotate(felt.into());
        (turn.into(), force)
    }
}

/// Gaussian number of variance 1 (Box and Muller).
fn gaussian(rng: &mut Rng) -> f64 {
    let (radius, angle) = (1.0 - rng.unit(), rng.unit());
    let turn = 2.0 * core::f64::consts::PI * angle;
    (-2.0 * libm::log(radius)).sqrt() * libm::cos(turn)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::StreetConfig;

    fn street(unit: StreetUnit, sway_deg_s: f64) -> Street {
        let config = StreetConfig {
            width: 160,
            height: 48,
            frames: 41,
            sway_deg_s,
            inertial: Some(unit),
            ..StreetConfig::static_street()
        };
        Street::new(config).unwrap()
    }

    const EXACT: StreetUnit = StreetUnit {
        rate_hz: 200.0,
        turn_noise: 0.0,
        force_noise: 0.0,
        turn_bias_rad_s: 0.0,
        force_bias_m_s2: 0.0,
        clock_offset_s: 0.0,
        gap_s: 0.0,
        fault: UnitFault::None,
    };

    #[test]
    fn turn_rates_integrate_to_the_camera_s_turn_and_forces_to_its_way() {
        let street = street(EXACT, 60.0);
        let readings = street.inertial();
        assert_eq!(readings.len(), 1_001);
        let pose = |time_s: f64| street.t_street_camera(time_s) * t_camera_unit();
        let step_s = 0.005;
        // From the first frame on, over a second: by the middle of each interval.
        let begin = readings.iter().position(|reading| reading.time_ns >= 0).unwrap();
        let mut turned = Transform::IDENTITY;
        let start = pose(0.0);
        let velocity = |time_s: f64| {
            let [a, b] = [-1e-4, 1e-4].map(|by| Vector3::from(pose(time_s + by).translation_m));
            (b - a) / 2e-4
        };
        let mut speed = velocity(0.0);
        for pair in readings[begin..begin + 201].windows(2) {
            let middle = |of: fn(&TimedReading) -> [f64; 3]| {
                (Vector3::from(of(&pair[0])) + Vector3::from(of(&pair[1]))) * 0.5
            };
            let half = middle(|reading| reading.turn_rate) * step_s;
            let force = middle(|reading| reading.force);
            let middle_turn = turned * Transform::new(half * 0.5, [0.0; 3]);
            let felt = Vector3::from((start * middle_turn).rotate(<[f64; 3]>::from(force)));
            speed += (felt + Vector3::new(0.0, GRAVITY_M_S2, 0.0)) * step_s;
            turned = (turned * Transform::new(half, [0.0; 3])).normalized();
        }
        let expected = start.inverse() * pose(1.0);
        let error = turned.inverse() * Transform { translation_m: [0.0; 3], ..expected };
        // A turn of a third of a circle and back, to a hundredth of a degree.
        assert!(error.angle_rad() < 2e-4, "{}", error.angle_rad());
        assert!((speed - velocity(1.0)).norm() < 5e-3, "{speed} {}", velocity(1.0));
        let fastest = readings.iter().map(|reading| reading.turn_rate[2].abs());
        assert!((fastest.fold(0.0, f64::max).to_degrees() - 60.0).abs() < 8.0);
    }

    #[test]
    fn a_unit_that_stands_measures_gravity_upwards_and_nothing_else() {
        let config = StreetConfig {
            speed_m_s: 0.0,
            shake: 0.0,
            frames: 3,
            inertial: Some(EXACT),
            ..StreetConfig::static_street()
        };
        let readings = Street::new(config).unwrap().inertial();
        for TimedReading { turn_rate, force, .. } in &readings {
            assert!(turn_rate.iter().all(|rate| rate.abs() < 1e-6), "{turn_rate:?}");
            let [x, y, z] = *force;
            assert!(x.abs() < 1e-3 && y.abs() < 1e-3 && (z - GRAVITY_M_S2).abs() < 1e-3);
        }
        assert!(readings.windows(2).all(|pair| pair[1].time_ns - pair[0].time_ns == 5_000_000));
        assert!(Street::new(StreetConfig::static_street()).unwrap().inertial().is_empty());
    }

    #[test]
    fn noise_bias_clock_gaps_and_faults_are_what_they_say() {
        let exact = street(EXACT, 40.0).inertial();
        let with = |change: fn(&mut StreetUnit)| {
            let mut unit = EXACT;
            change(&mut unit);
            street(unit, 40.0).inertial()
        };
        let biased = with(|unit| unit.turn_bias_rad_s = 0.1);
        assert!((biased[300].turn_rate[1] - exact[300].turn_rate[1] - 0.1).abs() < 1e-12);
        let late = with(|unit| unit.clock_offset_s = 0.03);
        assert_eq!(late[300].time_ns - exact[300].time_ns, 30_000_000);
        assert_eq!(late[300].force, exact[300].force);
        let noisy = with(|unit| unit.turn_noise = 1e-3);
        let squares =
            noisy.iter().zip(&exact).map(|(a, b)| (a.turn_rate[0] - b.turn_rate[0]).powi(2));
        let sigma = (squares.sum::<f64>() / exact.len() as f64).sqrt();
        assert!((sigma / (1e-3 * 200f64.sqrt()) - 1.0).abs() < 0.1, "{sigma}");
        assert_eq!(with(|unit| unit.turn_noise = 1e-3), noisy, "a seed is one course of noise");
        let gaps = with(|unit| unit.gap_s = 0.25);
        let longest = gaps.windows(2).map(|pair| pair[1].time_ns - pair[0].time_ns).max();
        assert_eq!(longest, Some(255_000_000));
        let axes = with(|unit| unit.fault = UnitFault::Axes);
        assert_eq!(axes[300].turn_rate[0], exact[300].turn_rate[1]);
        let degrees = with(|unit| unit.fault = UnitFault::Degrees);
        assert_eq!(degrees[300].turn_rate[2], exact[300].turn_rate[2].to_degrees());
        let stuck = with(|unit| unit.fault = UnitFault::Stuck);
        assert_eq!(stuck[790], exact[790]);
        assert!(stuck[802..].windows(2).all(|pair| pair[0].turn_rate == pair[1].turn_rate));
        let saturated = with(|unit| unit.fault = UnitFault::Saturated);
        assert!(saturated.iter().all(|reading| reading.turn_rate[2].abs() <= 0.3));
        assert!(exact.iter().any(|reading| reading.turn_rate[2].abs() > 0.6));
    }
}
