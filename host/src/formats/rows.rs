//! Text tables: rows of numbers, and times among them.

use super::{FormatError, read_text};
use std::path::Path;

/// The lines of a table that hold something, with their numbers from 1: neither empty nor a comment, which begins with `#`.
pub(super) fn lines_of(text: &str) -> impl Iterator<Item = (usize, &str)> {
    (1..).zip(text.lines().map(str::trim)).filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

/// The numbers of a line, if all its words are finite numbers.
pub(super) fn numbers_of(line: &str) -> Option<Vec<f64>> {
    line.split_whitespace().map(|word| word.parse().ok().filter(|value: &f64| value.is_finite())).collect()
}

/// Reads times: one in seconds a line, increasing.
///
/// # Errors
/// The file cannot be read, a line is not one number, or times do not increase.
pub fn read_times(path: &Path) -> Result<Vec<f64>, FormatError> {
    let text = read_text(path)?;
    let mut times_s: Vec<f64> = Vec::new();
    for (line, row) in lines_of(&text) {
        let refuse = |reason: String| FormatError::content(path, reason, "Correct the line, or move the file away: it is optional");
        let Some(&[time_s]) = numbers_of(row).as_deref() else {
            return Err(refuse(format!("line {line} is not one time in seconds")));
        };
        if times_s.last().is_some_and(|&before| before >= time_s) {
            return Err(refuse(format!("the time on line {line} is not after the one before it")));
        }
        times_s.push(time_s);
    }
    Ok(times_s)
}
