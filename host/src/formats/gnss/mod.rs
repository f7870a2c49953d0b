//! Where a receiver of satellites was, frame by frame: rows of latitude, longitude, altitude, and
//! angles where an inertial system gives them.
//!
//! Read are a text file with a line a frame, a folder with a file a frame (`oxts/data` of a
//! recording of KITTI raw), or a receiver's own NMEA, which has times ([`nmea`]). A row has 3
//! numbers (degrees, degrees, m above the ellipsoid), 6 (with roll, pitch, yaw, rad, as KITTI's
//! oxts: yaw 0 is east, counterclockwise) or KITTI's 30: the first six are read. A line `-` is a
//! frame without a fix.

mod nmea;

use super::rows::{lines_of, numbers_of};
use super::{FormatError, read_text};
use std::path::{Path, PathBuf};

/// Equatorial radius of WGS 84, m.
const RADIUS_M: f64 = 6_378_137.0;
/// First eccentricity of the ellipsoid, squared.
const ECCENTRICITY_SQUARED: f64 = 0.006_694_379_990_141_316;
/// Frames of a recording: a week at 30 Hz.
const FRAMES_MAX: usize = 20_000_000;
/// Greatest angle, rad: a turn, with the rounding of people's tables.
const TURN_MAX_RAD: f64 = 6.3;
/// Folders of KITTI raw with a file a frame, below that of the recording.
const FOLDERS: [&str; 3] = ["oxts/data", "data", "."];

/// Position of the receiver at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// Latitude and longitude, degrees, and altitude, m.
    pub geodetic: [f64; 3],
    /// Roll, pitch, yaw of the vehicle (x forward, y left, z up) to east, north, up, rad.
    pub angles_rad: Option<[f64; 3]>,
    /// Standard deviations to the east, north and up, m, where the receiver tells them.
    pub sigma_m: Option<[f64; 3]>,
}

/// Position at a time of the receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedFix {
    /// Time, s since 1970, UTC.
    pub time_s: f64,
    /// The position.
    pub fix: Fix,
}

/// Fixes of a recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Fixes {
    /// One for each frame, by its number from 0; `None` without a fix.
    ByFrame(Vec<Option<Fix>>),
    /// At increasing times.
    ByTime(Vec<TimedFix>),
}

impl Fixes {
    /// Returns the first fix.
    pub fn first(&self) -> Option<Fix> {
        match self {
            Self::ByFrame(fixes) => fixes.iter().flatten().next().copied(),
            Self::ByTime(fixes) => fixes.first().map(|first| first.fix),
        }
    }
}

/// East, north and up at a point: a plane that touches the ellipsoid there, so that nothing is
/// stretched. The ground falls away from it by 8 cm at a distance of 1 km.
#[derive(Clone, Copy, Debug)]
pub struct LocalPlane {
    origin_m: [f64; 3],
    axes: [[f64; 3]; 3],
}

impl LocalPlane {
    /// At latitude and longitude, degrees, and altitude, m.
    pub fn at(geodetic: [f64; 3]) -> Self {
        let (sin_lat, cos_lat) = geodetic[0].to_radians().sin_cos();
        let (sin_lon, cos_lon) = geodetic[1].to_radians().sin_cos();
        Self {
            origin_m: earth_centred_m(geodetic),
            axes: [
                [-sin_lon, cos_lon, 0.0],
                [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat],
                [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat],
            ],
        }
    }

    /// East, north and up of a point, m.
    pub fn east_north_up_m(&self, geodetic: [f64; 3]) -> [f64; 3] {
        let at_m = earth_centred_m(geodetic);
        self.axes
            .map(|axis| (0..3).map(|side| axis[side] * (at_m[side] - self.origin_m[side])).sum())
    }
}

