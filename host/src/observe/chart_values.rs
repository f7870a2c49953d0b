//! Values of the report's charts, frame by frame: columns of `frames.csv`, thinned so that a long
//! run has no more points than a short one.

use super::FrameRow;
use super::tables::frame_columns;
use serde::{Deserialize, Serialize};

/// Points kept at most; beyond them two become one.
const MAX_POINTS: usize = 1120;

/// One frame, or the values farthest from 0 of several in a row. Unknown values are NaN.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Point {
    /// Number of the first frame.
    frame: usize,
    /// One value for each charted column, in the order of the table.
    values: Vec<f32>,
}

impl Point {
    fn from_row(row: &FrameRow) -> Self {
        let charted = frame_columns().iter().filter(|column| column.is_charted());
        Self {
            frame: row.frame,
            values: charted.map(|column| column.cell(row).as_f32()).collect(),
        }
    }

    /// Keeps the value farther from 0, in each column.
    fn merge(&mut self, next: &Self) {
        for (value, next) in self.values.iter_mut().zip(&next.values) {
            if value.is_nan() || next.abs() > value.abs() {
                *value = *next;
            }
        }
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
        // A point takes so many frames; the next one begins a new point.
        let begins = self.frames.is_multiple_of(self.frames_per_point());
        match self.points.last_mut() {
            Some(last) if !begins => last.merge(&point),
            _ => {
                // Twice the frames a point, so that the number of points stays bounded.
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
        let mut thinned = Vec::with_capacity(MAX_POINTS);
        let mut points = std::mem::take(&mut self.points).into_iter();
        while let Some(mut first) = points.next() {
            // Of an odd number the last one stays alone.
            if let Some(second) = points.next() {
                first.merge(&second);
            }
            thinned.push(first);
        }
        self.points = thinned;
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

    /// Values of a charted column of `frames.csv`, one for each point: that of its frames which is
    /// farthest from 0. Empty for a column that is not charted, which is a mistake of the caller.
    pub fn series(&self, column: &str) -> Vec<f64> {
        let mut charted = frame_columns().iter().filter(|column| column.is_charted());
        let Some(at) = charted.position(|known| known.name == column) else {
            debug_assert!(false, "{column} is no charted column of frames.csv");
            return Vec::new();
        };
        // NaN is what a chart leaves out.
        let value = |point: &Point| point.values.get(at).copied().unwrap_or(f32::NAN);
        self.points.iter().map(|point| f64::from(value(point))).collect()
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
            (short.frames_per_point(), short.frames()[1], short.series("step_ms")[1]),
            (1, 11, 1.0)
        );
        // 5,000 frames need 8 of them a point, to be less than the most points.
        let long = run(5_000);
        assert_eq!((long.frames_per_point(), long.frames().len()), (8, 625));
        assert_eq!(long.frames()[1], 18);
        // The greatest of a point's frames, since peaks matter in a chart of times.
        assert_eq!([0, 1, 624].map(|at| long.series("step_ms")[at]), [7.0, 15.0, 4_999.0]);
        assert!(
            long.series("rss_bytes").iter().all(|value| value.is_nan()),
            "unknown stays unknown"
        );
    }
}
