//! Camera trajectories in text files, read and written.
//!
//! | numbers in a row | format |
//! |---|---|
//! | 12, 16 | KITTI: the rows of `t_world_camera`; 4 x 4 |
//! | 13, 17 | a frame's number before them: KITTI-360, dynvox's objects |
//! | 8 | TUM: time x y z qx qy qz qw; with commas and ns time x y z qw qx qy qz, of the body |
//! | 17 | EuRoC's ground truth, of the body: velocity and biases follow |
//!
//! Poses of the body become those of the left camera by `cam0/sensor.yaml` of the recording.

mod body;
mod row;
mod write;

pub use write::{kitti_line, tum_line, tum_row, write_numbered};

use super::rows::lines_of;
use super::times::{TimeUnit, median_interval};
use super::{FormatError, read_text};
use dynvox_core::geometry::Transform;
use row::Key;
use std::path::Path;

/// Poses from a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trajectory {
    /// Times, s, increasing; `None` where the rows have none.
    pub times_s: Option<Vec<f64>>,
    /// Numbers of the frames, increasing; `None` where the rows have none.
    pub numbers: Option<Vec<usize>>,
    /// `t_world_camera` of each row.
    pub poses: Vec<Transform>,
    /// Statements on how the file was read, for the user.
    pub notes: Vec<String>,
}

impl Trajectory {
    /// The pose of frame `number`: the row of that number, or that row where they have
    /// neither numbers nor times.
    pub fn of_frame(&self, number: usize) -> Option<Transform> {
        let at = match &self.numbers {
            Some(numbers) => numbers.binary_search(&number).ok()?,
            None => number,
        };
        self.poses.get(at).copied()
    }

    /// The pose nearest to a time, at most `within_s` away.
    pub fn near(&self, time_s: f64, within_s: f64) -> Option<Transform> {
        let times_s = self.times_s.as_deref()?;
        let after = times_s.partition_point(|&at| at < time_s);
        let apart = |at: &usize| times_s.get(*at).map_or(f64::INFINITY, |at| (at - time_s).abs());
        let nearest = [after.saturating_sub(1), after]
            .into_iter()
            .min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
        (apart(&nearest) <= within_s).then(|| self.poses.get(nearest).copied()).flatten()
    }
}

/// Reads a file of any format. Empty lines, comments and a heading are passed over.
///
/// # Errors
/// The file cannot be read, a line is not a pose, lines of several formats are mixed, or times or
/// numbers do not increase.
pub fn read_poses(path: &Path) -> Result<Trajectory, FormatError> {
    let text = read_text(path)?;
    let refuse = |line: usize, reason: &str| {
        FormatError::content(
            path,
            format!("line {line} {reason}"),
            "A line holds 12 numbers (KITTI: the rows of t_world_camera), 8 (TUM: time x y z qx qy \
             qz qw), 13 or 17 (a frame's number and a matrix; EuRoC's data.csv), the same in every \
             line, in increasing order",
        )
    };
    let mut read = Trajectory::default();
    let (mut numbers, mut times, mut of_body) = (Vec::new(), Vec::new(), None);
    for (line, row) in lines_of(&text) {
        let (key, pose) = row::parse(row).map_err(|reason| refuse(line, &reason))?;
        let is_body = matches!(key, Key::BodyTime(_));
        if *of_body.get_or_insert(is_body) != is_body {
            return Err(refuse(line, "is of another format than the first"));
        }
        match key {
            Key::Row => {}
            Key::Number(number) if numbers.last().is_some_and(|&before| before >= number) => {
                return Err(refuse(line, "has a frame's number that is not above the one before"));
            }
            Key::Number(number) => numbers.push(number),
            Key::Time(time) | Key::BodyTime(time)
                if times.last().is_some_and(|&before| before >= time) =>
            {
                return Err(refuse(line, "has a time that is not after the one before"));
            }
            Key::Time(time) | Key::BodyTime(time) => times.push(time),
        }
        read.poses.push(pose);
        if ![0, read.poses.len()].contains(&numbers.len())
            || ![0, read.poses.len()].contains(&times.len())
        {
            return Err(refuse(line, "is of another format than the first"));
        }
    }
    read.numbers = (!numbers.is_empty()).then_some(numbers);
    read.set_times(path, times);
    if of_body == Some(true) {
        read.mount_camera(path)?;
    }
    Ok(read)
}

impl Trajectory {
    /// Takes times in a unit that their median interval tells.
    fn set_times(&mut self, path: &Path, times: Vec<f64>) {
        if times.is_empty() {
            return;
        }
        let unit = TimeUnit::told_by(median_interval(times.iter().copied()));
        if unit != TimeUnit::Seconds {
            self.notes.push(format!(
                "{}: times are in {}, as their interval tells",
                path.display(),
                unit.symbol()
            ));
        }
        let per_second = unit.per_second() as f64;
        self.times_s = Some(times.into_iter().map(|time| time / per_second).collect());
    }

    /// Turns poses of the body into those of the left camera, where the recording says how it is
    /// mounted.
    fn mount_camera(&mut self, path: &Path) -> Result<(), FormatError> {
        match body::t_body_camera(path)? {
            Some((file, t_body_camera)) => {
                self.poses.iter_mut().for_each(|pose| *pose = *pose * t_body_camera);
                self.notes.push(format!(
                    "{}: poses of the body, taken to the left camera by {}",
                    path.display(),
                    file.display()
                ));
            }
            None => self.notes.push(format!(
                "{}: poses of the body (IMU), and there is no cam0/sensor.yaml to take them to the \
                 camera",
                path.display()
            )),
        }
        Ok(())
    }
}

/// Reads poses of some frames as [`write_numbered`] writes them.
///
/// # Errors
/// The file cannot be read, or a line is not a number and a pose.
pub fn read_numbered(path: &Path) -> Result<Vec<(usize, Transform)>, FormatError> {
    let Trajectory { numbers, poses, .. } = read_poses(path)?;
    let numbers = match numbers {
        Some(numbers) => numbers,
        None if poses.is_empty() => Vec::new(),
        None => {
            return Err(FormatError::content(
                path,
                "line 1 is not a frame and its pose",
                "A line holds 13 numbers",
            ));
        }
    };
    Ok(numbers.into_iter().zip(poses).collect())
}
