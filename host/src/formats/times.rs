//! Time stamps of images: one a line, or with the names of the images.
//!
//! Cameras and programs write seconds, ms, us or ns, mostly without saying so. The median interval
//! tells them apart ([`TimeUnit::told_by`]): no camera here takes an image every 33 s.

use super::rows::lines_of;
use super::{FormatError, read_text};
use std::path::Path;

const NS_PER_S: u64 = 1_000_000_000;
/// Median intervals of frames lie between these, s.
const INTERVAL_S: [f64; 2] = [0.000_5, 3.0];

/// Unit in which a table's times are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TimeUnit {
    /// Seconds.
    #[default]
    Seconds,
    /// Milliseconds.
    Milliseconds,
    /// Microseconds.
    Microseconds,
    /// Nanoseconds.
    Nanoseconds,
}

impl TimeUnit {
    /// All units, the longest first.
    pub const ALL: [Self; 4] =
        [Self::Seconds, Self::Milliseconds, Self::Microseconds, Self::Nanoseconds];

    /// The longest unit in which the median interval of increasing times is one of a camera's
    /// frames; seconds where none is, or there is no interval.
    pub fn told_by(median_interval: Option<f64>) -> Self {
        let Some(interval) = median_interval else { return Self::Seconds };
        let fits = |unit: &Self| {
            (INTERVAL_S[0]..=INTERVAL_S[1]).contains(&(interval / unit.per_second() as f64))
        };
        Self::ALL.into_iter().find(fits).unwrap_or_default()
    }

    /// Units in a second.
    pub fn per_second(self) -> u64 {
        match self {
            Self::Seconds => 1,
            Self::Milliseconds => 1_000,
            Self::Microseconds => 1_000_000,
            Self::Nanoseconds => NS_PER_S,
        }
    }

    /// Symbol.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Seconds => "s",
            Self::Milliseconds => "ms",
            Self::Microseconds => "us",
            Self::Nanoseconds => "ns",
        }
    }
}

/// Times of images, and the unit they were written in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TimeTable {
    /// Times, ns, increasing.
    pub times_ns: Vec<u64>,
    /// Unit in the file, as the interval tells it.
    pub unit: TimeUnit,
}

/// Median interval of increasing times; `None` of fewer than two.
pub(super) fn median_interval(times: impl Iterator<Item = f64> + Clone) -> Option<f64> {
    let mut intervals: Vec<f64> = times.clone().skip(1).zip(times).map(|(b, a)| b - a).collect();
    intervals.sort_by(f64::total_cmp);
    intervals.get(intervals.len() / 2).copied()
}

/// Reads the times of images, one a line and increasing: seconds (KITTI's `times.txt`), ms, us or
/// ns, or date and time of day (`timestamps.txt` of KITTI raw and KITTI-360).
///
/// # Errors
/// The file cannot be read, a line is neither, or times do not increase.
pub fn read_times(path: &Path) -> Result<TimeTable, FormatError> {
    let text = read_text(path)?;
    // Numbers in 1e-9 of their unit, which is not known yet; dates in ns.
    let mut nano: Vec<u128> = Vec::new();
    let mut is_dated = false;
    for (line, row) in lines_of(&text) {
        let date = parse_date(row);
        is_dated |= date.is_some();
        let time = date.map(u128::from).or_else(|| parse_nano(row));
        let time = time.ok_or_else(|| {
            let hint = if row.split_whitespace().nth(1).is_some() || row.contains(',') {
                ": it has more than one number, or a decimal comma"
            } else {
                ""
            };
            refused(path, format!("line {line} is not one time in seconds, ms, us or ns{hint}"))
        })?;
        if nano.last().is_some_and(|&before| before >= time) {
            let reason = format!("the time on line {line} is not after the one before it");
            return Err(refused(path, reason));
        }
        nano.push(time);
    }
    let interval = median_interval(nano.iter().map(|&time| time as f64 * 1e-9));
    let unit = if is_dated { TimeUnit::Seconds } else { TimeUnit::told_by(interval) };
    let in_ns = |time: u128| u64::try_from(time / u128::from(unit.per_second())).ok();
    let times_ns: Option<Vec<u64>> = nano.into_iter().map(in_ns).collect();
    let times_ns =
        times_ns.ok_or_else(|| refused(path, "its times lie beyond the year 2554".to_owned()))?;
    Ok(TimeTable { times_ns, unit })
}

