//! KITTI raw's `oxts`: `data` with a file a sample, and `timestamps.txt` with a line for each.
//!
//! Of the thirty numbers of a file `ax ay az` are numbers 12 to 14 and `wx wy wz` 18 to 20: in the
//! vehicle's axes, x forward, y left, z up.

use super::{InertialFormat, InertialTable, TimedReading};
use crate::formats::rows::{lines_of, numbers_of};
use crate::formats::times::{parse_date, parse_signed_nano};
use crate::formats::{FormatError, read_text};
use std::path::{Path, PathBuf};

/// Folders of KITTI raw.
pub(super) static FORMAT: InertialFormat = InertialFormat {
    name: "KITTI oxts",
    files: "KITTI raw's folder `oxts`: `data/0000000000.txt` and so on, `timestamps.txt`",
    matches: |path| folder_of(path).is_some(),
    read,
};

/// Position of `ax` and of `wx` among the numbers of a file.
const FORCE_AT: usize = 11;
const TURN_AT: usize = 17;
/// Numbers of a file.
const NUMBERS: usize = 30;

/// The folder of the samples: `oxts`, or a recording's folder with it.
fn folder_of(path: &Path) -> Option<PathBuf> {
    let is_oxts = |folder: &Path| folder.join("data").is_dir() && folder.join(TIMES).is_file();
    let below = path.join("oxts");
    if is_oxts(&below) {
        return Some(below);
    }
    // Cameras have such a folder, too, with pictures in it.
    let holds_text = || {
        let mut entries = path.join("data").read_dir().into_iter().flatten().flatten();
        entries.any(|entry| entry.path().extension().is_some_and(|ending| ending == "txt"))
    };
    (is_oxts(path) && holds_text()).then(|| path.to_path_buf())
}

/// File with the times.
const TIMES: &str = "timestamps.txt";

/// Reads a folder.
fn read(path: &Path) -> Result<InertialTable, FormatError> {
    let folder = folder_of(path).unwrap_or_else(|| path.to_path_buf());
    let times_file = folder.join(TIMES);
    let text = read_text(&times_file)?;
    let times = times(&times_file, &text)?;
    let data = folder.join("data");
    let mut files: Vec<PathBuf> = data
        .read_dir()
        .map_err(FormatError::read(&data))?
        .flatten()
        .map(|entry| entry.path())
        .filter(|file| file.extension().is_some_and(|ending| ending == "txt"))
        .collect();
    files.sort();
    let mut notes = Vec::new();
    let (mut readings, mut untimed, mut broken) = (Vec::with_capacity(files.len()), 0, 0);
    for (at, file) in files.iter().enumerate() {
        // Where files are missing their numbers still are rows of the times.
        let number = file.file_stem().and_then(|stem| stem.to_str()?.parse().ok());
        let Some(&time_ns) = times.get(number.unwrap_or(at)) else {
            untimed += 1;
            continue;
        };
        match reading(&read_text(file)?, time_ns) {
            Some(reading) => readings.push(reading),
            None => broken += 1,
        }
    }
    for (count, what) in [
        (untimed, "have no line in timestamps.txt: left out"),
        (broken, "do not hold KITTI's thirty numbers: left out"),
    ] {
        if count > 0 {
            notes.push(format!("{}: {count} files {what}", folder.display()));
        }
    }
    InertialTable::from_readings(&folder, FORMAT.name, readings, notes)
}

/// Times of all lines, ns; they need not rise.
fn times(path: &Path, text: &str) -> Result<Vec<i64>, FormatError> {
    lines_of(text)
        .map(|(line, row)| {
            let nano = parse_date(row).map(i128::from).or_else(|| parse_signed_nano(row));
            nano.and_then(|nano| i64::try_from(nano).ok()).ok_or_else(|| {
                FormatError::content(
                    path,
                    format!("line {line} is no date and time of day, and no time in seconds"),
                    "Fetch the recording's timestamps.txt anew",
                )
            })
        })
        .collect()
}

/// The sample of a file's text.
fn reading(text: &str, time_ns: i64) -> Option<TimedReading> {
    let (_, row) = lines_of(text).next()?;
    let numbers = numbers_of(row).filter(|numbers| numbers.len() >= NUMBERS)?;
    let three = |at: usize| numbers.get(at..at + 3)?.try_into().ok();
    Some(TimedReading { time_ns, turn_rate: three(TURN_AT)?, force: three(FORCE_AT)? })
}
