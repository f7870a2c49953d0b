//! The inertial unit of a source: its samples on the clock of the frames.

use crate::formats::InertialTable;
use crate::formats::TimedReading;
use crate::formats::calibration::UnitNoise;
use dynvox_core::geometry::Transform;
use dynvox_core::inertial::{InertialSample, InertialUnit};
use std::path::PathBuf;

/// Share of samples at the largest rate of an axis from which a unit is saturated.
const SATURATED: f64 = 0.02;
/// Samples before the first frame that it is given, ns.
const BEFORE_FIRST_NS: u64 = 1_000_000_000;

/// Files of an inertial unit that a layout knows of, before any is read.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnUnit {
    /// The samples.
    pub samples: UnitSamples,
    /// Files with the unit's mounting; empty where the layout has none.
    pub calibration: Vec<PathBuf>,
}

/// Samples of a recording's own unit.
#[derive(Clone, Debug, PartialEq)]
pub enum UnitSamples {
    /// A file or folder.
    Files(PathBuf),
    /// Messages of a recording of ROS.
    Read(InertialTable),
    /// Messages that cannot be used, with the reason.
    Refused(String),
}

/// An inertial unit: samples on the clock of the frames, mounting, noise.
#[derive(Clone, Debug, PartialEq)]
pub struct InertialUnitData {
    /// File or folder of the samples.
    pub path: PathBuf,
    /// Samples, each later than the one before.
    pub readings: Vec<TimedReading>,
    /// Samples from time zero on, as the mapper takes them.
    pub samples: Vec<InertialSample>,
    /// Unit to rectified left camera coordinates.
    pub t_camera_unit: Transform,
    /// Seconds to add to the samples' times, as a calibration says it.
    pub clock_offset_s: f64,
    /// Noise, as a calibration says it.
    pub noise: UnitNoise,
    /// Samples a second, by the median interval.
    pub rate_hz: f64,
    /// Longest interval between two samples, s.
    pub longest_gap_s: f64,
    /// Samples between the first and the last frame.
    pub within_frames: usize,
}

impl InertialUnitData {
    /// Samples as the mapper takes them: those from time zero on.
    pub fn samples_of(readings: &[TimedReading]) -> Vec<InertialSample> {
        let sample = |reading: &TimedReading| {
            let TimedReading { time_ns, turn_rate, force } = *reading;
            Some(InertialSample { time_ns: u64::try_from(time_ns).ok()?, turn_rate, force })
        };
        readings.iter().filter_map(sample).collect()
    }

    /// Samples later than one frame's time and up to another's; of the first frame those of the
    /// second before it.
    pub fn between(&self, before_ns: Option<u64>, until_ns: u64) -> &[InertialSample] {
        let position_after =
            |time_ns: u64| self.samples.partition_point(|sample| sample.time_ns <= time_ns);
        let from = match before_ns {
            Some(before_ns) => position_after(before_ns),
            None => {
                let begin_ns = until_ns.saturating_sub(BEFORE_FIRST_NS);
                self.samples.partition_point(|sample| sample.time_ns < begin_ns)
            }
        };
        self.samples.get(from..position_after(until_ns)).unwrap_or_default()
    }

    /// Largest turn rate of an axis at which many samples end, rad/s: the end of the range of a
    /// sensor that turns faster.
    fn saturated_rate(&self) -> Option<f64> {
        // No table says the range, and a mapper that knows it takes no clipped rate for a turn.
        (0..3).find_map(|axis| {
            let rates = || self.readings.iter().map(|one| one.turn_rate[axis].abs());
            let largest = rates().fold(0.0, f64::max);
            let at_end = rates().filter(|rate| *rate == largest).count();
            let is_saturated = at_end as f64 > SATURATED * self.readings.len() as f64 && at_end > 4;
            (is_saturated && largest > 0.0).then_some(largest)
        })
    }

    /// The unit as the mapper's configuration has it. The clock's offset is in the samples' times.
    pub fn config(&self) -> InertialUnit {
        let usual = InertialUnit::new(self.t_camera_unit);
        let known = |value: Option<f64>, usual: f64| {
            value.filter(|value| value.is_finite() && *value > 0.0).unwrap_or(usual)
        };
        InertialUnit {
            turn_density: known(self.noise.turn_density, usual.turn_density),
            turn_walk: known(self.noise.turn_walk, usual.turn_walk),
            turn_range: self.saturated_rate().unwrap_or(usual.turn_range),
            ..usual
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_sample_belongs_to_one_frame_for_any_choice_of_frames() {
        let reading = |at: i64| TimedReading {
            time_ns: at * 5_000_000 - 2_000_000_000,
            turn_rate: [0.0; 3],
            force: [0.0, 0.0, 9.8],
        };
        let readings: Vec<TimedReading> = (0..1_000).map(reading).collect();
        let unit = InertialUnitData {
            path: PathBuf::new(),
            samples: InertialUnitData::samples_of(&readings),
            readings,
            t_camera_unit: Transform::IDENTITY,
            clock_offset_s: 0.0,
            noise: UnitNoise::default(),
            rate_hz: 200.0,
            longest_gap_s: 0.005,
            within_frames: 0,
        };
        // Of the first frame the second before it; the mapper's times begin at zero.
        assert_eq!(unit.samples.len(), 600);
        assert_eq!(unit.between(None, 0).len(), 1);
        let first = unit.between(None, 1_500_000_000);
        assert_eq!(
            (first.len(), first[0].time_ns, first[200].time_ns),
            (201, 500_000_000, 1_500_000_000)
        );
        // Frames that are left out give theirs to the next.
        let (mut before, mut taken) = (0, 0);
        for time_ns in [100_000_000u64, 150_000_000, 900_000_000] {
            let samples = unit.between(Some(before), time_ns);
            assert!(samples.iter().all(|one| one.time_ns > before));
            assert!(samples.iter().all(|one| one.time_ns <= time_ns));
            taken += samples.len();
            before = time_ns;
        }
        assert_eq!(taken, 180);
        // A frame without a later time, and one beyond the last sample, have none.
        assert!(unit.between(Some(900_000_000), 900_000_000).is_empty());
        assert!(unit.between(Some(900_000_000), 100_000_000).is_empty());
        assert!(unit.between(Some(20_000_000_000), 21_000_000_000).is_empty());
        assert!(unit.between(Some(u64::MAX - 1), u64::MAX).is_empty());
    }
}