/// Reads a table of time stamps in ns and file names, separated by a comma or white space (EuRoC's
/// and TUM VI's `data.csv`).
///
/// # Errors
/// The file cannot be read, or a line is not a stamp and a name.
pub fn read_stamped_names(path: &Path) -> Result<Vec<(u64, String)>, FormatError> {
    let text = read_text(path)?;
    let row = |(line, row): (usize, &str)| {
        let mut words = row.split([',', ';', ' ', '\t']).filter(|word| !word.is_empty());
        let stamp_ns = words.next().and_then(|word| word.parse().ok());
        let both = stamp_ns.zip(words.next().map(str::to_owned));
        both.ok_or_else(|| {
            refused(path, format!("line {line} is not a time stamp in ns and a file name"))
        })
    };
    lines_of(&text).map(row).collect()
}

fn refused(path: &Path, reason: String) -> FormatError {
    FormatError::content(path, reason, "Correct the line, or move the file away: it is optional")
}

/// Seconds as ns, to the last digit where they are written as a decimal; `None` below 0 or beyond
/// 2^64 ns.
pub fn parse_seconds(text: &str) -> Option<u64> {
    u64::try_from(parse_nano(text)?).ok()
}

/// A number of at least 0 in 1e-9, to the last digit where it is written as a decimal.
fn parse_nano(text: &str) -> Option<u128> {
    let text = text.trim();
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    let is_decimal = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if !whole.is_empty() && is_decimal(whole) && is_decimal(fraction) {
        let fraction: String = fraction.chars().chain("000000000".chars()).take(9).collect();
        let whole: u64 = whole.parse().ok()?;
        return Some(u128::from(whole) * u128::from(NS_PER_S) + fraction.parse::<u128>().ok()?);
    }
    let nano = (text.parse::<f64>().ok()? * NS_PER_S as f64).round();
    (0.0..1.8e28).contains(&nano).then_some(nano as u128)
}

/// Nanoseconds as seconds in decimals, to the last digit, with one digit at least.
pub(super) fn seconds_text(ns: u64) -> String {
    let text = format!("{}.{:09}", ns / NS_PER_S, ns % NS_PER_S);
    let digits = text.trim_end_matches('0');
    if digits.ends_with('.') { format!("{digits}0") } else { digits.to_owned() }
}

/// A number of either sign in 1e-9, to the last digit where it is written as a decimal.
pub(super) fn parse_signed_nano(text: &str) -> Option<i128> {
    let text = text.trim();
    let (sign, digits) = match text.strip_prefix('-') {
        Some(digits) => (-1, digits),
        None => (1, text.strip_prefix('+').unwrap_or(text)),
    };
    i128::try_from(parse_nano(digits)?).ok().map(|nano| sign * nano)
}

/// `2011-09-26 13:02:25.964389445` as ns since 1970.
pub(crate) fn parse_date(text: &str) -> Option<u64> {
    let (date, time) = text.split_once([' ', 'T'])?;
    let [year, month, day] = numbers(date, '-')?;
    let mut parts = time.splitn(3, ':');
    let [hour, minute]: [u64; 2] = [parts.next()?.parse().ok()?, parts.next()?.parse().ok()?];
    let second_ns = parse_seconds(parts.next()?)?;
    if !(1970..2500).contains(&year)
        || !(1..=12).contains(&month)
        || !(1..=31).contains(&day)
        || hour > 23
        || minute > 59
    {
        return None;
    }
    // Days since 1970 of the proleptic Gregorian calendar, with years that begin in March.
    let (year, month) = if month < 3 { (year - 1, month + 9) } else { (year, month - 3) };
    let days =
        365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day - 1 - 719_468;
    ((days * 24 + hour) * 60 + minute).checked_mul(60 * NS_PER_S)?.checked_add(second_ns)
}