fn earth_centred_m([latitude_deg, longitude_deg, altitude_m]: [f64; 3]) -> [f64; 3] {
    let (sin_lat, cos_lat) = latitude_deg.to_radians().sin_cos();
    let (sin_lon, cos_lon) = longitude_deg.to_radians().sin_cos();
    let normal_m = RADIUS_M / (1.0 - ECCENTRICITY_SQUARED * sin_lat * sin_lat).sqrt();
    let across_m = (normal_m + altitude_m) * cos_lat;
    [
        across_m * cos_lon,
        across_m * sin_lon,
        (normal_m * (1.0 - ECCENTRICITY_SQUARED) + altitude_m) * sin_lat,
    ]
}

/// Reads the fixes of a recording: a file with a line a frame, a folder with a file a frame, or
/// NMEA.
///
/// # Errors
/// It cannot be read, a row is no fix, or the folder has none.
pub fn read_gnss(path: &Path) -> Result<Fixes, FormatError> {
    if !path.is_dir() {
        let text = read_text(path)?;
        if nmea::is_nmea(&text) {
            return nmea::read(path, &text).map(Fixes::ByTime);
        }
        let rows = lines_of(&text).map(|(line, row)| row_of(path, line, row));
        return rows.collect::<Result<_, _>>().map(Fixes::ByFrame);
    }
    let files = FOLDERS
        .iter()
        .map(|folder| text_files(&path.join(folder)))
        .find(|files| !files.is_empty())
        .unwrap_or_default();
    if files.is_empty() {
        return Err(FormatError::content(
            path,
            "it has no fixes",
            "Give a file, or a recording of KITTI raw with `oxts/data`",
        ));
    }
    // A frame whose file is missing has no fix.
    let mut fixes = Vec::new();
    for (number, file) in &files {
        let text = read_text(file)?;
        let (line, row) = lines_of(&text).next().unwrap_or((1, "-"));
        let fix = row_of(file, line, row)?;
        if *number >= FRAMES_MAX {
            return Err(FormatError::content(
                file,
                format!("its number is not that of a frame: there are at most {FRAMES_MAX}"),
                "Name the files by the frames' numbers, from 0",
            ));
        }
        fixes.resize(*number, None);
        fixes.push(fix);
    }
    Ok(Fixes::ByFrame(fixes))
}

fn row_of(path: &Path, line: usize, row: &str) -> Result<Option<Fix>, FormatError> {
    if row == "-" {
        return Ok(None);
    }
    if row.starts_with('$') {
        return Err(FormatError::content(
            path,
            format!("line {line} is NMEA among other rows"),
            "Give the receiver's own file with nothing else, or a line for each frame: latitude \
             and longitude in degrees, altitude in m",
        ));
    }
    let fix = numbers_of(row).and_then(|numbers| {
        let &[latitude_deg, longitude_deg, altitude_m, ref more @ ..] = &numbers[..] else {
            return None;
        };
        let angles_rad = match more {
            [] => None,
            &[roll, pitch, yaw] => Some([roll, pitch, yaw]),
            &[roll, pitch, yaw, ..] if numbers.len() == 30 => Some([roll, pitch, yaw]),
            _ => return None,
        };
        let is_on_earth = latitude_deg.abs() <= 90.0 && longitude_deg.abs() <= 360.0;
        is_on_earth.then_some(Fix {
            geodetic: [latitude_deg, longitude_deg, altitude_m],
            angles_rad,
            sigma_m: None,
        })
    });
    let action = "A line holds latitude, longitude, altitude (3 numbers), with roll, pitch, yaw \
                  (6), KITTI's 30, or - where there was no fix";
    if let Some(angle) = fix
        .and_then(|fix| fix.angles_rad)
        .and_then(|angles_rad| angles_rad.into_iter().find(|angle| angle.abs() > TURN_MAX_RAD))
    {
        return Err(FormatError::content(
            path,
            format!("line {line} has an angle of {angle}, more than a turn in rad"),
            "It may be in degrees: write roll, pitch and yaw in rad, yaw 0 to the east",
        ));
    }
    fix.map(Some)
        .ok_or_else(|| FormatError::content(path, format!("line {line} is no fix"), action))
}

