//! Rows of times and poses next to images, matched to the frames by number or time.
//!
//! Decision 66: a table that has one row for each image is taken in their order; any other by the
//! numbers in the images' names, or it is refused. Rows with times belong to the frame they are
//! nearest to.

use super::names::stem_of;
use crate::formats::{TimeTable, TimeUnit, Trajectory};
use crate::input::source::InputError;
use dynvox_core::geometry::Transform;
use std::path::{Path, PathBuf};

/// A pose belongs to a frame if their times differ by at most this, s, or half a frame's interval.
const NEAR_S: f64 = 0.02;
const NS_PER_S: f64 = 1e9;
/// Frames without a pose that are named.
const NAMED: usize = 3;

/// The frames that rows belong to.
pub(super) struct TableFrames<'f> {
    /// The left camera's images, those without a partner among them.
    pub files: &'f [PathBuf],
    /// Position of each frame's image among them.
    pub positions: &'f [usize],
    /// True if the data set numbers its rows as its images, as KITTI does.
    pub numbered: bool,
}

impl TableFrames<'_> {
    /// Numbers in the images' names; `None` unless all names are numbers behind one beginning:
    /// `000123`, `rgb_00123`.
    fn numbers(&self) -> Option<Vec<usize>> {
        let parts = |path: &PathBuf| {
            let stem = stem_of(path);
            let digits = stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
            Some((stem.get(digits..)?.parse().ok()?, stem.get(..digits)?.to_owned()))
        };
        let parts: Vec<(usize, String)> = self.files.iter().map(parts).collect::<Option<_>>()?;
        let one = parts.windows(2).all(|pair| pair[0].1 == pair[1].1);
        one.then(|| parts.into_iter().map(|(number, _)| number).collect())
    }

    /// The row of each frame in a table of `rows` rows without numbers or times, and a note where
    /// that is not one row for each image.
    ///
    /// # Errors
    /// Rows and images cannot be matched. The reason completes a sentence that begins with the
    /// file.
    fn rows(&self, rows: usize) -> Result<(Vec<usize>, Option<String>), String> {
        let images = self.files.len();
        let numbers = self.numbers();
        if rows == images && !(self.numbered && numbers.is_some()) {
            return Ok((self.positions.to_vec(), None));
        }
        let mismatch = || format!("it has {rows} rows for {images} images");
        let Some(numbers) = numbers else {
            return Err(format!("{}, and the images' names are no numbers", mismatch()));
        };
        let (first, last) = (
            numbers.iter().min().copied().unwrap_or(0),
            numbers.iter().max().copied().unwrap_or(0),
        );
        // Images counted from 1, or a clip whose table begins with it.
        let offset = if !self.numbered && rows == last + 1 - first { first } else { 0 };
        if last - offset >= rows {
            return Err(format!("{}, and there are images up to number {last}", mismatch()));
        }
        let of_frame = |&at: &usize| numbers.get(at).map_or(0, |number| number - offset);
        let note = (rows != images && !self.numbered).then(|| {
            format!("{rows} rows for {images} images: matched by the numbers in the images' names")
        });
        Ok((self.positions.iter().map(of_frame).collect(), note))
    }

    /// The time of each frame, ns.
    ///
    /// # Errors
    /// Rows and images cannot be matched.
    pub fn times(
        &self,
        path: &Path,
        table: &TimeTable,
        notes: &mut Vec<String>,
    ) -> Result<Vec<u64>, InputError> {
        let (rows, note) = self.rows(table.times_ns.len()).map_err(|reason| InputError::Table {
            path: path.to_path_buf(),
            reason,
            action: "Give one line for each image, or name the images by their row from 0: \
                     000005.png has the sixth. Or move the file away: it is optional"
                .into(),
        })?;
        notes.extend(note.map(|note| format!("{}: {note}", path.display())));
        notes.extend(unit_note(path, table.unit));
        Ok(rows.iter().filter_map(|&row| table.times_ns.get(row).copied()).collect())
    }

    /// The true pose of each frame, by time where the poses have times, by number else; `None`,
    /// with a note, where a frame has none.
    pub fn poses(
        &self,
        path: &Path,
        read: &Trajectory,
        stamps_ns: Option<&[u64]>,
        notes: &mut Vec<String>,
    ) -> Option<Vec<Transform>> {
        notes.extend(read.notes.iter().cloned());
        let found: Vec<Option<Transform>> = match (stamps_ns, &read.times_s, &read.numbers) {
            (Some(stamps_ns), Some(_), _) => {
                let within_s = NEAR_S.min(half_interval_s(stamps_ns));
                stamps_ns.iter().map(|&ns| read.near(ns as f64 / NS_PER_S, within_s)).collect()
            }
            (_, _, Some(_)) => {
                let numbers = self.numbers().unwrap_or_default();
                let of_frame = |at: &usize| read.of_frame(*numbers.get(*at)?);
                self.positions.iter().map(of_frame).collect()
            }
            _ => match self.rows(read.poses.len()) {
                Ok((rows, note)) => {
                    notes.extend(note.map(|note| format!("{}: {note}", path.display())));
                    rows.iter().map(|&row| read.poses.get(row).copied()).collect()
                }
                Err(reason) => {
                    notes.push(format!("{}: {reason}: not used", path.display()));
                    return None;
                }
            },
        };
        let poses: Option<Vec<Transform>> = found.iter().copied().collect();
        if poses.is_none() {
            notes.push(format!("{}: {}: not used", path.display(), self.without(&found)));
        }
        poses
    }

    /// Says which frames have no pose.
    fn without(&self, found: &[Option<Transform>]) -> String {
        let missing: Vec<usize> = (0..found.len()).filter(|&at| found[at].is_none()).collect();
        let name = |&at: &usize| self.positions.get(at).map(|&at| stem_of(&self.files[at]));
        let names: Vec<String> = missing.iter().take(NAMED).filter_map(name).collect();
        let more = if missing.len() > NAMED { ", ..." } else { "" };
        format!(
            "{} of {} frames have no true pose ({}{more})",
            missing.len(),
            found.len(),
            names.join(", ")
        )
    }
}

