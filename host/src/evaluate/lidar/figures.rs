//! Figures of a run: means over its evaluated frames.

use super::{Layer, RULES, ScanCount, Tally};
use serde::Serialize;

/// Counts of one evaluated frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvaluatedFrame {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// What became of the scan's points.
    pub count: ScanCount,
    /// Counts by [`Layer`].
    pub layers: [Tally; 3],
}

/// Input or map in one layer, by KITTI's rule unless said otherwise.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SourceFigures {
    /// Share that is right of the points both sources have.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<f64>,
    /// Share of the points it has.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub completeness: Option<f64>,
    /// Mean of the frames' harmonic means of the two.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f1: Option<f64>,
    /// Points in all frames.
    pub points: u64,
    /// Share that is right of the points this source has.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy_alone: Option<f64>,
    /// Accuracy by plain thresholds: px, share.
    pub accuracy_by_px: Vec<(f32, f64)>,
}

/// Input and map in one layer.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PairFigures {
    /// The matcher's disparity.
    pub input: SourceFigures,
    /// The map's.
    pub fused: SourceFigures,
    /// Frames with a point of this layer.
    pub frames: usize,
}

/// A run against LiDAR.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LidarFigures {
    /// `lidar` or `exact`.
    pub source: &'static str,
    /// Frames after which the map was looked at.
    pub delay_frames: usize,
    /// Frames evaluated.
    pub frames: usize,
    /// The street.
    #[serde(rename = "static")]
    pub still: PairFigures,
    /// What has a volume of its own.
    pub dynamic: PairFigures,
    /// Points on what could move and has none: not in the figures above.
    pub ignored_points: u64,
    /// Points nearer or farther than what is fused, and points beside the image.
    pub left_out_points: u64,
    /// Points whose rows in the two images differ too much.
    pub epipolar_violations: u64,
}

impl LidarFigures {
    /// Sums up; `None` without a frame.
    pub fn of(source: &'static str, delay_frames: usize, frames: &[EvaluatedFrame]) -> Option<Self> {
        let counted = |of: fn(&EvaluatedFrame) -> u32| frames.iter().map(|frame| u64::from(of(frame))).sum::<u64>();
        (!frames.is_empty()).then(|| Self {
            source,
            delay_frames,
            frames: frames.len(),
            still: pair(frames, Layer::Static),
            dynamic: pair(frames, Layer::Dynamic),
            ignored_points: counted(|frame| frame.layers[Layer::Ignored as usize].total),
            left_out_points: counted(|frame| frame.count.out_of_range + frame.count.outside),
            epipolar_violations: counted(|frame| frame.count.epipolar),
        })
    }
}

fn pair(frames: &[EvaluatedFrame], layer: Layer) -> PairFigures {
    let tallies: Vec<&Tally> = frames.iter().map(|frame| &frame.layers[layer as usize]).collect();
    let source = |source: usize| {
        let over = |of: &dyn Fn(&Tally) -> Option<f64>| mean(tallies.iter().filter_map(|tally| of(tally)));
        SourceFigures {
            accuracy: over(&|tally| tally.accuracy(source, 0)),
            completeness: over(&|tally| tally.completeness(source)),
            f1: over(&|tally| tally.f1(source, 0)),
            points: tallies.iter().map(|tally| u64::from(tally.total)).sum(),
            accuracy_alone: over(&|tally| tally.accuracy_alone(source, 0)),
            accuracy_by_px: (1..RULES.len())
                .filter_map(|rule| Some((RULES[rule].px, over(&|tally| tally.accuracy(source, rule))?)))
                .collect(),
        }
    };
    PairFigures {
        input: source(0),
        fused: source(1),
        frames: tallies.iter().filter(|tally| tally.total > 0).count(),
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0u32), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}