fn numbers(text: &str, separator: char) -> Option<[u64; 3]> {
    let values: Option<Vec<u64>> = text.split(separator).map(|word| word.parse().ok()).collect();
    values?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<TimeTable, String> {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("times.txt");
        std::fs::write(&path, text).unwrap();
        read_times(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn the_unit_of_times_is_told_by_their_median_interval() {
        // A camera of 10 Hz that lost three frames, begun at 0 or at a date.
        let frames = [0u64, 1, 2, 6, 7];
        let expected: Vec<u64> = frames.iter().map(|at| at * 100_000_000).collect();
        for (unit, digits) in [
            (TimeUnit::Seconds, 1),
            (TimeUnit::Milliseconds, 4),
            (TimeUnit::Microseconds, 7),
            (TimeUnit::Nanoseconds, 10),
        ] {
            let written = |at: &u64| format!("{}\n", *at as f64 * 10f64.powi(digits - 1) * 0.1);
            let table = read(&frames.iter().map(written).collect::<String>()).unwrap();
            assert_eq!((&table.times_ns, table.unit), (&expected, unit));
        }
        let epoch = 1_403_636_579_763_555_584u64;
        let stamps: String =
            frames.iter().map(|at| format!("{}\n", epoch + at * 50_000_000)).collect();
        let table = read(&stamps).unwrap();
        assert_eq!((table.times_ns[1], table.unit), (epoch + 50_000_000, TimeUnit::Nanoseconds));
        assert_eq!(read("7.5\n").unwrap().unit, TimeUnit::Seconds, "one time has no interval");
        assert!(read("0\n1\n1\n").unwrap_err().contains("line 3 is not after"));
        assert!(read("0 1\n").unwrap_err().contains("more than one number"));
        assert!(read("0,0\n0,1\n").unwrap_err().contains("or a decimal comma"));
    }

    #[test]
    fn decimals_keep_every_digit_and_dates_are_counted_from_1970() {
        assert_eq!(parse_seconds("1403636579.763555584"), Some(1_403_636_579_763_555_584));
        assert_eq!(
            [parse_seconds("0"), parse_seconds("1.036e-01"), parse_seconds("7.5")],
            [Some(0), Some(103_600_000), Some(7_500_000_000)]
        );
        assert_eq!(
            [0, 100_000_000, 1_403_636_579_763_555_584].map(seconds_text),
            ["0.0", "0.1", "1403636579.763555584"]
        );
        assert_eq!(
            [parse_seconds("-1"), parse_seconds("soon"), parse_seconds(""), parse_seconds("nan")],
            [None; 4]
        );
        assert_eq!(parse_date("2011-09-26 13:02:25.964389445"), Some(1_317_042_145_964_389_445));
        assert_eq!(parse_date("1970-01-01 00:00:00.0"), Some(0));
        assert_eq!(parse_date("2000-02-29 23:59:59"), Some(951_868_799_000_000_000));
        assert_eq!([parse_date("2011-13-01 00:00:00"), parse_date("today")], [None; 2]);
    }

    #[test]
    fn a_table_of_stamps_and_names_may_have_commas_or_blanks() {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("data.csv");
        std::fs::write(&path, "#timestamp [ns],filename\r\n10,10.png\r\n20, 20.png\n30 30.png\n")
            .unwrap();
        let rows = read_stamped_names(&path).unwrap();
        assert_eq!(rows, [(10, "10.png".into()), (20, "20.png".into()), (30, "30.png".into())]);
        std::fs::write(&path, "now,a.png\n").unwrap();
        assert!(
            read_stamped_names(&path)
                .unwrap_err()
                .to_string()
                .contains("line 1 is not a time stamp")
        );
    }
}
