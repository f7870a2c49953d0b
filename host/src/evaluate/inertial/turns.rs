//! Turn rates integrated over time.

use crate::formats::TimedReading;
use dynvox_core::geometry::Transform;
use nalgebra::Vector3;

/// Longest time between two samples over which turn rates are integrated, ns.
const LONGEST_GAP_NS: i64 = 120_000_000;

/// Orientation of a unit at the times of its samples, against that at the first.
pub(super) struct TurnIntegral<'r> {
    readings: &'r [TimedReading],
    orientations: Vec<Transform>,
    /// Number of gaps before each sample.
    gaps: Vec<u32>,
}

impl<'r> TurnIntegral<'r> {
    /// Integrates by the mean of the two rates at the ends of each interval.
    pub fn new(readings: &'r [TimedReading]) -> Self {
        let (mut orientation, mut gap) = (Transform::IDENTITY, 0);
        let (mut orientations, mut gaps) = (vec![orientation], vec![gap]);
        for pair in readings.windows(2) {
            let mean = (rate(&pair[0]) + rate(&pair[1])) * 0.5;
            orientation = turned(&orientation, mean, pair[1].time_ns - pair[0].time_ns);
            gap += u32::from(pair[1].time_ns - pair[0].time_ns > LONGEST_GAP_NS);
            orientations.push(orientation);
            gaps.push(gap);
        }
        Self { readings, orientations, gaps }
    }

    /// Turn from one time to another as a rotation vector in the unit's axes, rad; `None` where
    /// samples are missing.
    pub fn between(&self, from_ns: i64, to_ns: i64) -> Option<Vector3<f64>> {
        let ((from, from_gaps), (to, to_gaps)) = (self.at(from_ns)?, self.at(to_ns)?);
        (from_gaps == to_gaps).then(|| rotation_vector(&(from.inverse() * to)))
    }

    /// Orientation at a time, and the number of gaps before it.
    fn at(&self, time_ns: i64) -> Option<(Transform, u32)> {
        let after = self.readings.partition_point(|reading| reading.time_ns <= time_ns);
        let before = after.checked_sub(1)?;
        let (a, b) = (self.readings.get(before)?, self.readings.get(after)?);
        let interval_ns = b.time_ns - a.time_ns;
        if interval_ns > LONGEST_GAP_NS {
            return None;
        }
        let share = (time_ns - a.time_ns) as f64 / interval_ns as f64;
        let mean = rate(a) + (rate(b) - rate(a)) * (0.5 * share);
        let orientation = self.orientations.get(before)?;
        Some((turned(orientation, mean, time_ns - a.time_ns), *self.gaps.get(before)?))
    }
}

fn rate(reading: &TimedReading) -> Vector3<f64> {
    Vector3::from(reading.turn_rate)
}

/// An orientation after turning at a rate for a time.
fn turned(orientation: &Transform, rate: Vector3<f64>, time_ns: i64) -> Transform {
    let vector = rate * (time_ns as f64 * 1e-9);
    (*orientation * Transform::new(vector, [0.0; 3])).normalized()
}

/// Axis times angle of a rotation, rad.
pub(super) fn rotation_vector(turn: &Transform) -> Vector3<f64> {
    let [x, y, z, w] = turn.rotation;
    let axis = Vector3::new(x, y, z) * if w < 0.0 { -1.0 } else { 1.0 };
    let sine = axis.norm();
    if sine < 1e-12 { axis * 2.0 } else { axis * (2.0 * libm::atan2(sine, w.abs()) / sine) }
}