/// Says in which unit times are written, unless it is the usual one.
pub(super) fn unit_note(path: &Path, unit: TimeUnit) -> Option<String> {
    (unit != TimeUnit::Seconds).then(|| {
        format!("{}: times are in {}, as their interval tells", path.display(), unit.symbol())
    })
}

/// Half the median interval of times, s; infinite of fewer than two.
fn half_interval_s(stamps_ns: &[u64]) -> f64 {
    let mut intervals: Vec<u64> =
        stamps_ns.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
    intervals.sort_unstable();
    intervals.get(intervals.len() / 2).map_or(f64::INFINITY, |&ns| ns as f64 / NS_PER_S / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(|name| PathBuf::from(format!("{name}.png"))).collect()
    }

    fn rows(names: &[&str], numbered: bool, rows: usize) -> Result<Vec<usize>, String> {
        let files = files(names);
        let positions: Vec<usize> = (0..files.len()).collect();
        let frames = TableFrames { files: &files, positions: &positions, numbered };
        frames.rows(rows).map(|(rows, _)| rows)
    }

    #[test]
    fn rows_go_by_the_images_numbers_where_images_are_missing() {
        let gap = ["000000", "000001", "000003", "000004"];
        assert_eq!(rows(&gap, false, 5), Ok(vec![0, 1, 3, 4]));
        assert_eq!(rows(&gap, false, 4), Ok(vec![0, 1, 2, 3]), "one row for each image");
        assert_eq!(rows(&gap, false, 9), Ok(vec![0, 1, 3, 4]), "rows for more than the clip");
        assert_eq!(rows(&gap, true, 5), Ok(vec![0, 1, 3, 4]));
        assert!(rows(&gap, true, 4).unwrap_err().contains("up to number 4"));
        assert!(rows(&gap, false, 3).unwrap_err().contains("3 rows for 4 images"));
        let from_one = ["1", "2", "4"];
        assert_eq!(rows(&from_one, false, 4), Ok(vec![0, 1, 3]), "counted from 1");
        assert_eq!(rows(&from_one, false, 5), Ok(vec![1, 2, 4]));
        let behind_a_word = ["rgb_00000", "rgb_00001", "rgb_00003"];
        assert_eq!(rows(&behind_a_word, false, 4), Ok(vec![0, 1, 3]));
        assert!(rows(&["a_0", "a_1", "b_3"], false, 4).is_err(), "two beginnings");
        let named = ["apple", "berry", "cherry"];
        assert_eq!(rows(&named, false, 3), Ok(vec![0, 1, 2]));
        assert!(rows(&named, false, 4).unwrap_err().contains("names are no numbers"));
    }

    #[test]
    fn images_without_a_partner_keep_their_row() {
        let files = files(&["a", "b", "c"]);
        let frames = TableFrames { files: &files, positions: &[0, 2], numbered: false };
        assert_eq!(frames.rows(3), Ok((vec![0, 2], None)));
    }

    #[test]
    fn poses_with_times_or_numbers_belong_to_their_frames() {
        let files = files(&["000000", "000001", "000003"]);
        let frames = TableFrames { files: &files, positions: &[0, 1, 2], numbered: true };
        let at = |z: f64| Transform::from_translation([0.0, 0.0, z]);
        let numbered = Trajectory {
            numbers: Some(vec![0, 1, 2, 3]),
            poses: (0..4).map(|z| at(f64::from(z))).collect(),
            ..Trajectory::default()
        };
        let path = Path::new("poses.txt");
        let mut notes = Vec::new();
        let found = frames.poses(path, &numbered, None, &mut notes);
        assert_eq!(found, Some(vec![at(0.0), at(1.0), at(3.0)]));
        let timed = Trajectory {
            times_s: Some((0..61).map(|at| 0.005 * f64::from(at)).collect()),
            poses: (0..61).map(|z| at(0.05 * f64::from(z))).collect(),
            ..Trajectory::default()
        };
        let stamps_ns = [0, 100_000_000, 300_000_000];
        let found = frames.poses(path, &timed, Some(&stamps_ns), &mut notes);
        assert_eq!(found, Some(vec![at(0.0), at(1.0), at(3.0)]), "of 200 Hz");
        assert!(notes.is_empty(), "{notes:?}");
        let late = [0, 100_000_000, 900_000_000];
        assert_eq!(frames.poses(path, &timed, Some(&late), &mut notes), None);
        assert!(notes[0].contains("1 of 3 frames have no true pose (000003)"), "{notes:?}");
    }
}
