//! Bias of the turn rates and offset of the clock, from turns that images measured (a Kalman
//! filter of four states).
//!
//! With a bias too small by b and an offset too small by d, an integrated turn exceeds the measured
//! one by `b * span + d * (rate at the end - rate at the start)`: a camera that does not change its
//! turn says nothing of the clock, one that stands says all of the bias.

use super::{
    InertialUnit,
    covariance::{Covariance, root},
    integral::{BRIDGED_MAX_S, Integral},
};
use crate::state::Visitor;
use nalgebra::Vector3;

/// Offset of the clock before any turn was compared, one sigma, s.
const OFFSET_SIGMA_S: f64 = 0.03;
/// Largest offset that is corrected, s: farther apart, no turn can be compared.
pub(super) const OFFSET_MAX_S: f64 = 0.15;
/// Largest bias that is corrected, rad/s.
const BIAS_MAX: f64 = 0.5;
/// Change of the offset, s per square root of a second: quartz clocks drift by some 10 ppm.
const OFFSET_WALK: f64 = 1e-4;
/// Error of an offset as a share of the time between samples, one sigma.
const INTERVAL_SHARE: f64 = 0.3;
/// Share of the last interval in their mean square.
const INTERVAL_MEMORY: f64 = 1.0 / 32.0;
/// Errors beyond so many sigmas are of something else.
const GATE_SIGMAS: f64 = 5.0;

/// Measured turn less the predicted one, with what it depends on.
#[derive(Clone, Copy, Debug)]
pub(super) struct TurnError<'i> {
    /// In the unit's axes, rad.
    pub error: Vector3<f64>,
    /// Standard deviation of the measured turn and of the unit's noise, rad.
    pub sigma_rad: f64,
    pub span_s: f64,
    pub integral: &'i Integral,
}

/// Bias and clock offset with their covariance.
#[derive(Clone, Debug)]
pub(super) struct UnitErrors {
    /// Three biases, rad/s; the offset to add to samples' times, s.
    state: [f64; 4],
    covariance: Covariance<4>,
    /// Mean square of the time between samples, s2.
    interval2: f64,
}

impl UnitErrors {
    pub fn new(unit: &InertialUnit) -> Self {
        let mut this = Self { state: [0.0; 4], covariance: Covariance::default(), interval2: 0.0 };
        this.widen(unit);
        this
    }

    /// Forgets how well the errors are known, but not the errors.
    pub fn widen(&mut self, unit: &InertialUnit) {
        let bias = unit.turn_bias_sigma * unit.turn_bias_sigma;
        let offset = OFFSET_SIGMA_S * OFFSET_SIGMA_S;
        self.covariance = Covariance::of_variances([bias, bias, bias, offset]);
    }

    pub fn bias(&self) -> Vector3<f64> {
        let [x, y, z, _] = self.state;
        Vector3::new(x, y, z)
    }

    pub fn offset_s(&self) -> f64 {
        let [.., offset_s] = self.state;
        offset_s
    }

    /// Standard deviation of the offset, s. Between two samples rates are only interpolated, and
    /// what they miss repeats from turn to turn: many turns do not make up for it.
    pub fn offset_sigma_s(&self) -> f64 {
        let [.., [.., variance]] = self.covariance.0;
        root(variance + INTERVAL_SHARE * INTERVAL_SHARE * self.interval2)
    }

    /// Takes note of the time between two samples.
    pub fn note_interval(&mut self, interval_s: f64) {
        let interval_s = bounded(interval_s, BRIDGED_MAX_S);
        let share = if self.interval2 > 0.0 { INTERVAL_MEMORY } else { 1.0 };
        self.interval2 += (interval_s * interval_s - self.interval2) * share;
    }

    /// Standard deviation of the least known bias, rad/s.
    pub fn bias_sigma(&self) -> f64 {
        let [[x, ..], [_, y, ..], [_, _, z, _], _] = self.covariance.0;
        root([x, y, z].into_iter().fold(0.0, |most, one| if one > most { one } else { most }))
    }

    /// Returns true if the offset is at its bound.
    pub fn is_apart(&self) -> bool {
        libm::fabs(self.offset_s()) >= OFFSET_MAX_S
    }

    /// Standard deviation of a turn predicted with these errors taken out, about one axis, rad.
    pub fn turn_sigma_rad(&self, integral: &Integral, span_s: f64) -> f64 {
        let Integral { rate_change, unseen_rad, .. } = integral;
        let (bias, clock) =
            (self.bias_sigma() * span_s, self.offset_sigma_s() * rate_change.norm());
        root(bias * bias + clock * clock + unseen_rad * unseen_rad)
    }

    /// Lets both change over a time.
    pub fn pass(&mut self, unit: &InertialUnit, span_s: f64) {
        let bias = unit.turn_walk * unit.turn_walk * span_s;
        let offset = OFFSET_WALK * OFFSET_WALK * span_s;
        let [[x, ..], [_, y, ..], [_, _, z, _], [.., last]] = &mut self.covariance.0;
        for variance in [x, y, z] {
            *variance += bias;
        }
        *last += offset;
    }

    /// Learns from a turn. Returns false for one that no error within the gate explains.
    pub fn update(&mut self, turn: &TurnError<'_>) -> bool {
        let [x, y, z]: [f64; 3] = turn.error.into();
        let [rx, ry, rz]: [f64; 3] = turn.integral.rate_change.into();
        let span_s = -turn.span_s;
        let rows = [
            ([span_s, 0.0, 0.0, -rx], x),
            ([0.0, span_s, 0.0, -ry], y),
            ([0.0, 0.0, span_s, -rz], z),
        ];
        let variance =
            turn.sigma_rad * turn.sigma_rad + turn.integral.unseen_rad * turn.integral.unseen_rad;
        // All three axes must pass before one of them counts.
        let passes = rows.iter().all(|(row, error)| {
            let spread = self.covariance.variance(row) + variance;
            error * error <= GATE_SIGMAS * GATE_SIGMAS * spread
        });
        if passes {
            let before = self.state;
            for (row, error) in rows {
                // Errors were measured with the state before all three.
                let moved = self.state.iter().zip(before).map(|(now, before)| now - before);
                let seen: f64 = row.iter().zip(moved).map(|(row, moved)| row * moved).sum();
                self.update_axis(&row, error - seen, variance);
            }
        }
        passes
    }

    fn update_axis(&mut self, row: &[f64; 4], error: f64, variance: f64) {
        let Some(gain) = self.covariance.measured(row, variance) else { return };
        for (state, gain) in self.state.iter_mut().zip(gain) {
            *state += gain * error;
        }
        // Nothing beyond is corrected: a unit so far off is doubted.
        let [x, y, z, offset] = &mut self.state;
        for bias in [x, y, z] {
            *bias = bounded(*bias, BIAS_MAX);
        }
        *offset = bounded(*offset, OFFSET_MAX_S);
    }

    /// Visits every field.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { state, covariance, interval2 } = self;
        visitor.f64s(state);
        visitor.f64s([interval2]);
        covariance.visit(visitor);
    }
}

fn bounded(value: f64, most: f64) -> f64 {
    if value > most {
        most
    } else if value < -most {
        -most
    } else {
        value
    }
}
