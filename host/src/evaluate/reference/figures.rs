//! Figures of a run: means over its evaluated frames.

use super::{ACCEPTANCE_RULES, Counts, DepthErrorFigures, Region, Rule, ScanCount};
use serde::{Deserialize, Serialize};

/// Counts of one evaluated frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EvaluatedFrame {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// The scan's points by outcome.
    pub count: ScanCount,
    /// Counts by [`Region`].
    pub regions: [Counts; 3],
}

/// Input or map in one region, by KITTI's rule unless said otherwise.
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

/// Input and map in one region.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PairFigures {
    /// The matcher's disparity.
    pub input: SourceFigures,
    /// The map's.
    pub fused: SourceFigures,
    /// Frames with a point of this region.
    pub frames: usize,
}

/// Input and map against a reference depth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReferenceFigures {
    /// `lidar` or `exact`.
    pub source: &'static str,
    /// Rule by which a disparity counts as right.
    pub rule: &'static str,
    /// Frames after which the map was evaluated.
    pub delay_frames: usize,
    /// Frames evaluated.
    pub frames: usize,
    /// The static background.
    #[serde(rename = "static")]
    pub still: PairFigures,
    /// Objects with a volume of their own; `None` when the map is evaluated later, for the places
    /// of objects in a past frame are not kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dynamic: Option<PairFigures>,
    /// Points on objects without a volume: not in the figures above.
    pub ignored_points: u64,
    /// Points nearer or farther than what is fused, and points outside the image.
    pub left_out_points: u64,
    /// Depth errors of the static map; `None` where it shows no point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub map_depth_error: Option<DepthErrorFigures>,
    /// Points whose rows in the two images differ too much.
    pub epipolar_violations: u64,
}

impl ReferenceFigures {
    /// Sums up; `None` without a frame.
    pub fn from_frames(
        source: &'static str,
        delay_frames: usize,
        frames: &[EvaluatedFrame],
        depth: Option<DepthErrorFigures>,
    ) -> Option<Self> {
        let counted = |of: fn(&EvaluatedFrame) -> u32| {
            frames.iter().map(|frame| u64::from(of(frame))).sum::<u64>()
        };
        (!frames.is_empty()).then(|| Self {
            source,
            rule: Rule::KITTI_NAME,
            delay_frames,
            frames: frames.len(),
            still: pair(frames, Region::Static),
            // Objects have moved on by the time the map is evaluated late.
            dynamic: (delay_frames == 0).then(|| pair(frames, Region::Dynamic)),
            ignored_points: counted(|frame| frame.regions[Region::Ignored as usize].total),
            left_out_points: counted(|frame| frame.count.out_of_range + frame.count.outside),
            map_depth_error: depth,
            epipolar_violations: counted(|frame| frame.count.epipolar),
        })
    }
}

fn pair(frames: &[EvaluatedFrame], region: Region) -> PairFigures {
    // Means over frames: a frame with many points does not outweigh the others.
    let counts: Vec<&Counts> = frames.iter().map(|frame| &frame.regions[region as usize]).collect();
    let source = |source: usize| {
        let over = |of: &dyn Fn(&Counts) -> Option<f64>| {
            mean(counts.iter().filter_map(|counts| of(counts)))
        };
        SourceFigures {
            accuracy: over(&|counts| counts.accuracy(source, 0)),
            completeness: over(&|counts| counts.completeness(source)),
            f1: over(&|counts| counts.f1(source, 0)),
            points: counts.iter().map(|counts| u64::from(counts.total)).sum(),
            accuracy_alone: over(&|counts| counts.accuracy_alone(source, 0)),
            accuracy_by_px: (1..ACCEPTANCE_RULES.len())
                .filter_map(|rule| {
                    Some((
                        ACCEPTANCE_RULES[rule].px,
                        over(&|counts| counts.accuracy(source, rule))?,
                    ))
                })
                .collect(),
        }
    };
    PairFigures {
        input: source(0),
        fused: source(1),
        frames: counts.iter().filter(|counts| counts.total > 0).count(),
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0u32), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}
