//! Readings in the order of their times, each time once.

use super::TimedReading;
use crate::formats::FormatError;
use crate::formats::bounds::{MAX_INERTIAL_SAMPLES, thousands};
use std::path::Path;

/// Fewest readings of a unit.
const LEAST: usize = 2;
/// Intervals this many times the median are gaps.
const GAP_TIMES: i64 = 5;

/// Sorts readings by time, and leaves out what is not a number, and times that repeat.
pub(super) fn ordered(
    path: &Path,
    mut readings: Vec<TimedReading>,
    notes: &mut Vec<String>,
) -> Result<Vec<TimedReading>, FormatError> {
    let refuse = |reason: String, action: &str| Err(FormatError::content(path, reason, action));
    let read = readings.len();
    if read > MAX_INERTIAL_SAMPLES {
        return refuse(
            format!(
                "it has {} inertial samples; at most {} are read",
                thousands(read),
                thousands(MAX_INERTIAL_SAMPLES)
            ),
            "Cut it to the time of the recording",
        );
    }
    let finite = |reading: &TimedReading| {
        reading.turn_rate.iter().chain(&reading.force).all(|value| value.is_finite())
    };
    readings.retain(finite);
    let unusable = read - readings.len();
    if unusable * 2 > read {
        return refuse(
            format!("{unusable} of its {read} samples are not numbers"),
            "Record the unit anew, or turn it off with --inertial none",
        );
    }
    let unsorted = readings.windows(2).filter(|pair| pair[1].time_ns < pair[0].time_ns).count();
    // Stable: of equal times the first in the file stays.
    readings.sort_by_key(|reading| reading.time_ns);
    let before = readings.len();
    readings.dedup_by_key(|reading| reading.time_ns);
    let equal = before - readings.len();
    if readings.len() < LEAST {
        return refuse(
            format!("it has {} inertial samples of different times", readings.len()),
            "A unit's samples come at 20 to 2,000 Hz: check that the file is whole",
        );
    }
    for (count, what) in [
        (unusable, "are not finite numbers: left out"),
        (unsorted, "come before their predecessor: sorted by time"),
        (equal, "repeat the time of another: the first of each is kept"),
    ] {
        if count > 0 {
            notes.push(format!("{}: {count} samples {what}", path.display()));
        }
    }
    notes.extend(gaps(path, &readings));
    Ok(readings)
}

/// Median of the intervals, ns; 0 of fewer than two readings.
pub(super) fn median_interval_ns(readings: &[TimedReading]) -> i64 {
    let mut intervals: Vec<i64> =
        readings.windows(2).map(|pair| pair[1].time_ns - pair[0].time_ns).collect();
    intervals.sort_unstable();
    intervals.get(intervals.len() / 2).copied().unwrap_or(0)
}

/// A sentence about intervals that are much longer than most.
fn gaps(path: &Path, readings: &[TimedReading]) -> Option<String> {
    let limit = GAP_TIMES.saturating_mul(median_interval_ns(readings));
    let intervals = readings.windows(2).map(|pair| pair[1].time_ns - pair[0].time_ns);
    let long: Vec<i64> = intervals.filter(|interval| *interval > limit).collect();
    let longest = long.iter().max()?;
    Some(format!(
        "{}: {} gaps between inertial samples, the longest {:.2} s",
        path.display(),
        long.len(),
        *longest as f64 * 1e-9
    ))
}
