//! The vertical in the map, from specific forces and the camera's poses (a complementary filter).
//!
//! Over two intervals the mean force, turned into the map, is the acceleration plus what holds the
//! unit against gravity. The acceleration is known from the unit's positions: the difference of two
//! mean velocities. What remains points up; its mean over [`WINDOW_S`] is kept.

use super::InertialUnit;
use crate::state::Visitor;
use nalgebra::{Point3, Vector3};

/// Time over which the mean is taken, s: poses drift over longer ones.
const WINDOW_S: f64 = 30.0;
/// Time after which there is a vertical, s.
const FIRST_S: f64 = 1.0;
/// Size of the mean that can be that of gravity, m/s2.
const GRAVITY: core::ops::Range<f64> = 9.0..10.6;
/// Remainders this many frames apart are independent: an error of a position is in three of them.
const CORRELATED_FRAMES: f64 = 4.0;

/// Interval between two frames as the vertical needs it.
#[derive(Clone, Copy, Debug)]
pub(super) struct UnitMotion {
    /// Mean specific force in the map's axes, m/s2.
    pub force_world: Vector3<f64>,
    /// Unit's position in the map at the start and at the end, m.
    pub from: Point3<f64>,
    pub to: Point3<f64>,
    pub span_s: f64,
}

/// Direction that points up in the map, with its error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Vertical {
    /// Unit vector that points up, in the coordinates of `t_world_camera`.
    pub up_world: [f32; 3],
    /// Standard deviation of its angle, rad.
    pub sigma_rad: f32,
}

/// Running mean of what remains of the forces.
#[derive(Clone, Debug, Default)]
pub(super) struct VerticalFilter {
    /// Mean velocity, force and length of the interval before.
    velocity: [f64; 3],
    force: [f64; 3],
    span_s: f64,
    mean: [f64; 3],
    /// Mean square of the remainders' distance from the mean, m2/s4.
    spread2: f64,
    /// Time and remainders that the mean stands for.
    time_s: f64,
    frames: f64,
}

impl VerticalFilter {
    /// Forgets the interval before: the next one does not follow it.
    pub fn interrupt(&mut self) {
        self.span_s = 0.0;
    }

    /// Adds an interval that follows the one before.
    pub fn add(&mut self, motion: &UnitMotion) {
        let velocity = (motion.to - motion.from) / motion.span_s;
        let before_s = self.span_s;
        if before_s > 0.0 {
            let both_s = before_s + motion.span_s;
            let acceleration = (velocity - Vector3::from(self.velocity)) * (2.0 / both_s);
            let force = (motion.force_world * motion.span_s + Vector3::from(self.force) * before_s)
                / both_s;
            self.add_remainder(&(force - acceleration), motion.span_s);
        }
        (self.velocity, self.force, self.span_s) =
            (velocity.into(), motion.force_world.into(), motion.span_s);
    }

    fn add_remainder(&mut self, up: &Vector3<f64>, span_s: f64) {
        if !up.iter().all(|part| part.is_finite()) {
            return;
        }
        // Old remainders fade once the window is full.
        let fade = if self.time_s < WINDOW_S { 1.0 } else { 1.0 - span_s / WINDOW_S };
        let fade = if fade > 0.0 { fade } else { 0.0 };
        (self.time_s, self.frames) = (self.time_s * fade + span_s, self.frames * fade + 1.0);
        // The mean of all while the window fills, and of the last ones after that.
        let share = 1.0 / self.frames;
        let mean = Vector3::from(self.mean);
        let off = up - mean;
        self.mean = (mean + off * share).into();
        self.spread2 += (off.norm_squared() * (1.0 - share) - self.spread2) * share;
    }

    /// The vertical, once there is one.
    pub fn vertical(&self, unit: &InertialUnit) -> Option<Vertical> {
        let (held, sigma) = self.held(unit)?;
        let size = held.norm();
        let up: [f64; 3] = (held / size).into();
        Some(Vertical {
            up_world: up.map(|part| part as f32),
            // Two of three axes tilt the vertical.
            sigma_rad: (libm::sqrt(2.0) * sigma / size) as f32,
        })
    }

    /// Force that holds the unit against gravity in the map's axes, m/s2, and the standard
    /// deviation of an axis, once they are known.
    pub fn held(&self, unit: &InertialUnit) -> Option<(Vector3<f64>, f64)> {
        let mean = Vector3::from(self.mean);
        if self.time_s < FIRST_S || !GRAVITY.contains(&mean.norm()) {
            return None;
        }
        let independent = self.frames / CORRELATED_FRAMES;
        let independent = if independent > 1.0 { independent } else { 1.0 };
        let variance = self.spread2 / independent / 3.0;
        let bias = unit.force_bias_sigma;
        Some((mean, libm::sqrt(variance + bias * bias)))
    }

    /// Visits every field.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { velocity, force, span_s, mean, spread2, time_s, frames } = self;
        visitor.f64s(velocity.iter_mut().chain(force).chain(mean));
        visitor.f64s([span_s, spread2, time_s, frames]);
    }
}
