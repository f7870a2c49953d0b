//! What holds the unit against gravity, and its velocity, from forces and from the ways that images
//! show (a Kalman filter of three states, alike for the three axes of the map).
//!
//! A mean force, turned into the map, is the acceleration plus what holds the unit up. Poses lean
//! more the longer they are added up, and the force with them: what holds the unit up is a constant
//! of the map's first pose, and a lean that walks away from it. Early ways tell the constant, later
//! ones the lean.

use super::{
    InertialUnit, Vertical,
    covariance::{Covariance, root},
};
use crate::state::Visitor;
use nalgebra::Vector3;

/// Least standard deviation of a measured way, m.
const WAY_SIGMA_MIN_M: f64 = 0.005;
/// Way of an interval beyond which a velocity is of no camera, m.
const WAY_MAX_M: f64 = 100.0;
/// Standard deviations before anything is known: of a velocity, m/s, and of a force, m/s2.
const UNKNOWN: [f64; 2] = [30.0, 10.0];
/// Change of the velocity by noise of the forces, m/s per square root of a second.
const FORCE_WALK: f64 = 0.02;
/// Lean of the poses beyond that of their turns' own error, rad per square root of a second.
const LEAN_WALK_RAD: f64 = 0.0026;
/// Change of what holds a unit up with a lean, m/s2 for each rad.
const LEANS_BY: f64 = 9.0;
/// Time after which there is a vertical, s.
const FIRST_S: f64 = 1.0;
/// Size of what holds a unit up, m/s2.
const GRAVITY: core::ops::Range<f64> = 9.0..10.6;
/// Size beyond which a force is of no unit, m/s2.
const FORCE_MAX: f64 = 1_000.0;
/// Largest standard deviation of a velocity that is used, m/s.
const VELOCITY_SIGMA_MAX: f64 = 1.0;
/// Deviations of both from which on a way contradicts the velocity, and the factor by which the
/// velocity's variance grows then.
const GATE_SIGMAS: f64 = 5.0;
const GATE_WIDENS: f64 = 4.0;

/// States: velocity, what holds the unit up, lean.
const N: usize = 3;

/// Interval between two frames, in the map's axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    pub span_s: f64,
    /// Mean specific force, m/s2; `None` where samples do not cover the interval.
    pub force: Option<Vector3<f64>>,
    /// Standard deviation of the poses' turn over it, about one axis, rad.
    pub turn_sigma_rad: f64,
}

/// The filter: a mean of each state for each axis, and one covariance for all axes.
#[derive(Clone, Debug, Default)]
pub(super) struct Gravity {
    /// Velocity at the last frame, m/s.
    velocity: [f64; 3],
    /// Force that holds the unit up, had no pose leaned, m/s2.
    held: [f64; 3],
    /// Change of that force by the poses' lean, m/s2.
    lean: [f64; 3],
    covariance: Covariance<N>,
    /// Time over which ways were measured, s; 0 before the first.
    time_s: f64,
}

impl Gravity {
    /// Way of the unit over the next interval, and the standard deviation of an axis, m; `None`
    /// where it is known too little.
    pub fn way_m(&self, interval: &Interval) -> Option<(Vector3<f64>, f64)> {
        let (force, span_s) = (interval.force?, interval.span_s);
        let way_m = self.expected_m(&force, span_s);
        let sigma_m = root(self.covariance.variance(&row(span_s)));
        let is_possible = way_m.iter().all(|part| libm::fabs(*part) < WAY_MAX_M);
        let is_known = self.is_known() && sigma_m <= VELOCITY_SIGMA_MAX * span_s;
        (is_known && is_possible).then_some((way_m, sigma_m))
    }

    /// Lets an interval pass. `way` is what images showed of it, with its standard deviation, m.
    pub fn pass(&mut self, interval: &Interval, way: Option<(Vector3<f64>, f64)>) {
        let &Interval { span_s, force, turn_sigma_rad } = interval;
        match force {
            Some(force) if span_s > 0.0 && force.norm() < FORCE_MAX => {
                if let Some((way_m, sigma_m)) = way {
                    self.measure(&force, span_s, &way_m, sigma_m);
                }
                self.advance(&force, span_s);
            }
            _ => self.forget_velocity(),
        }
        let walk = LEAN_WALK_RAD * LEAN_WALK_RAD * span_s + turn_sigma_rad * turn_sigma_rad;
        let [.., [.., lean]] = &mut self.covariance.0;
        *lean += LEANS_BY * LEANS_BY * walk;
    }

