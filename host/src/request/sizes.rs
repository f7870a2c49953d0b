//! Numbers of bytes and sizes as people write them.

use dynvox_core::planning::MAX_SIDE_CELLS;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// A number of bytes as people write it: `48MiB`, `1 GiB`, `50MB`, `1048576`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Bytes(pub usize);

/// Units by their names in lower case; the last one that divides a number evenly is shown.
const UNITS: [(&str, usize); 8] = [
    ("", 1),
    ("b", 1),
    ("kb", 1_000),
    ("mb", 1_000_000),
    ("gb", 1_000_000_000),
    ("kib", 1 << 10),
    ("mib", 1 << 20),
    ("gib", 1 << 30),
];

impl FromStr for Bytes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!("`{text}` is not a number of bytes: write 48MiB, 1GiB, 500MB or a plain number")
        };
        let unit_at = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
        let (number, unit) = text.split_at(unit_at);
        let unit = unit.trim().to_lowercase();
        let (_, unit) = UNITS.iter().find(|(name, _)| *name == unit).ok_or_else(wrong)?;
        let bytes = number.parse::<f64>().map_err(|_| wrong())? * *unit as f64;
        if bytes < 2f64.powi(62) { Ok(Self(bytes as usize)) } else { Err(wrong()) }
    }
}

impl std::fmt::Display for Bytes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            bytes if bytes >= 1 << 30 && bytes.is_multiple_of(1 << 30) => {
                write!(f, "{} GiB", bytes >> 30)
            }
            bytes if bytes >= 1 << 20 && bytes.is_multiple_of(1 << 20) => {
                write!(f, "{} MiB", bytes >> 20)
            }
            bytes => write!(f, "{bytes} bytes"),
        }
    }
}

impl Bytes {
    /// The next whole MiB, as the command line takes it.
    pub(super) fn rounded_up(self) -> String {
        format!("{}MiB", self.0.div_ceil(1 << 20))
    }
}

/// Width and height as `752x480`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageSize(pub usize, pub usize);

impl FromStr for ImageSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let sides = text.split_once(['x', 'X', '×']).and_then(|(width, height)| {
            Some((width.trim().parse().ok()?, height.trim().parse().ok()?))
        });
        sides
            .map(|(width, height)| Self(width, height))
            .ok_or_else(|| format!("`{text}` is not an image size: write 752x480"))
    }
}

/// Cells of a planner's window as `200x200x20`: width, length, height.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WindowSize(pub [usize; 3]);

impl FromStr for WindowSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let sides: Result<Vec<usize>, _> = text.split(['x', 'X', '×']).map(str::parse).collect();
        let within = |side: &usize| (1..=MAX_SIDE_CELLS).contains(side);
        match sides.as_deref() {
            Ok(&[width, length, height]) if [width, length, height].iter().all(within) => {
                Ok(Self([width, length, height]))
            }
            _ => Err(format!(
                "`{text}` is not a window: write 200x200x20, cells from 1 to {MAX_SIDE_CELLS} to \
                 the sides, ahead, upwards"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_read_as_people_write_them() {
        for (text, bytes) in [
            ("48MiB", 48 << 20),
            ("1 GiB", 1 << 30),
            ("1gib", 1 << 30),
            ("1.5MiB", 3 << 19),
            ("500MB", 500_000_000),
            ("77", 77),
        ] {
            assert_eq!(text.parse(), Ok(Bytes(bytes)), "{text}");
        }
        // No number, no unit that is known, below 0, and beyond 64 bits.
        assert!(
            ["", "MiB", "48 pounds", "-1", "1e99", "99999999999GiB"]
                .iter()
                .all(|text| text.parse::<Bytes>().is_err())
        );
        assert_eq!(
            [Bytes(48 << 20), Bytes(3 << 30), Bytes(77)].map(|bytes| bytes.to_string()),
            ["48 MiB", "3 GiB", "77 bytes"]
        );
        assert_eq!("752x480".parse(), Ok(ImageSize(752, 480)));
        assert!("752".parse::<ImageSize>().is_err() && "x480".parse::<ImageSize>().is_err());
        assert_eq!("200x100x20".parse(), Ok(WindowSize([200, 100, 20])));
        // Two sides, a side of 0, one too long, and no numbers.
        assert!(
            ["200x100", "0x1x1", "2000x1x1", "axbxc"]
                .iter()
                .all(|text| text.parse::<WindowSize>().is_err())
        );
    }
}
