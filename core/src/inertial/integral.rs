//! Integration of turn rates and forces over the time between two frames.
//!
//! Rates change linearly from sample to sample; each piece turns by the rate in its middle times
//! its length, and pieces are multiplied in the order of time (midpoint rule on SO(3)). Up to
//! [`BRIDGED_MAX_S`] without a sample is bridged, at the ends by the nearest one.

use crate::geometry::Transform;
use nalgebra::Vector3;

/// Longest time without a sample over which a turn is known, s.
pub(super) const BRIDGED_MAX_S: f64 = 0.25;
/// Time without a sample from which on it counts as bridged, s.
const BRIDGED_MIN_S: f64 = 0.05;
/// Change of the turn rate that may go unseen between two samples, one sigma, rad/s2.
const UNSEEN_RAD_S2: f64 = 2.0;

/// Sample on the clock of an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reading {
    /// Time since the interval's start, s.
    pub at_s: f64,
    pub turn_rate: Vector3<f64>,
    pub force: Vector3<f64>,
}

/// Motion of a unit over an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Integral {
    /// Axes at the end to those at the start; no translation.
    pub t_start_end: Transform,
    /// Sum of the rates times their time, rad: unlike the rotation it does not wrap at half a turn.
    pub rate_sum: Vector3<f64>,
    /// Mean specific force in the axes at the start, m/s2.
    pub mean_force: Vector3<f64>,
    /// Turn rate at the end less that at the start, rad/s.
    pub rate_change: Vector3<f64>,
    /// Turn that may have gone unseen in what was bridged, one sigma, rad.
    pub unseen_rad: f64,
    /// Gaps that were bridged.
    pub bridged: u32,
}

/// Integrates readings in order of time over `[0, span_s]`, with `bias` taken from their rates;
/// `None` where they do not cover it.
pub(super) fn integrate(
    readings: impl Iterator<Item = Reading>,
    span_s: f64,
    bias: &Vector3<f64>,
) -> Option<Integral> {
    let mut integrator = Integrator::new(span_s);
    let mut before: Option<Reading> = None;
    for mut reading in readings {
        reading.turn_rate -= bias;
        // Out of order: a later one was there already.
        if before.is_some_and(|before| reading.at_s <= before.at_s) {
            continue;
        }
        if reading.at_s > 0.0 {
            // Nothing is known before the first reading but what it says itself.
            let from = before.unwrap_or(Reading { at_s: 0.0, ..reading });
            integrator.add(&from, &reading, before.is_none())?;
        }
        before = Some(reading);
        if reading.at_s >= span_s {
            break;
        }
    }
    let last = before?;
    if last.at_s < span_s {
        let from = if last.at_s < 0.0 { Reading { at_s: 0.0, ..last } } else { last };
        // A hold from before the interval is as long as it is, not only the part inside.
        if span_s - last.at_s > BRIDGED_MAX_S {
            return None;
        }
        integrator.add(&from, &Reading { at_s: span_s, ..last }, true)?;
    }
    integrator.finish()
}

struct Integrator {
    span_s: f64,
    integral: Integral,
    force_s: Vector3<f64>,
    unseen_rad2: f64,
    first_rate: Option<Vector3<f64>>,
    last_rate: Vector3<f64>,
}

impl Integrator {
    fn new(span_s: f64) -> Self {
        let integral = Integral {
            t_start_end: Transform::IDENTITY,
            rate_sum: Vector3::zeros(),
            mean_force: Vector3::zeros(),
            rate_change: Vector3::zeros(),
            unseen_rad: 0.0,
            bridged: 0,
        };
        let zero = Vector3::zeros();
        let (force_s, last_rate) = (zero, zero);
        Self { span_s, integral, force_s, unseen_rad2: 0.0, first_rate: None, last_rate }
    }

    /// Adds the part of the time between two readings that lies in the interval. `None` where
    /// there is too long a gap between them. `held` tells that only one of them was measured.
    fn add(&mut self, from: &Reading, to: &Reading, held: bool) -> Option<()> {
        let gap_s = to.at_s - from.at_s;
        if gap_s > BRIDGED_MAX_S {
            return None;
        }
        let start_s = if from.at_s > 0.0 { from.at_s } else { 0.0 };
        let end_s = if to.at_s < self.span_s { to.at_s } else { self.span_s };
        // One of them lies outside, or both at one time.
        if !(gap_s > 0.0 && end_s > start_s) {
            return Some(());
        }
        // Rates and forces are linear in between.
        let at = |at_s: f64| {
            let share = (at_s - from.at_s) / gap_s;
            (
                from.turn_rate + (to.turn_rate - from.turn_rate) * share,
                from.force + (to.force - from.force) * share,
            )
        };
        let ((start, _), (end, _)) = (at(start_s), at(end_s));
        let (rate, force) = at(0.5 * (start_s + end_s));
        let piece_s = end_s - start_s;
        // Forces of a piece are felt in the axes of its middle.
        let turn = |share: f64| Transform::new(rate * (piece_s * share), [0.0; 3]);
        let middle = self.integral.t_start_end * turn(0.5);
        self.integral.rate_sum += rate * piece_s;
        self.force_s += middle.rotate(force) * piece_s;
        self.integral.t_start_end = (self.integral.t_start_end * turn(1.0)).normalized();
        self.first_rate.get_or_insert(start);
        self.last_rate = end;
        // A held rate errs by half the change times the square, one between two by a twelfth.
        let share = if held { 0.5 } else { 1.0 / 12.0 };
        let unseen_rad = UNSEEN_RAD_S2 * gap_s * gap_s * share;
        self.unseen_rad2 += unseen_rad * unseen_rad;
        self.integral.bridged += u32::from(gap_s > BRIDGED_MIN_S);
        Some(())
    }

    fn finish(self) -> Option<Integral> {
        let Self { span_s, integral, force_s, unseen_rad2, first_rate, last_rate } = self;
        let integral = Integral {
            mean_force: force_s / span_s,
            rate_change: last_rate - first_rate?,
            unseen_rad: libm::sqrt(unseen_rad2),
            ..integral
        };
        integral.t_start_end.is_finite().then_some(integral)
    }
}

#[cfg(test)]
mod tests;
