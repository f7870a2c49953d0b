//! Names of image files: their natural order, and what in them tells one frame from another.

use crate::formats::PICTURE_ENDINGS;
use crate::input::source::{InputError, read_failed};
use std::cmp::Ordering;
use std::path::{Path, PathBuf};

/// Returns true if a file's name ends like a picture's. Hidden files are none: some systems leave
/// a `._0001.png` of their own beside `0001.png`.
pub fn is_picture(path: &Path) -> bool {
    if path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.')) {
        return false;
    }
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    ending.is_some_and(|ending| PICTURE_ENDINGS.contains(&ending.as_str()))
}

/// The pictures of a folder in natural order.
///
/// # Errors
/// The folder cannot be read, or holds no picture.
pub fn pictures_in(folder: &Path) -> Result<Vec<PathBuf>, InputError> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(read_failed(folder))? {
        let path = entry.map_err(read_failed(folder))?.path();
        if is_picture(&path) && path.is_file() {
            files.push(path);
        }
    }
    if files.is_empty() {
        return Err(InputError::Empty { path: folder.to_path_buf() });
    }
    files.sort_by(|a, b| natural_order(&stem_of(a), &stem_of(b)).then_with(|| a.cmp(b)));
    Ok(files)
}

/// A file's name without folder and ending.
pub fn stem_of(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The order a person expects: runs of digits by their value, everything else by its characters. 8
/// comes before 10, `a2` before `a10`. Names that differ in leading zeros alone are ordered by
/// their length.
pub fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut a_rest, mut b_rest) = (a, b);
    loop {
        let (Some(a_part), Some(b_part)) = (next_part(&mut a_rest), next_part(&mut b_rest)) else {
            return a_rest
                .len()
                .cmp(&b_rest.len())
                .then_with(|| a.len().cmp(&b.len()))
                .then_with(|| a.cmp(b));
        };
        let order = match (digits(a_part), digits(b_part)) {
            (Some(a_digits), Some(b_digits)) => {
                a_digits.len().cmp(&b_digits.len()).then_with(|| a_digits.cmp(b_digits))
            }
            _ => a_part.cmp(b_part),
        };
        if order.is_ne() {
            return order;
        }
    }
}

/// Takes a run of digits, or of anything else, off the front. Nothing is taken of an empty text.
fn next_part<'t>(rest: &mut &'t str) -> Option<&'t str> {
    let first = rest.chars().next()?.is_ascii_digit();
    let end = rest.find(|c: char| c.is_ascii_digit() != first).unwrap_or(rest.len());
    let (part, after) = rest.split_at(end);
    *rest = after;
    Some(part)
}

/// The digits of a run of digits without its leading zeros.
fn digits(part: &str) -> Option<&str> {
    part.starts_with(|c: char| c.is_ascii_digit()).then(|| part.trim_start_matches('0'))
}

/// The parts of the names that differ from frame to frame: what all of them begin and end with is
/// cut away, runs of digits stay whole, and leading zeros do not count. `left_0008`, `left_0010`
/// become 8 and 10.
pub fn varying_parts(stems: &[String]) -> Vec<String> {
    let Some(first) = stems.first() else { return Vec::new() };
    let common = |cut: &dyn Fn(&str, &str) -> usize| {
        stems.iter().map(|stem| cut(first, stem)).min().unwrap_or_default()
    };
    let equal = |a: &mut dyn Iterator<Item = u8>, b: &mut dyn Iterator<Item = u8>| {
        a.zip(b).take_while(|(a, b)| a == b).count()
    };
    let prefix = common(&|a, b| equal(&mut a.bytes(), &mut b.bytes()));
    let suffix = common(&|a, b| equal(&mut a.bytes().rev(), &mut b.bytes().rev()));
    let is_digit = |at: usize| first.as_bytes().get(at).is_some_and(u8::is_ascii_digit);
    let prefix = (0..=prefix).rev().find(|&at| at == 0 || !is_digit(at - 1)).unwrap_or_default();
    let suffix =
        (0..=suffix).rev().find(|&at| at == 0 || !is_digit(first.len() - at)).unwrap_or_default();
    let part = |stem: &String| {
        let middle =
            stem.get(prefix..stem.len().saturating_sub(suffix).max(prefix)).unwrap_or(stem);
        match digits(middle) {
            Some(digits) if middle.bytes().all(|byte| byte.is_ascii_digit()) => {
                format!("{digits:0>1}")
            }
            _ => middle.to_owned(),
        }
    };
    stems.iter().map(part).collect()
}

/// The time stamp a name holds, ns: 19 or 18 digits are nanoseconds, 16 microseconds, 13
/// milliseconds since 1970, `1403636579.763555` seconds. Shorter numbers count frames.
pub fn stamp_in_name(stem: &str) -> Option<u64> {
    if let Some((seconds, fraction)) = stem.split_once('.')
        && seconds.len() >= 9
        && [seconds, fraction].iter().all(|text| text.bytes().all(|byte| byte.is_ascii_digit()))
    {
        return crate::formats::parse_seconds(stem);
    }
    let run = stem.split(|c: char| !c.is_ascii_digit()).max_by_key(|run| run.len())?;
    let unit = match run.len() {
        // Clocks of satellites count from 1980, and some from their own start.
        18 | 19 => 1,
        16 => 1_000,
        13 => 1_000_000,
        _ => return None,
    };
    run.parse::<u64>().ok()?.checked_mul(unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_comes_before_ten_and_numbers_may_stand_anywhere() {
        let mut names = [
            "10",
            "9",
            "11",
            "8",
            "frame10b",
            "frame9b",
            "frame9a",
            "010",
            "1403636579763555584",
            "a",
            "",
        ];
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(
            names,
            [
                "",
                "8",
                "9",
                "10",
                "010",
                "11",
                "1403636579763555584",
                "a",
                "frame9a",
                "frame9b",
                "frame10b"
            ]
        );
    }

    #[test]
    fn what_all_names_share_is_cut_away_and_digits_stay_whole() {
        let parts = |names: &[&str]| {
            varying_parts(&names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>())
        };
        assert_eq!(parts(&["left_0008", "left_0010", "left_0011"]), ["8", "10", "11"]);
        assert_eq!(parts(&["0_000008", "0_000009"]), ["8", "9"]);
        assert_eq!(parts(&["17_right", "18_right"]), ["17", "18"]);
        assert_eq!(
            parts(&["berlin_000019_leftImg8bit", "berlin_000020_leftImg8bit"]),
            ["19", "20"]
        );
        assert_eq!(parts(&["0000", "0001"]), ["0", "1"]);
        assert_eq!(parts(&["a", "b"]), ["a", "b"]);
    }

    #[test]
    fn long_numbers_are_times_and_short_ones_are_not() {
        assert_eq!(stamp_in_name("1403636579763555584"), Some(1_403_636_579_763_555_584));
        assert_eq!(stamp_in_name("left_1403636579763555"), Some(1_403_636_579_763_555_000));
        assert_eq!(stamp_in_name("315966265259836000"), Some(315_966_265_259_836_000));
        assert_eq!(stamp_in_name("1403636579763"), Some(1_403_636_579_763_000_000));
        assert_eq!(stamp_in_name("1403636579.763555"), Some(1_403_636_579_763_555_000));
        assert_eq!([stamp_in_name("000123"), stamp_in_name("a.b"), stamp_in_name("")], [None; 3]);
    }
}
