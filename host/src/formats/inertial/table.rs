//! Tables of inertial samples: a row a sample, columns by their names.
//!
//! EuRoC's and TUM VI's `imu0/data.csv`, `rostopic echo -p`, exports of phones and of cameras'
//! tools differ in names and units only.

use super::columns::{Columns, TimeColumns};
use super::{InertialFormat, InertialTable, TimedReading};
use crate::formats::bounds::INERTIAL_TEXT;
use crate::formats::times::{parse_date, parse_signed_nano};
use crate::formats::{FormatError, TimeUnit, read_text_within};
use std::path::Path;

/// Tables with a heading, or in EuRoC's order.
pub(super) static FORMAT: InertialFormat = InertialFormat {
    name: "table",
    files: "a table (CSV) whose heading names `time`, `wx`, `wy`, `wz`, `ax`, `ay`, `az`, with or \
            without units, or EuRoC's `imu0/data.csv`",
    matches: |path| !path.is_dir(),
    read,
};

/// Longest median interval between a unit's samples, s, and the shortest.
const INTERVAL_S: [f64; 2] = [0.000_2, 0.25];
/// Next action for a table that cannot be read.
const ACTION: &str = "A table of inertial samples has a heading `time,wx,wy,wz,ax,ay,az` and rows \
                      of numbers: s or ns, rad/s, m/s2";
/// Rows by which the unit of times is told.
const UNIT_ROWS: usize = 4_096;

/// Reads a table.
fn read(path: &Path) -> Result<InertialTable, FormatError> {
    let text = read_text_within(path, &INERTIAL_TEXT)?;
    let mut notes = Vec::new();
    let refuse = |reason: String| FormatError::content(path, reason, ACTION);
    let Rows { columns, rows } = rows(&text, path, &mut notes).map_err(refuse)?;
    let last = rows.len().saturating_sub(1);
    let unit = unit_of_times(&columns, &rows);
    if unit != TimeUnit::Seconds && !matches!(columns.time, TimeColumns::One(_, Some(_))) {
        notes.push(format!(
            "{}: times are in {}, as their interval tells",
            path.display(),
            unit.symbol()
        ));
    }
    let mut readings = Vec::with_capacity(rows.len());
    for (at, (line, row)) in rows.iter().enumerate() {
        match parsed(&split(row), &columns, unit) {
            Ok(reading) => readings.push(reading),
            // A recording that was interrupted ends within a row.
            Err(_) if at == last && at > 0 => {
                notes.push(format!("{}: its last row is cut off: left out", path.display()));
            }
            Err(reason) => return Err(refuse(format!("line {line} {reason}"))),
        }
    }
    InertialTable::from_readings(path, FORMAT.name, readings, notes)
}

/// Columns of a table, and its rows with their line numbers.
struct Rows<'t> {
    columns: Columns,
    rows: Vec<(usize, &'t str)>,
}

/// Splits a table into a heading and rows. The heading is the last line of words before the first
/// row of numbers; it may be a comment.
fn rows<'t>(text: &'t str, path: &Path, notes: &mut Vec<String>) -> Result<Rows<'t>, String> {
    let mut heading = None;
    let mut rows: Vec<(usize, &str)> = Vec::new();
    for (line, row) in (1..).zip(text.lines().map(str::trim)) {
        let is_comment = row.starts_with(['#', '%']);
        if row.is_empty() || (is_comment && !rows.is_empty()) {
            continue;
        }
        if rows.is_empty() {
            let words = split(row);
            if !is_comment && !is_heading(&words) {
                rows.push((line, row));
                continue;
            }
            // Sentences may stand over a heading: the line with the most known columns is it.
            match (heading.take(), Columns::named(&words)) {
                (Some(Ok(columns)), Err(_)) => heading = Some(Ok(columns)),
                (_, found) if words.len() > 1 => heading = Some(found),
                (before, _) => heading = before,
            }
            continue;
        }
        rows.push((line, row));
    }
    let first = rows.first().map(|(_, row)| split(row).len());
    let columns = match (heading, first) {
        (_, None) => return Err("it has no rows".to_owned()),
        (Some(Ok(columns)), _) => columns,
        (None, Some(7)) => {
            notes.push(format!(
                "{}: it has no heading: taken as time,wx,wy,wz,ax,ay,az, rad/s and m/s2",
                path.display()
            ));
            Columns::WITHOUT_HEADING
        }
        (Some(Err(reason)), _) => return Err(reason),
        (None, Some(first)) => {
            return Err(format!("it has {first} columns without a heading"));
        }
    };
    Ok(Rows { columns, rows })
}

