//! Velocity of the unit in the map: from the way that images show and, between and without them,
//! from forces less what holds the unit against gravity.

use crate::state::Visitor;
use nalgebra::Vector3;

/// Least standard deviation of a measured way, m.
const WAY_SIGMA_MIN_M: f64 = 0.005;
/// Largest standard deviation of an acceleration that is used, m/s2: a less certain one errs by
/// more than a camera that moves on as before.
const ACCELERATION_SIGMA_MAX: f64 = 0.5;
/// Way of an interval beyond which a velocity is of no camera, m.
const WAY_MAX_M: f64 = 100.0;
/// Largest standard deviation of a velocity that is used, m/s.
const VELOCITY_SIGMA_MAX: f64 = 1.0;

/// Deviations of both from which on a way contradicts the velocity, and the factor by which the
/// velocity's variance grows then.
const GATE_SIGMAS: f64 = 5.0;
const GATE_WIDENS: f64 = 4.0;

/// Acceleration of the unit over an interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct Acceleration {
    /// Mean in the map's axes, m/s2.
    pub mean: Vector3<f64>,
    /// Standard deviation of an axis, m/s2.
    pub sigma: f64,
    pub span_s: f64,
}

/// Velocity at the last frame (a Kalman filter with one variance for all axes).
#[derive(Clone, Debug, Default)]
pub(super) struct Velocity {
    /// In the map's axes, m/s.
    mean: [f64; 3],
    /// Variance of an axis, m2/s2; 0 where nothing is known.
    variance: f64,
}

impl Velocity {
    /// Way of the unit over the next interval in the map's axes, and the standard deviation of an
    /// axis, m; `None` where it is known too little.
    pub fn way_m(&self, acceleration: &Acceleration) -> Option<(Vector3<f64>, f64)> {
        let &Acceleration { mean, sigma, span_s } = acceleration;
        let is_known = self.variance > 0.0
            && self.variance <= VELOCITY_SIGMA_MAX * VELOCITY_SIGMA_MAX
            && sigma <= ACCELERATION_SIGMA_MAX;
        let way_m = Vector3::from(self.mean) * span_s + mean * (0.5 * span_s * span_s);
        let is_possible = way_m.iter().all(|part| libm::fabs(*part) < WAY_MAX_M);
        let half = 0.5 * sigma * span_s;
        let sigma_m = libm::sqrt(self.variance + half * half) * span_s;
        (is_known && is_possible).then_some((way_m, sigma_m))
    }

    /// Lets an interval pass; without a known force the velocity is forgotten.
    pub fn pass(&mut self, acceleration: Option<&Acceleration>) {
        let Some(&Acceleration { mean, sigma, span_s }) = acceleration else {
            self.variance = 0.0;
            return;
        };
        if self.variance > 0.0 {
            self.mean = (Vector3::from(self.mean) + mean * span_s).into();
            self.variance += sigma * sigma * span_s * span_s;
        }
    }

    /// Learns from the way that images showed over the interval that passed last, and its sigma.
    /// Returns false for a way that contradicts forces, from which nothing is learned.
    pub fn measure(&mut self, way_m: &Vector3<f64>, sigma_m: f64, last: &Acceleration) -> bool {
        let span_s = last.span_s;
        // Velocity at the end: the mean one, and what half of the interval adds.
        let seen = way_m / span_s + last.mean * (0.5 * span_s);
        let sigma_m = if sigma_m > WAY_SIGMA_MIN_M { sigma_m } else { WAY_SIGMA_MIN_M };
        let variance = sigma_m * sigma_m / (span_s * span_s)
            + 0.25 * last.sigma * last.sigma * span_s * span_s;
        if !(seen.iter().all(|part| part.is_finite()) && variance.is_finite()) {
            return false;
        }
        // A way that no camera took: matches were of what moves. Doubt grows, so that ways which
        // repeat are believed in the end.
        let off = (seen - Vector3::from(self.mean)).norm_squared();
        let both = 3.0 * (self.variance + variance);
        if self.variance > 0.0 && off > GATE_SIGMAS * GATE_SIGMAS * both {
            self.variance *= GATE_WIDENS;
            return false;
        }
        let share =
            if self.variance > 0.0 { self.variance / (self.variance + variance) } else { 1.0 };
        let mean = Vector3::from(self.mean);
        self.mean = (mean + (seen - mean) * share).into();
        self.variance = if self.variance > 0.0 { self.variance * (1.0 - share) } else { variance };
        true
    }

    /// Visits every field.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { mean, variance } = self;
        visitor.f64s(mean);
        visitor.f64s([variance]);
    }
}
