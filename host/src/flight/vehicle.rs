//! A multirotor as a point that is accelerated: bounded, delayed, and blown about. Where it is told
//! to stand it holds its place, as an autopilot's position mode does.

use dynvox_core::random::Random;

/// Largest acceleration, m/s².
const ACCELERATION_M_S2: f64 = 4.0;
/// Change of the wanted acceleration for each m/s that the speed is off, 1/s.
const GAIN_HZ: f64 = 2.5;
/// Time in which the acceleration goes two thirds of the way to what is wanted, s.
const LAG_S: f64 = 0.15;
/// Time that the vehicle is behind a speed it is told, s.
pub const FOLLOWS_S: f64 = 1.0 / GAIN_HZ + LAG_S;
/// Speed back to the place that is held, for each metre off it, 1/s (`MPC_XY_P`).
const HOLD_HZ: f64 = 0.95;
/// Below this speed the vehicle has stopped and its place is held, m/s.
const STOPPED_M_S: f64 = 0.3;
/// Time over which a gust lasts, s.
const GUST_S: f64 = 1.5;

/// Position and motion of a vehicle: right and ahead of where it began, m, at one height.
#[derive(Clone, Debug)]
pub struct Multirotor {
    /// Position, m.
    pub position_m: [f64; 2],
    /// Velocity, m/s.
    pub velocity_m_s: [f64; 2],
    acceleration_m_s2: [f64; 2],
    gust_m_s2: [f64; 2],
    gusts_m_s2: f64,
    /// Place that is held along an axis with no speed wanted, m.
    held_m: [Option<f64>; 2],
    random: Random,
}

impl Multirotor {
    /// A vehicle that hovers at the origin, among gusts of a strength (1 sigma, m/s²).
    pub fn hovering(gusts_m_s2: f64, seed: u64) -> Self {
        Self {
            position_m: [0.0; 2],
            velocity_m_s: [0.0; 2],
            acceleration_m_s2: [0.0; 2],
            gust_m_s2: [0.0; 2],
            gusts_m_s2,
            held_m: [None; 2],
            random: Random::new(seed),
        }
    }

    /// Speed, m/s.
    pub fn speed_m_s(&self) -> f64 {
        let [right, ahead] = self.velocity_m_s;
        right.hypot(ahead)
    }

    /// Flies for a short time towards a velocity.
    pub fn fly(&mut self, wanted_m_s: [f64; 2], step_s: f64) {
        let wanted_m_s = [0, 1].map(|axis| self.with_hold(axis, wanted_m_s[axis]));
        let error = [0, 1].map(|axis| GAIN_HZ * (wanted_m_s[axis] - self.velocity_m_s[axis]));
        let length = error[0].hypot(error[1]);
        let scale = if length > ACCELERATION_M_S2 { ACCELERATION_M_S2 / length } else { 1.0 };
        // A gust fades, and is fed by noise so that its strength stays.
        let keep = (-step_s / GUST_S).exp();
        let fed = self.gusts_m_s2 * (1.0 - keep * keep).sqrt();
        // Rotors take time to turn the vehicle.
        let share = 1.0 - (-step_s / LAG_S).exp();
        for (axis, error) in error.into_iter().enumerate() {
            self.gust_m_s2[axis] = keep * self.gust_m_s2[axis] + fed * self.normal();
            self.acceleration_m_s2[axis] += share * (scale * error - self.acceleration_m_s2[axis]);
            self.velocity_m_s[axis] +=
                step_s * (self.acceleration_m_s2[axis] + self.gust_m_s2[axis]);
            self.position_m[axis] += step_s * self.velocity_m_s[axis];
        }
    }

    /// The velocity along an axis: the wanted one, or that back to where the vehicle stopped.
    fn with_hold(&mut self, axis: usize, wanted_m_s: f64) -> f64 {
        let (at_m, held_m) = (self.position_m[axis], &mut self.held_m[axis]);
        if wanted_m_s != 0.0 {
            *held_m = None;
        } else if held_m.is_none() && self.velocity_m_s[axis].abs() < STOPPED_M_S {
            *held_m = Some(at_m);
        }
        held_m.map_or(wanted_m_s, |held_m| HOLD_HZ * (held_m - at_m))
    }

    /// A sum of twelve uniform numbers: close to normal, with sigma 1.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.random.fraction()).sum::<f64>() - 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vehicle_reaches_a_velocity_and_holds_it_among_gusts() {
        for gusts_m_s2 in [0.0, 0.5] {
            let mut vehicle = Multirotor::hovering(gusts_m_s2, 3);
            let mut off: f64 = 0.0;
            for step in 0..1_000 {
                vehicle.fly([0.0, 4.0], 0.02);
                if step > 200 {
                    off = off.max((vehicle.velocity_m_s[1] - 4.0).abs());
                }
            }
            assert!(off < 0.01 + 2.0 * gusts_m_s2, "{off}");
            assert!(gusts_m_s2 == 0.0 || off > 0.05, "gusts are felt: {off}");
        }
    }

    #[test]
    fn a_vehicle_that_stands_is_not_blown_away() {
        let mut vehicle = Multirotor::hovering(0.5, 7);
        let mut off_m: f64 = 0.0;
        for _ in 0..3_000 {
            vehicle.fly([0.0; 2], 0.02);
            off_m = vehicle.position_m.iter().fold(off_m, |off_m, m| off_m.max(m.abs()));
        }
        // Without a place to hold a minute of such gusts takes it some metres away.
        assert!((0.05..1.0).contains(&off_m), "{off_m}");
    }

    #[test]
    fn a_vehicle_that_stops_needs_the_way_that_its_acceleration_asks() {
        let mut vehicle = Multirotor::hovering(0.0, 1);
        (0..400).for_each(|_| vehicle.fly([0.0, 4.0], 0.02));
        let from = vehicle.position_m[1];
        (0..400).for_each(|_| vehicle.fly([0.0; 2], 0.02));
        let way_m = vehicle.position_m[1] - from;
        assert!(vehicle.speed_m_s() < 0.01 && (2.0..4.0).contains(&way_m), "{way_m}");
    }
}