/// Cells of a line: between semicolons or tabs, else commas, else blanks.
fn split(row: &str) -> Vec<&str> {
    let row = row.trim_start_matches(['#', '%']).trim();
    let separator = [';', '\t', ','].into_iter().find(|separator| row.contains(*separator));
    match separator {
        Some(separator) => row.split(separator).map(|cell| cell.trim().trim_matches('"')).collect(),
        None => row.split_whitespace().map(|cell| cell.trim_matches('"')).collect(),
    }
}

/// Tells whether no cell is a number.
fn is_heading(words: &[&str]) -> bool {
    let is_value = |word: &&str| {
        word.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))
            || word.eq_ignore_ascii_case("nan")
    };
    !words.iter().any(is_value)
}

/// Cell of a row; the error completes "line 3 ...".
fn cell<'r>(words: &[&'r str], at: usize) -> Result<&'r str, String> {
    words
        .get(at)
        .copied()
        .filter(|word| !word.is_empty())
        .ok_or_else(|| format!("has {} columns, and column {} is missing", words.len(), at + 1))
}

/// Time of a row in 1e-9 of its unit.
fn nano(words: &[&str], columns: &Columns) -> Result<i128, String> {
    let nano = |at: usize| {
        let word = cell(words, at)?;
        let nano = parse_date(word).map(i128::from);
        // Decimal commas stand between semicolons and tabs.
        nano.or_else(|| parse_signed_nano(&word.replacen(',', ".", 1)))
            .ok_or_else(|| format!("has {word:?} in column {}, which is not a time", at + 1))
    };
    match columns.time {
        TimeColumns::One(at, _) => nano(at),
        TimeColumns::Parts(seconds, rest) => Ok(nano(seconds)? + nano(rest)? / 1_000_000_000),
    }
}

/// Sample of a row's cells; the error completes "line 3 ...".
fn parsed(words: &[&str], columns: &Columns, unit: TimeUnit) -> Result<TimedReading, String> {
    let number = |at: usize| {
        let word = cell(words, at)?;
        word.replacen(',', ".", 1)
            .parse::<f64>()
            .map_err(|_| format!("has {word:?} in column {}, which is not a number", at + 1))
    };
    let mut turn_rate = [0.0; 3];
    let mut force = [0.0; 3];
    for axis in 0..3 {
        turn_rate[axis] = number(columns.turn[axis].at)? * columns.turn[axis].unit;
        force[axis] = number(columns.force[axis].at)? * columns.force[axis].unit;
    }
    let time = nano(words, columns)?.div_euclid(i128::from(unit.per_second()));
    let time_ns = i64::try_from(time)
        .map_err(|_| "has a time beyond the years that a clock counts".to_owned())?;
    Ok(TimedReading { time_ns, turn_rate, force })
}

/// Unit of the times: as the heading says it, else the longest in which the median interval is one
/// of a unit's samples.
fn unit_of_times(columns: &Columns, rows: &[(usize, &str)]) -> TimeUnit {
    match columns.time {
        TimeColumns::One(_, Some(unit)) => return unit,
        TimeColumns::Parts(..) => return TimeUnit::Seconds,
        TimeColumns::One(_, None) => {}
    }
    let times: Vec<i128> = rows
        .iter()
        .take(UNIT_ROWS)
        .filter_map(|(_, row)| nano(&split(row), columns).ok())
        .collect();
    let mut intervals: Vec<i128> =
        times.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|d| *d > 0).collect();
    intervals.sort_unstable();
    let Some(median) = intervals.get(intervals.len() / 2) else { return TimeUnit::Seconds };
    let interval = *median as f64 * 1e-9;
    let fits = |unit: &TimeUnit| {
        (INTERVAL_S[0]..=INTERVAL_S[1]).contains(&(interval / unit.per_second() as f64))
    };
    TimeUnit::ALL.into_iter().find(fits).unwrap_or_default()
}