/// The text files of a folder whose names are numbers, by number.
fn text_files(folder: &Path) -> Vec<(usize, PathBuf)> {
    let entries =
        std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let number = |path: PathBuf| {
        let number = path.file_stem()?.to_str()?.parse().ok()?;
        path.extension().is_some_and(|end| end == "txt").then_some((number, path))
    };
    let mut files: Vec<(usize, PathBuf)> = entries.filter_map(number).collect();
    files.sort();
    files.dedup_by_key(|(number, _)| *number);
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_has_east_north_and_up() {
        let plane = LocalPlane::at([49.0, 8.4, 110.0]);
        let near = |geodetic: [f64; 3], expected: [f64; 3]| {
            let found = plane.east_north_up_m(geodetic);
            assert!(
                (0..3).all(|axis| (found[axis] - expected[axis]).abs() < 0.02),
                "{geodetic:?}: {found:?}"
            );
        };
        near([49.0, 8.4, 113.5], [0.0, 0.0, 3.5]);
        // Radii of curvature at this latitude and altitude: 6,371,959 m along the meridian,
        // 6,390,442 m across it.
        near([49.0 + 0.001, 8.4, 110.0], [0.0, 111.212, 0.0]);
        near([49.0, 8.4 + 0.001, 110.0], [73.173, 0.0, 0.0]);
        let far = plane.east_north_up_m([49.0 + 0.009, 8.4, 110.0]);
        assert!((far[2] + 0.0786).abs() < 1e-3, "{far:?}");
    }

    fn by_frame(path: &Path) -> Vec<Option<Fix>> {
        match read_gnss(path).unwrap() {
            Fixes::ByFrame(fixes) => fixes,
            Fixes::ByTime(fixes) => panic!("{fixes:?}"),
        }
    }

    #[test]
    fn lines_and_the_folders_of_kitti_raw_are_read() {
        let root = tempfile::TempDir::new().unwrap();
        let file = root.path().join("gnss.txt");
        std::fs::write(&file, "# a comment\n49 8.4 110\n-\n49 8.5 110 0.1 0.2 0.3\n").unwrap();
        let fixes = by_frame(&file);
        assert_eq!(
            fixes[0],
            Some(Fix { geodetic: [49.0, 8.4, 110.0], angles_rad: None, sigma_m: None })
        );
        assert_eq!(
            (fixes[1], fixes[2].unwrap().angles_rad, fixes.len()),
            (None, Some([0.1, 0.2, 0.3]), 3)
        );
        let folder = root.path().join("2011_09_26_drive_0001_sync");
        std::fs::create_dir_all(folder.join("oxts/data")).unwrap();
        let rest = " 0".repeat(24);
        for frame in [1, 0] {
            std::fs::write(
                folder.join(format!("oxts/data/{frame:010}.txt")),
                format!("49 8.{frame} 112 .01 .02 -1.5{rest}\n"),
            )
            .unwrap();
        }
        let fixes = by_frame(&folder);
        assert_eq!(
            fixes[1].unwrap(),
            Fix {
                geodetic: [49.0, 8.1, 112.0],
                angles_rad: Some([0.01, 0.02, -1.5]),
                sigma_m: None
            }
        );
        // A gap in the files is a gap in the fixes.
        std::fs::rename(
            folder.join("oxts/data/0000000001.txt"),
            folder.join("oxts/data/0000000003.txt"),
        )
        .unwrap();
        let gap = by_frame(&folder);
        assert!(gap.len() == 4 && gap[1].is_none() && gap[3] == fixes[1]);
        for (row, expected) in [
            ("49 8.4 110 0 0 90.2", "may be in degrees"),
            ("$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47", "without a date"),
            ("49 8.4 110\n$GPGGA,123519,4807.038,N*47", "line 2 is NMEA among other rows"),
        ] {
            std::fs::write(&file, row).unwrap();
            let refused = read_gnss(&file).unwrap_err().to_string();
            assert!(refused.contains(expected), "{refused}");
        }
        std::fs::write(&file, "49 8.4\n").unwrap();
        assert!(
            read_gnss(&file)
                .unwrap_err()
                .to_string()
                .contains("line 1 is no fix. A line holds latitude")
        );
        assert!(read_gnss(root.path()).unwrap_err().to_string().contains("it has no fixes"));
    }
}
