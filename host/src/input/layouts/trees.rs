//! What the layouts of published data sets share: small tables of numbers, and recordings below
//! folders.

use crate::formats::bounds::TABLE_TEXT;
use crate::formats::{FormatError, read_text_within};
use std::path::Path;

/// The rows of a table in which every word is a number; others are passed over.
///
/// # Errors
/// The file cannot be read.
pub fn rows(path: &Path) -> Result<Vec<Vec<f64>>, FormatError> {
    let text = read_text_within(path, &TABLE_TEXT)?;
    let number = |word: &str| word.parse::<f64>().ok().filter(|value| value.is_finite());
    let row = |line: &str| line.split_whitespace().map(number).collect::<Option<Vec<_>>>();
    Ok(text.lines().filter_map(row).filter(|row| !row.is_empty()).collect())
}

/// The first numbers of the first row of a table.
///
/// # Errors
/// There are fewer, or no file: `action` says what to do, or a calibration is given.
pub fn first_row<const N: usize>(path: &Path, action: &str) -> Result<[f64; N], FormatError> {
    let refuse = |reason: &str| {
        let action = format!("{action}, or give a calibration with --calibration");
        FormatError::content(path, reason, action)
    };
    if !path.is_file() {
        return Err(refuse("it is not there"));
    }
    let rows = rows(path)?;
    let first = rows.first().and_then(|row| row.first_chunk::<N>());
    first.copied().ok_or_else(|| refuse("its first row is not that of a camera"))
}
