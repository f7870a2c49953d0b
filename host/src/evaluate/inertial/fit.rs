//! Turns of a unit at an offset of the clocks, next to those of the camera.

use super::turns::TurnIntegral;
use nalgebra::Vector3;

/// Fewest intervals that say something.
const LEAST: usize = 8;
/// Share of intervals that count: the others may be wrong in the images.
const COUNTED: f64 = 0.8;

/// Turn of the camera from one frame to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    pub from_ns: i64,
    pub to_ns: i64,
    /// In the unit's axes, rad.
    pub turn: Vector3<f64>,
}

impl Interval {
    fn seconds(&self) -> f64 {
        (self.to_ns - self.from_ns) as f64 * 1e-9
    }
}

/// Turns of the unit at an offset, against the camera's.
pub(super) struct Fit {
    /// Turns of unit (bias taken out) and camera, in the unit's axes, rad.
    pub pairs: Vec<[Vector3<f64>; 2]>,
    pub bias: Vector3<f64>,
    /// Mean square difference of the intervals that count, rad2.
    pub cost: f64,
}

/// Turns at an offset, with the bias that explains most; `None` of too few.
pub(super) fn fit(
    integral: &TurnIntegral<'_>,
    intervals: &[Interval],
    offset_ns: i64,
) -> Option<Fit> {
    let both: Vec<(f64, [Vector3<f64>; 2])> = intervals
        .iter()
        .filter_map(|interval| {
            let (from, to) = (interval.from_ns + offset_ns, interval.to_ns + offset_ns);
            Some((interval.seconds(), [integral.between(from, to)?, interval.turn]))
        })
        .collect();
    if both.len() < LEAST {
        return None;
    }
    // Medians: a wrong turn in the images moves no bias.
    let median = |axis: usize| {
        let rates = both.iter().map(|(seconds, [unit, camera])| (unit - camera)[axis] / seconds);
        let mut rates: Vec<f64> = rates.collect();
        rates.sort_by(f64::total_cmp);
        rates.get(rates.len() / 2).copied().unwrap_or(0.0)
    };
    let bias = Vector3::new(median(0), median(1), median(2));
    let pairs: Vec<[Vector3<f64>; 2]> =
        both.iter().map(|(seconds, [unit, camera])| [unit - bias * *seconds, *camera]).collect();
    let cost = trimmed(pairs.iter().map(|[unit, camera]| (unit - camera).norm_squared()));
    Some(Fit { pairs, bias, cost })
}

/// Mean of the least squares that count.
pub(super) fn trimmed(squares: impl Iterator<Item = f64>) -> f64 {
    let mut squares: Vec<f64> = squares.collect();
    squares.sort_by(f64::total_cmp);
    let counted = ((squares.len() as f64 * COUNTED) as usize).max(1);
    squares.iter().take(counted).sum::<f64>() / counted as f64
}

/// Mean square of some vectors.
pub(super) fn mean_square(vectors: impl ExactSizeIterator<Item = Vector3<f64>>) -> f64 {
    let count = vectors.len().max(1) as f64;
    vectors.map(|vector| vector.norm_squared()).sum::<f64>() / count
}
