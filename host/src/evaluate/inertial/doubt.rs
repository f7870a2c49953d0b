//! Faults of a unit that explain why its turns are not those of the camera.

use super::fit::{Fit, mean_square, trimmed};
use crate::formats::TimedReading;
use nalgebra::Vector3;

/// Share of the camera's turns (squared) that may be left unexplained.
const UNEXPLAINED: f64 = 0.25;
/// Share of what is unexplained that a fault must leave at most to be named.
const EXPLAINED_BY_FAULT: f64 = 0.3;
/// Share of samples that repeat the one before them from which a unit is stuck.
const STUCK: f64 = 0.15;
/// Share of samples at the largest rate of an axis from which a unit is saturated.
const SATURATED: f64 = 0.02;

/// Fault of a unit.
#[derive(Clone, Debug, PartialEq)]
pub enum UnitDoubt {
    /// Turn rates in degrees a second.
    Degrees,
    /// Axes other than the mounting says.
    Axes {
        /// Names of the unit's axes that fit the mounting's x, y and z.
        fit: [&'static str; 3],
    },
    /// Readings that repeat, as a share.
    Stuck(f64),
    /// Largest rate the unit shows, rad/s.
    Saturated(f64),
    /// Turns that are not the camera's.
    Disagrees,
}

impl UnitDoubt {
    /// A sentence with the next action.
    pub fn sentence(&self) -> String {
        match self {
            Self::Degrees => "its turn rates are 57 times the images': they are in degrees. Name \
                              the unit in the table's heading, wx [deg/s], or convert them"
                .to_owned(),
            Self::Axes { fit: [x, y, z] } => format!(
                "its axes are not those of its mounting: {x}, {y}, {z} of the samples fit x, y, z. \
                 Correct the table or --inertial-calibration"
            ),
            Self::Stuck(share) => format!(
                "{:.0} % of its samples repeat the one before: it is stuck. Record it anew",
                100.0 * share
            ),
            Self::Saturated(rate) => format!(
                "its turn rates end at {rate:.2} rad/s, and the camera turns faster: choose a \
                 wider range of the sensor"
            ),
            Self::Disagrees => "its turns are not those of the images: check that samples, clock \
                                and mounting belong to this recording"
                .to_owned(),
        }
    }
}

/// Names of axes and their opposites.
const NAMES: [[&str; 2]; 3] = [["x", "-x"], ["y", "-y"], ["z", "-z"]];
/// Orders of three axes.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 0, 2], [0, 2, 1], [2, 1, 0], [1, 2, 0], [2, 0, 1]];

/// Fault that explains the difference of turns; `None` where there is little.
pub(super) fn doubt(readings: &[TimedReading], fit: &Fit) -> Option<UnitDoubt> {
    let stuck = stuck_share(readings);
    if stuck > STUCK {
        return Some(UnitDoubt::Stuck(stuck));
    }
    let [unit, camera] =
        [0, 1].map(|side| mean_square(fit.pairs.iter().map(move |pair| pair[side])));
    let left = |map: &dyn Fn(Vector3<f64>) -> Vector3<f64>| {
        trimmed(fit.pairs.iter().map(|[unit, camera]| (map(*unit) - camera).norm_squared()))
    };
    let whole = left(&|turn| turn);
    let counted = trimmed(fit.pairs.iter().map(|[_, camera]| camera.norm_squared()));
    // Turns beyond the range are among the fastest, which do not count as a difference.
    if let Some(rate) = saturated_rate(readings) {
        return Some(UnitDoubt::Saturated(rate));
    }
    let explained = |cost: f64| cost < EXPLAINED_BY_FAULT * whole;
    let degree = std::f64::consts::PI / 180.0;
    if unit > 100.0 * camera && explained(left(&|turn| turn * degree)) {
        return Some(UnitDoubt::Degrees);
    }
    // Exchanged axes may be those about which the camera hardly turns.
    let (cost, axes) = best_axes(&left);
    if explained(cost) {
        return Some(UnitDoubt::Axes { fit: axes });
    }
    (whole > UNEXPLAINED * counted.max(0.2 * camera)).then_some(UnitDoubt::Disagrees)
}

/// Cost of some turned turns.
type Cost<'c> = &'c dyn Fn(&dyn Fn(Vector3<f64>) -> Vector3<f64>) -> f64;

/// The least cost of all orders and signs of the axes, and their names.
fn best_axes(cost_of: Cost<'_>) -> (f64, [&'static str; 3]) {
    let mut best = (f64::INFINITY, ["x", "y", "z"]);
    for order in ORDERS {
        for signs in 0..8 {
            let side = |axis: usize| signs >> axis & 1;
            let sign = |axis: usize| if side(axis) == 1 { -1.0 } else { 1.0 };
            let map = |turn: Vector3<f64>| {
                let along = |axis: usize| sign(axis) * turn[order[axis]];
                Vector3::new(along(0), along(1), along(2))
            };
            let cost = cost_of(&map);
            if cost < best.0 {
                best = (cost, [0, 1, 2].map(|axis| NAMES[order[axis]][side(axis)]));
            }
        }
    }
    best
}

/// Share of samples that repeat the one before them in all six values.
fn stuck_share(readings: &[TimedReading]) -> f64 {
    let same = readings
        .windows(2)
        .filter(|pair| pair[0].turn_rate == pair[1].turn_rate && pair[0].force == pair[1].force);
    same.count() as f64 / readings.len().max(1) as f64
}

/// Largest rate of an axis at which many samples end, rad/s.
fn saturated_rate(readings: &[TimedReading]) -> Option<f64> {
    (0..3).find_map(|axis| {
        let largest = readings.iter().map(|one| one.turn_rate[axis].abs()).fold(0.0, f64::max);
        let at_end = readings.iter().filter(|one| one.turn_rate[axis].abs() == largest).count();
        let is_saturated = at_end as f64 > SATURATED * readings.len() as f64 && at_end > 4;
        (is_saturated && largest > 0.0).then_some(largest)
    })
}
