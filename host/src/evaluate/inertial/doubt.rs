//! Faults of a unit that explain why its turns are not those of the camera.

use super::{RawTurn, mean_square, trimmed};
use dynvox_core::inertial::InertialDoubt;
use nalgebra::Vector3;

/// Share of what is unexplained that other axes must leave at most to be named.
const EXPLAINED_BY_AXES: f64 = 0.3;
/// Turn of the images from frame to frame below which axes cannot be told, rad, as root mean
/// square.
const LEAST_TURN_RAD: f64 = 1e-3;

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
    /// Readings that repeat.
    Stuck,
    /// Readings at the end of the sensor's range.
    Saturated,
    /// Clocks that differ by more than is corrected.
    ClocksApart,
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
            Self::Stuck => {
                "its samples repeat the one before: it is stuck. Record it anew".to_owned()
            }
            Self::Saturated => "its turn rates end at the end of its range, and the camera turns \
                                faster: choose a wider range of the sensor"
                .to_owned(),
            Self::ClocksApart => "its clock differs from the cameras' by more than 0.15 s: align \
                                  them, or give timeshift_cam_imu in --inertial-calibration"
                .to_owned(),
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

/// Fault of a unit: the mapper's doubt, or other axes that fit turns far better. Exchanged axes may
/// be those about which the camera hardly turns, which frame by frame are no contradiction.
pub(super) fn doubt(known: Option<InertialDoubt>, turns: &[RawTurn]) -> Option<UnitDoubt> {
    match known {
        Some(InertialDoubt::Degrees) => return Some(UnitDoubt::Degrees),
        Some(InertialDoubt::Stuck) => return Some(UnitDoubt::Stuck),
        Some(InertialDoubt::Saturated) => return Some(UnitDoubt::Saturated),
        _ => {}
    }
    // The mapper saw each turn by itself; all of them together tell axes apart.
    let turn = mean_square(turns.iter().map(|turn| turn.camera)).sqrt();
    let axes = (turn > LEAST_TURN_RAD).then(|| better_axes(turns)).flatten();
    // Axes explain a contradiction better than a clock does.
    match (axes, known) {
        (Some(fit), _) => Some(UnitDoubt::Axes { fit }),
        (None, Some(InertialDoubt::ClocksApart)) => Some(UnitDoubt::ClocksApart),
        (None, Some(_)) => Some(UnitDoubt::Disagrees),
        (None, None) => None,
    }
}

/// Axes that leave at most [`EXPLAINED_BY_AXES`] of what the named ones do.
fn better_axes(turns: &[RawTurn]) -> Option<[&'static str; 3]> {
    let (mut best, mut whole) = (([0, 1, 2].map(|axis| NAMES[axis][0]), f64::INFINITY), None);
    for order in ORDERS {
        for signs in 0..8 {
            let side = |axis: usize| signs >> axis & 1;
            let sign = |axis: usize| if side(axis) == 1 { -1.0 } else { 1.0 };
            let along = |turn: &Vector3<f64>, axis: usize| sign(axis) * turn[order[axis]];
            let left = unexplained(turns, |turn| [0, 1, 2].map(|axis| along(turn, axis)).into());
            // The first are the axes as they are named.
            let whole = *whole.get_or_insert(left);
            if left < best.1 && left < EXPLAINED_BY_AXES * whole {
                best = ([0, 1, 2].map(|axis| NAMES[order[axis]][side(axis)]), left);
            }
        }
    }
    best.1.is_finite().then_some(best.0)
}

/// Mean square difference of turns that are mapped to other axes, with the bias that explains most.
fn unexplained(turns: &[RawTurn], map: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> f64 {
    let off: Vec<(Vector3<f64>, f64)> =
        turns.iter().map(|turn| (map(&turn.unit) - turn.camera, turn.span_s)).collect();
    // Medians: a wrong turn in the images moves no bias.
    let bias = Vector3::from([0, 1, 2].map(|axis| {
        let mut rates: Vec<f64> = off.iter().map(|(off, span_s)| off[axis] / span_s).collect();
        rates.sort_by(f64::total_cmp);
        rates.get(rates.len() / 2).copied().unwrap_or(0.0)
    }));
    trimmed(off.iter().map(|(off, span_s)| (off - bias * *span_s).norm_squared()))
}
