//! What no inertial unit measures: accelerations without gravity, turn rates in degrees.

use super::TimedReading;
use crate::formats::FormatError;
use std::path::Path;

/// Gravity, m/s2.
pub const GRAVITY_M_S2: f64 = 9.806_65;
/// Shares of gravity between which the median acceleration of anything that moves on or over the
/// ground lies.
const GRAVITY_SHARE: [f64; 2] = [0.6, 1.5];
/// Fastest turn that units measure, rad/s: 4,000 degrees a second.
const FASTEST_RAD_S: f64 = 70.0;
/// Share of samples that must all be the same for a unit to be stuck.
const STUCK_SHARE: f64 = 0.9;

/// Refuses readings that are of another unit than they are said to be, and says of a stuck unit.
pub(super) fn check(
    path: &Path,
    readings: &[TimedReading],
    notes: &mut Vec<String>,
) -> Result<(), FormatError> {
    let refuse = |reason: String, action: &str| Err(FormatError::content(path, reason, action));
    let force = median(readings.iter().map(|reading| norm(reading.force)));
    let share = force / GRAVITY_M_S2;
    let within = |value: f64| (GRAVITY_SHARE[0]..=GRAVITY_SHARE[1]).contains(&value);
    if !within(share) {
        let (what, action) = if within(force) {
            (
                "they are in g, not in m/s2",
                "Name the unit in the heading: `ax [g]`, or multiply by 9.80665",
            )
        } else if within(1e-3 * force) {
            ("they are in thousandths of g", "Name the unit in the heading: `ax [mg]`")
        } else if share < GRAVITY_SHARE[0] {
            (
                "gravity is taken out of them, or they are in another unit",
                "Export the accelerometer's own readings, which include gravity",
            )
        } else {
            (
                "they are in another unit, or the sensor is saturated",
                "Write accelerations in m/s2, or name their unit in the heading: `ax [g]`",
            )
        };
        return refuse(
            format!(
                "the median of its accelerations is {force:.3}, and gravity is {GRAVITY_M_S2:.2} \
                 m/s2: {what}"
            ),
            action,
        );
    }
    let fastest = readings.iter().map(|reading| norm(reading.turn_rate)).fold(0.0, f64::max);
    if fastest > FASTEST_RAD_S {
        return refuse(
            format!(
                "it turns at {fastest:.0} rad/s, which no unit measures: the rates are in degrees \
                 a second"
            ),
            "Name the unit in the heading: `wx [deg/s]`, or multiply by pi/180",
        );
    }
    let same = readings.windows(2).filter(|pair| pair[0].turn_rate == pair[1].turn_rate).count();
    if same as f64 > STUCK_SHARE * (readings.len() - 1) as f64 {
        notes.push(format!(
            "{}: {same} of {} samples repeat the turn rate before them: the unit may be stuck",
            path.display(),
            readings.len()
        ));
    }
    Ok(())
}

fn norm([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
