//! Text tables: rows of numbers, and the time stamps of images among them.

use super::{FormatError, read_text};
use std::path::Path;

const NS_PER_S: u64 = 1_000_000_000;

/// The lines of a table that hold something, with their numbers from 1: neither empty nor a
/// comment, which begins with `#`.
pub(super) fn lines_of(text: &str) -> impl Iterator<Item = (usize, &str)> {
    (1..)
        .zip(text.lines().map(str::trim))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

/// The numbers of a line, if all its words are finite numbers.
pub(super) fn numbers_of(line: &str) -> Option<Vec<f64>> {
    line.split_whitespace()
        .map(|word| word.parse().ok().filter(|value: &f64| value.is_finite()))
        .collect()
}

/// Reads the times of images, ns, one a line and increasing: seconds (KITTI's `times.txt`) or date
/// and time of day (`timestamps.txt` of KITTI raw and KITTI-360).
///
/// # Errors
/// The file cannot be read, a line is neither, or times do not increase.
pub fn read_times(path: &Path) -> Result<Vec<u64>, FormatError> {
    let text = read_text(path)?;
    let mut times_ns: Vec<u64> = Vec::new();
    for (line, row) in lines_of(&text) {
        let time_ns = parse_seconds(row).or_else(|| parse_date(row));
        let time_ns = time_ns
            .ok_or_else(|| refused(path, format!("line {line} is not one time in seconds")))?;
        if times_ns.last().is_some_and(|&before| before >= time_ns) {
            return Err(refused(
                path,
                format!("the time on line {line} is not after the one before it"),
            ));
        }
        times_ns.push(time_ns);
    }
    Ok(times_ns)
}

/// Reads a table of time stamps in ns and file names, separated by a comma or white space (EuRoC's
/// and TUM VI's `data.csv`).
///
/// # Errors
/// The file cannot be read, or a line is not a stamp and a name.
pub fn read_stamped_names(path: &Path) -> Result<Vec<(u64, String)>, FormatError> {
    let text = read_text(path)?;
    let row = |(line, row): (usize, &str)| {
        let mut words = row.split([',', ' ', '\t']).filter(|word| !word.is_empty());
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
    let text = text.trim();
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    let is_decimal = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if !whole.is_empty() && is_decimal(whole) && is_decimal(fraction) {
        let fraction: String = fraction.chars().chain("000000000".chars()).take(9).collect();
        return whole
            .parse::<u64>()
            .ok()?
            .checked_mul(NS_PER_S)?
            .checked_add(fraction.parse().ok()?);
    }
    let ns = (text.parse::<f64>().ok()? * NS_PER_S as f64).round();
    (0.0..1.8e19).contains(&ns).then_some(ns as u64)
}

/// Nanoseconds as seconds in decimals, to the last digit, with one digit at least.
pub(super) fn seconds_text(ns: u64) -> String {
    let text = format!("{}.{:09}", ns / NS_PER_S, ns % NS_PER_S);
    let digits = text.trim_end_matches('0');
    if digits.ends_with('.') { format!("{digits}0") } else { digits.to_owned() }
}

/// `2011-09-26 13:02:25.964389445` as ns since 1970.
fn parse_date(text: &str) -> Option<u64> {
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
