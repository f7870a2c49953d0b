//! What the report's charts show of each frame, thinned so that a long run has no more points than
//! a short one.

use super::{FrameRow, STAGES};
use dynvox_core::Stage;
use serde::{Deserialize, Serialize};

/// Points kept at most; beyond them two become one.
const MAX_POINTS: usize = 1120;
/// Values of a point.
const VALUES: usize = 9 + 2 * STAGES;

const MIB: f64 = (1 << 20) as f64;

/// A value that a chart shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Charted {
    /// Matches the camera's motion was estimated of.
    Matches,
    /// Inliers among them.
    Inliers,
    /// Pixels with a disparity, %.
    Density,
    /// Blocks in use.
    BlocksUsed,
    /// Blocks visible.
    BlocksVisible,
    /// Resident memory of the process, MiB.
    Resident,
    /// Size of the disparity offset found, px.
    OffsetFound,
    /// Size of the disparity offset taken out, px.
    OffsetApplied,
    /// Wall time of the step, ms.
    Step,
    /// Wall time of a stage, ms.
    Wall(Stage),
    /// CPU time of a stage, ms.
    Cpu(Stage),
}

impl Charted {
    const fn at(self) -> usize {
        match self {
            Self::Matches => 0,
            Self::Inliers => 1,
            Self::Density => 2,
            Self::BlocksUsed => 3,
            Self::BlocksVisible => 4,
            Self::Resident => 5,
            Self::OffsetFound => 6,
            Self::OffsetApplied => 7,
            Self::Step => 8,
            Self::Wall(stage) => 9 + stage as usize,
            Self::Cpu(stage) => 9 + STAGES + stage as usize,
        }
    }
}

/// One frame, or the largest values of several in a row. Unknown values are NaN.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Point {
    /// Number of the first frame.
    frame: usize,
    values: [f32; VALUES],
}

impl Point {
    fn from_row(row: &FrameRow) -> Self {
        let mut point = Self { frame: row.frame, values: [f32::NAN; VALUES] };
        let (report, (matches, inliers, _)) = (&row.report, row.matches());
        let mut set = |value: Charted, to: f64| point.values[value.at()] = to as f32;
        set(Charted::Matches, f64::from(matches));
        set(Charted::Inliers, f64::from(inliers));
        set(Charted::Density, 100.0 * f64::from(report.stereo.density()));
        set(Charted::BlocksUsed, f64::from(report.blocks.used));
        set(Charted::BlocksVisible, f64::from(report.blocks.visible));
        set(Charted::Resident, row.rss_bytes.map_or(f64::NAN, |bytes| bytes as f64 / MIB));
        set(Charted::OffsetFound, report.self_calibration.offset_px.abs());
        set(Charted::OffsetApplied, report.self_calibration.applied_offset_px.abs());
        set(Charted::Step, row.step_ms);
        for (stage, time) in Stage::ALL.into_iter().zip(&row.times.stages) {
            set(Charted::Wall(stage), time.wall_ms);
            set(Charted::Cpu(stage), time.cpu_ms);
        }
        point
    }

    /// The larger of each value.
    fn merge(&mut self, next: &Self) {
        self.values
            .iter_mut()
            .zip(&next.values)
            .for_each(|(value, next)| *value = value.max(*next));
    }
}

/// The charted values of a run, in at most `MAX_POINTS` points of equally many frames; the last
/// one may have fewer.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct ChartValues {
    points: Vec<Point>,
    /// A point has 2 to the power of this frames.
    doublings: u32,
    frames: usize,
}

impl ChartValues {
    /// Adds a frame.
    pub(super) fn add(&mut self, row: &FrameRow) {
        let point = Point::from_row(row);
        let begins = self.frames.is_multiple_of(self.frames_per_point());
        match self.points.last_mut() {
            Some(last) if !begins => last.merge(&point),
            _ => {
                if self.points.len() == MAX_POINTS {
                    self.halve();
                }
                self.points.push(point);
            }
        }
        self.frames += 1;
    }

    /// Makes one point of two.
    fn halve(&mut self) {
        let merged = self.points.chunks(2).filter_map(|pair| {
            let (mut first, rest) = pair.split_first().map(|(first, rest)| (*first, rest))?;
            rest.iter().for_each(|next| first.merge(next));
            Some(first)
        });
        self.points = merged.collect();
        self.doublings += 1;
    }

    /// Frames in a point.
    pub fn frames_per_point(&self) -> usize {
        1 << self.doublings
    }

    /// Number of the first frame of each point.
    pub fn frames(&self) -> Vec<usize> {
        self.points.iter().map(|point| point.frame).collect()
    }

    /// One value of each point: the largest of its frames.
    pub fn series(&self, value: Charted) -> Vec<f64> {
        self.points.iter().map(|point| f64::from(point.values[value.at()])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(frames: usize) -> ChartValues {
        let mut values = ChartValues::default();
        (0..frames).for_each(|at| {
            values.add(&FrameRow { frame: 10 + at, step_ms: at as f64, ..FrameRow::default() })
        });
        values
    }

    #[test]
    fn a_long_run_has_no_more_points_than_a_short_one_and_keeps_its_peaks() {
        let short = run(MAX_POINTS);
        assert_eq!(
            (short.frames_per_point(), short.frames()[1], short.series(Charted::Step)[1]),
            (1, 11, 1.0)
        );
        let long = run(5_000);
        assert_eq!((long.frames_per_point(), long.frames().len()), (8, 625));
        assert_eq!(long.frames()[1], 18);
        assert_eq!([0, 1, 624].map(|at| long.series(Charted::Step)[at]), [7.0, 15.0, 4_999.0]);
        assert!(
            long.series(Charted::Resident).iter().all(|value| value.is_nan()),
            "unknown stays unknown"
        );
    }
}