    /// The vertical, once there is one.
    pub fn vertical(&self, unit: &InertialUnit) -> Option<Vertical> {
        let held = Vector3::from(self.held);
        let size = held.norm();
        let [_, [_, variance, _], _] = self.covariance.0;
        let sigma = root(variance + unit.force_bias_sigma * unit.force_bias_sigma);
        let up: [f64; 3] = (held / size).into();
        self.is_known().then_some(Vertical {
            up_world: up.map(|part| part as f32),
            // Two of three axes tilt the vertical.
            sigma_rad: (libm::sqrt(2.0) * sigma / size) as f32,
        })
    }

    /// True if what holds the unit up is known, and is gravity's.
    fn is_known(&self) -> bool {
        self.time_s >= FIRST_S && GRAVITY.contains(&Vector3::from(self.held).norm())
    }

    /// Way over an interval of that force.
    fn expected_m(&self, force: &Vector3<f64>, span_s: f64) -> Vector3<f64> {
        Vector3::from(self.velocity) * span_s + self.acceleration(force) * (0.5 * span_s * span_s)
    }

    fn acceleration(&self, force: &Vector3<f64>) -> Vector3<f64> {
        force - Vector3::from(self.held) - Vector3::from(self.lean)
    }

    /// Learns from the way over an interval, before it passes. A way that contradicts the forces is
    /// of what moves: nothing is learned from it. Doubt grows, so that ways which repeat are
    /// believed in the end.
    fn measure(&mut self, force: &Vector3<f64>, span_s: f64, way_m: &Vector3<f64>, sigma_m: f64) {
        if self.time_s <= 0.0 {
            // The first one tells the velocity, its force what holds the unit up.
            let [velocity, held] = UNKNOWN.map(|sigma| sigma * sigma);
            (self.velocity, self.held) = ((way_m / span_s).into(), (*force).into());
            self.covariance = Covariance::of_variances([velocity, held, 0.0]);
        }
        let error_m = way_m - self.expected_m(force, span_s);
        let row = row(span_s);
        let sigma_m = if sigma_m > WAY_SIGMA_MIN_M { sigma_m } else { WAY_SIGMA_MIN_M };
        let variance = sigma_m * sigma_m;
        let error2 = error_m.norm_squared();
        if !error2.is_finite() {
            return;
        }
        if error2 > 3.0 * GATE_SIGMAS * GATE_SIGMAS * (self.covariance.variance(&row) + variance) {
            let [[velocity, ..], ..] = &mut self.covariance.0;
            *velocity *= GATE_WIDENS;
            return;
        }
        let Some(gain) = self.covariance.measured(&row, variance) else { return };
        self.time_s += span_s;
        let states = [&mut self.velocity, &mut self.held, &mut self.lean];
        for (state, gain) in states.into_iter().zip(gain) {
            *state = (Vector3::from(*state) + error_m * gain).into();
        }
    }

    /// Moves the velocity on to the end of an interval.
    fn advance(&mut self, force: &Vector3<f64>, span_s: f64) {
        let velocity = Vector3::from(self.velocity) + self.acceleration(force) * span_s;
        self.velocity = velocity.into();
        // The velocity now is the one before less what held and lean add to it.
        let [[_, vh, vl], [_, hh, hl], [_, _, ll]] = self.covariance.0;
        let [velocity, held, lean] = &mut self.covariance.0;
        let [vv, ..] = velocity;
        let both = hh + 2.0 * hl + ll;
        *vv += span_s * span_s * both - 2.0 * span_s * (vh + vl) + FORCE_WALK * FORCE_WALK * span_s;
        let (vh, vl) = (vh - span_s * (hh + hl), vl - span_s * (hl + ll));
        *velocity = [*vv, vh, vl];
        (*held, *lean) = ([vh, hh, hl], [vl, hl, ll]);
    }

    /// Nothing is known of the velocity at the end of an interval without forces.
    fn forget_velocity(&mut self) {
        let [[vv, vh, vl], [hv, ..], [lv, ..]] = &mut self.covariance.0;
        let [unknown, _] = UNKNOWN;
        *vv = unknown * unknown;
        (*vh, *vl, *hv, *lv) = (0.0, 0.0, 0.0, 0.0);
    }

    /// Visits every field.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { velocity, held, lean, covariance, time_s } = self;
        visitor.f64s(velocity.iter_mut().chain(held).chain(lean));
        covariance.visit(visitor);
        visitor.f64s([time_s]);
    }
}

/// Dependence of the way over an interval on the states.
fn row(span_s: f64) -> [f64; N] {
    let half = -0.5 * span_s * span_s;
    [span_s, half, half]
}
