//! The frames of a run: their rows go to `frames.csv`; what the end of the run needs of them is
//! kept in a form that does not grow.

use super::tables::frame_row;
use super::{ChartValues, FrameRow, GrowingFile, STAGES, StageTime};
use crate::evaluate::histogram::Histogram;
use crate::formats::FRAMES_FILE;
use dynvox_core::Stage;
use serde::{Deserialize, Serialize};
use std::io;

/// Median and 99th percentile of a stage, over the frames it ran in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageStatistics {
    /// Median wall time, ms.
    pub median_ms: f64,
    /// 99th percentile of the wall time, ms.
    pub p99_ms: f64,
    /// Median CPU time over all threads, ms.
    pub cpu_median_ms: f64,
    /// Frames it ran in.
    pub frames: usize,
}

/// Wall and CPU times of a stage.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct StageTimes {
    wall: Histogram,
    cpu: Histogram,
}

impl StageTimes {
    fn add(&mut self, time: StageTime) {
        self.wall.add(time.wall_ms);
        self.cpu.add(time.cpu_ms);
    }

    fn statistics(&self) -> Option<StageStatistics> {
        Some(StageStatistics {
            median_ms: self.wall.quantile(0.5)?,
            p99_ms: self.wall.quantile(0.99)?,
            cpu_median_ms: self.cpu.quantile(0.5)?,
            frames: self.wall.values(),
        })
    }
}

/// The frames of a run.
#[derive(Debug, Serialize, Deserialize)]
pub struct FrameLog {
    file: GrowingFile,
    frames: usize,
    last: Option<FrameRow>,
    step: StageTimes,
    stages: [StageTimes; STAGES],
    charts: ChartValues,
}

impl Default for FrameLog {
    fn default() -> Self {
        Self {
            file: GrowingFile::new(FRAMES_FILE),
            frames: 0,
            last: None,
            step: StageTimes::default(),
            stages: Default::default(),
            charts: ChartValues::default(),
        }
    }
}

impl FrameLog {
    /// Adds a frame.
    ///
    /// # Errors
    /// The frame's row cannot be written as text.
    pub fn add(&mut self, row: FrameRow) -> io::Result<()> {
        self.file.append(&frame_row(&row, self.frames == 0)?);
        self.frames += 1;
        self.step.add(StageTime { wall_ms: row.step_ms, cpu_ms: row.times.cpu_ms });
        for (times, time) in
            self.stages.iter_mut().zip(row.times.stages).filter(|(_, time)| time.wall_ms > 0.0)
        {
            times.add(time);
        }
        self.charts.add(&row);
        self.last = Some(row);
        Ok(())
    }

    /// Returns the number of frames.
    pub fn len(&self) -> usize {
        self.frames
    }

    /// Returns true if no frame was added yet.
    pub fn is_empty(&self) -> bool {
        self.frames == 0
    }

    /// The last one.
    pub fn last(&self) -> Option<&FrameRow> {
        self.last.as_ref()
    }

    /// Returns the values that charts show.
    pub fn charts(&self) -> &ChartValues {
        &self.charts
    }

    /// Returns the file of the table.
    pub fn file(&mut self) -> &mut GrowingFile {
        &mut self.file
    }

    /// Statistics of `step` and every stage that ran, in pipeline order.
    pub fn stage_statistics(&self) -> Vec<(&'static str, StageStatistics)> {
        let stages =
            Stage::ALL.iter().zip(&self.stages).map(|(stage, times)| (stage.name(), times));
        std::iter::once(("step", &self.step))
            .chain(stages)
            .filter_map(|(name, times)| Some((name, times.statistics()?)))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_are_of_the_frames_a_stage_ran_in() {
        let mut log = FrameLog::default();
        for ms in (1..=200).rev().map(f64::from) {
            let mut row = FrameRow { step_ms: 1.0, ..FrameRow::default() };
            // Half of the frames fused: the statistics of that stage must not contain zeros.
            if ms > 100.0 {
                row.times.stages[Stage::Fuse as usize] =
                    StageTime { wall_ms: ms, cpu_ms: 2.0 * ms };
            }
            log.add(row).unwrap();
        }
        let statistics = log.stage_statistics();
        assert_eq!(
            statistics.iter().map(|(name, of)| (*name, of.frames)).collect::<Vec<_>>(),
            [("step", 200), (Stage::Fuse.name(), 100)]
        );
        let fuse = statistics[1].1;
        // Within a histogram's bins, which are a thousandth wide.
        for (value, exact) in
            [(fuse.median_ms, 151.0), (fuse.p99_ms, 200.0), (fuse.cpu_median_ms, 302.0)]
        {
            assert!((value / exact - 1.0).abs() < 1e-3, "{value} for {exact}");
        }
        assert_eq!((log.len(), log.charts().frames().len()), (200, 200));
    }
}
