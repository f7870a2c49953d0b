//! Trajectory errors: KITTI's relative errors over sub-lengths, relative error per frame, absolute
//! error after alignment.
//!
//! `E = (est_i^-1 est_j)^-1 (true_i^-1 true_j)` is the error of a segment from frame i to frame j.
//! A segment of length L ends at the first frame whose distance travelled along the truth is at
//! least L beyond frame i's; the errors of all segments of all lengths are averaged (Geiger, Lenz,
//! Urtasun, *Are we ready for autonomous driving?*, CVPR 2012: 100 to 800 m, from every tenth frame
//! on). A path shorter than 200 m would have few segments of few lengths: it is measured over 5 to
//! 50 m from every frame on, and the result lists its lengths.

mod align;
mod association;
mod boresight;
mod files;
mod travelled;

pub use boresight::WithoutBoresight;
pub use files::{
    MatchedPoses, TrajectoryError, frames_of_run, matched, read_trajectory, truth_of_frames,
};
pub use travelled::travelled_m;

use align::aligned_error_m;
use boresight::boresight;
use dynvox_core::geometry::Transform;
use nalgebra::Vector3;
use serde::Serialize;

/// Sub-lengths of the benchmark, m.
pub const LONG_M: [f64; 8] = [100.0, 200.0, 300.0, 400.0, 500.0, 600.0, 700.0, 800.0];
/// Sub-lengths for clips, m.
pub const SHORT_M: [f64; 6] = [5.0, 10.0, 20.0, 30.0, 40.0, 50.0];

/// Frames between two starts of the benchmark's segments.
const LONG_STEP: usize = 10;

/// Errors of a trajectory.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrajectoryErrors {
    /// Mean translation error of the segments, percent of their length; `None` where the path is
    /// shorter than every length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub t_err_percent: Option<f64>,
    /// Mean rotation error of the segments, degrees per metre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub r_err_deg_per_m: Option<f64>,
    /// Mean of the segments' translation errors as vectors, percent of their length, along the
    /// camera's axes at their start: right, down, forward. Noise averages out here. What does not
    /// is a camera turned against that of the truth (right, down) or a wrong scale (forward).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_error_percent: Option<[f64; 3]>,
    /// Errors that remain after the camera's axes are turned to those of the truth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub without_boresight: Option<WithoutBoresight>,
    /// Root mean square translation error from frame to frame, m.
    pub rpe_t_m: f64,
    /// Root mean square rotation error from frame to frame, degrees.
    pub rpe_r_deg: f64,
    /// Root mean square distance of the positions after the best rigid alignment, m.
    pub ate_m: f64,
    /// Each sub-length that fits at least once: length in m, translation in percent, rotation in
    /// deg/m, segments.
    pub per_length: Vec<(f64, f64, f64, usize)>,
}

/// Compares an estimated with a true `t_world_camera` per frame. `None` with fewer than two frames
/// or unequal lists.
pub fn errors(truth: &[Transform], estimate: &[Transform]) -> Option<TrajectoryErrors> {
    if truth.len() < 2 || truth.len() != estimate.len() {
        return None;
    }
    let travelled = travelled_m(truth);
    // KITTI's lengths need a path of 200 m; shorter ones get shorter segments from every frame.
    let long = travelled.last()? >= &LONG_M[1];
    let (lengths, step): (&[f64], usize) = if long { (&LONG_M, LONG_STEP) } else { (&SHORT_M, 1) };
    // KITTI's metric: relative motion over segments of fixed lengths.
    let segment = |from: usize, to: usize, length_m: f64| {
        let [estimated, actual] = [estimate, truth].map(|poses| poses[from].inverse() * poses[to]);
        Segment { length_m, estimated, actual }
    };
    let (mut all, mut per_length) = (Vec::new(), Vec::new());
    for &length_m in lengths {
        // A segment ends at the first frame beyond its length, along the true path.
        let segments = (0..truth.len()).step_by(step).map_while(|from| {
            let to = travelled.partition_point(|&at| at < travelled[from] + length_m);
            (to < truth.len()).then(|| segment(from, to, length_m))
        });
        let segments: Vec<Segment> = segments.collect();
        if let Some(mean) = SegmentError::mean(&segments) {
            per_length.push((length_m, mean.percent, mean.deg_per_m, segments.len()));
        }
        all.extend(segments);
    }
    // From frame to frame, segments of one step each.
    let steps: Vec<Segment> = (1..truth.len()).map(|to| segment(to - 1, to, 1.0)).collect();
    let overall = SegmentError::mean(&all);
    Some(TrajectoryErrors {
        t_err_percent: overall.map(|mean| mean.percent),
        r_err_deg_per_m: overall.map(|mean| mean.deg_per_m),
        mean_error_percent: overall.map(|mean| mean.vector_percent.into()),
        without_boresight: without_boresight(&all, &steps),
        rpe_t_m: rms(steps.iter().map(|step| step.error().distance_m())),
        rpe_r_deg: rms(steps.iter().map(|step| step.error().angle_rad().to_degrees())),
        ate_m: aligned_error_m(truth, estimate),
        per_length,
    })
}

/// Errors of the segments, and of the steps from frame to frame, where the camera's axes are turned
/// to those of the truth.
fn without_boresight(segments: &[Segment], steps: &[Segment]) -> Option<WithoutBoresight> {
    let turn = boresight(segments)?;
    let turned = |segment: &Segment| Segment {
        // The motion in axes turned by the boresight, and back.
        estimated: turn * segment.estimated * turn.inverse(),
        ..*segment
    };
    Some(WithoutBoresight {
        angle_deg: turn.angle_rad().to_degrees(),
        t_err_percent: SegmentError::mean(&segments.iter().map(turned).collect::<Vec<_>>())?
            .percent,
        rpe_t_m: rms(steps.iter().map(|step| turned(step).error().distance_m())),
    })
}

/// A motion from one frame to another.
#[derive(Clone, Copy)]
struct Segment {
    length_m: f64,
    estimated: Transform,
    actual: Transform,
}

impl Segment {
    /// The error of the estimate.
    fn error(&self) -> Transform {
        self.estimated.inverse() * self.actual
    }
}

/// Error of a segment, or the mean of several.
#[derive(Clone, Copy, Default)]
struct SegmentError {
    percent: f64,
    deg_per_m: f64,
    /// Estimated less true translation, along the axes of the segment's first camera.
    vector_percent: Vector3<f64>,
}

impl SegmentError {
    fn new(segment: &Segment) -> Self {
        let (error, Segment { length_m, estimated, actual }) = (segment.error(), segment);
        let [estimated_m, actual_m] =
            [estimated, actual].map(|moved| Vector3::from(moved.translation_m));
        Self {
            percent: error.distance_m() / length_m * 100.0,
            deg_per_m: error.angle_rad().to_degrees() / length_m,
            vector_percent: (estimated_m - actual_m) / *length_m * 100.0,
        }
    }

    fn mean(segments: &[Segment]) -> Option<Self> {
        let count = segments.len() as f64;
        let sum = segments.iter().map(Self::new).fold(Self::default(), |sum, segment| Self {
            percent: sum.percent + segment.percent,
            deg_per_m: sum.deg_per_m + segment.deg_per_m,
            vector_percent: sum.vector_percent + segment.vector_percent,
        });
        (!segments.is_empty()).then(|| Self {
            percent: sum.percent / count,
            deg_per_m: sum.deg_per_m / count,
            vector_percent: sum.vector_percent / count,
        })
    }
}

fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    (values.map(|value| value * value).sum::<f64>() / count).sqrt()
}

#[cfg(test)]
mod tests;
