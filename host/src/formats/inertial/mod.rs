//! Samples of an inertial unit: turn rates and accelerations over time, from any of the files in
//! [`INERTIAL_FORMATS`].
//!
//! Every reader gives an [`InertialTable`]: samples in rad/s and m/s2, in the unit's own axes, in
//! the order of their times. What a file says otherwise (another unit, equal times, rows that are
//! not whole) is counted and said in its notes; what cannot be the samples of such a unit (gravity
//! missing, degrees taken for radians) is refused with the next action.

mod checks;
mod columns;
mod order;
mod oxts;
mod table;
#[cfg(test)]
mod tests;

pub use checks::GRAVITY_M_S2;

use super::FormatError;
use std::path::{Path, PathBuf};

/// Reading of an inertial unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedReading {
    /// Time, ns, on the clock of the file; those of a table may begin below zero.
    pub time_ns: i64,
    /// Turn rates about the unit's axes, rad/s.
    pub turn_rate: [f64; 3],
    /// Specific force along the unit's axes, m/s2: gravity included, so that a unit at rest shows
    /// +9.8 along the axis that points up.
    pub force: [f64; 3],
}

/// Samples of an inertial unit as a file has them.
#[derive(Clone, Debug, PartialEq)]
pub struct InertialTable {
    /// File or folder they were read from.
    pub path: PathBuf,
    /// Name of the format.
    pub format: &'static str,
    /// Samples, each time later than the one before.
    pub readings: Vec<TimedReading>,
    /// Sentences about how the file was read, and what of it was left out.
    pub notes: Vec<String>,
}

impl InertialTable {
    /// Orders and checks readings of any source, one by one as they came.
    ///
    /// # Errors
    /// There are too few, or they cannot be those of an inertial unit.
    pub fn from_readings(
        path: &Path,
        format: &'static str,
        readings: Vec<TimedReading>,
        mut notes: Vec<String>,
    ) -> Result<Self, FormatError> {
        let readings = order::ordered(path, readings, &mut notes)?;
        checks::check(path, &readings, &mut notes)?;
        Ok(Self { path: path.to_path_buf(), format, readings, notes })
    }

    /// Samples a second, by the median interval.
    pub fn rate_hz(&self) -> f64 {
        1e9 / order::median_interval_ns(&self.readings).max(1) as f64
    }

    /// Longest interval between two samples, s.
    pub fn longest_gap_s(&self) -> f64 {
        let gaps = self.readings.windows(2).map(|pair| pair[1].time_ns - pair[0].time_ns);
        gaps.max().unwrap_or(0) as f64 * 1e-9
    }
}

/// A format of inertial samples.
#[derive(Debug)]
pub struct InertialFormat {
    /// Name in messages.
    pub name: &'static str,
    /// Files and columns, one sentence for the docs.
    pub files: &'static str,
    /// Recognizes a path.
    matches: fn(&Path) -> bool,
    /// Reads it.
    read: fn(&Path) -> Result<InertialTable, FormatError>,
}

/// All formats of files and folders; messages of ROS are read by the reader of recordings. A path
/// is of the first that matches it.
pub static INERTIAL_FORMATS: &[&InertialFormat] = &[&oxts::FORMAT, &table::FORMAT];

/// Reads the samples of a file or folder.
///
/// # Errors
/// It cannot be read, is of no known format, or holds nothing that can be used.
pub fn read_inertial(path: &Path) -> Result<InertialTable, FormatError> {
    let format = INERTIAL_FORMATS.iter().find(|format| (format.matches)(path));
    match format {
        Some(format) => (format.read)(path),
        None => Err(FormatError::content(
            path,
            "it holds no inertial samples",
            "Give a table with the columns time,wx,wy,wz,ax,ay,az, EuRoC's imu0/data.csv, or \
             KITTI raw's folder `oxts`",
        )),
    }
}
