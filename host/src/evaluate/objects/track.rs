//! Errors of one track.

use super::{FAR_M, TrackComparison, rms};
use crate::evaluate::quantile::median;
use dynvox_core::tracking::MotionState;
use serde::Serialize;
use std::collections::BTreeMap;

/// A track's errors.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrackErrors {
    /// The true object it belongs to in most frames.
    pub truth: u32,
    /// Frames compared.
    pub frames: usize,
    /// Frames by truth (static, dynamic) and state (uncertain, static, dynamic).
    pub confusion: [[u32; 3]; 2],
    /// Frames in which the motion state should have been right and was not, within [`FAR_M`].
    pub late_frames: u32,
    /// Changes from static to dynamic or back while the true state stayed the same.
    pub flips: u32,
    /// Motions compared.
    pub motions: usize,
    /// Median translation error of the motion of a frame, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub me_t_m: Option<f64>,
    /// Median rotation error, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub me_r_deg: Option<f64>,
    /// Root mean square of the same, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub me_t_rms_m: Option<f64>,
    /// Root mean square of the same, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub me_r_rms_deg: Option<f64>,
    /// Median true speed, m/s.
    pub true_speed_m_s: f64,
    /// Median of the speed's error over the frames in which it is classified as dynamic, m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_error_m_s: Option<f64>,
    /// Least distance, m.
    pub nearest_m: f64,
    /// Frames compared, by position in the run, and whether the object moved.
    #[serde(skip)]
    pub moving: Vec<(usize, bool)>,
}

impl TrackErrors {
    pub(super) fn from_comparisons(comparisons: &[TrackComparison]) -> Self {
        let mut confusion = [[0; 3]; 2];
        let mut votes = BTreeMap::<u32, usize>::new();
        let (mut late_frames, mut flips) = (0, 0);
        let mut last: Option<&TrackComparison> = None;
        for one in comparisons {
            let state = match one.state {
                MotionState::Uncertain => 0,
                MotionState::Static => 1,
                MotionState::Dynamic => 2,
            };
            confusion[usize::from(one.moving)][state] += 1;
            *votes.entry(one.truth).or_default() += 1;
            late_frames += u32::from(one.is_late() && one.distance_m < FAR_M);
            // Uncertain is no answer: it neither flips nor ends a flip.
            if one.state != MotionState::Uncertain {
                let same = |before: &&TrackComparison| {
                    before.truth == one.truth && before.moving == one.moving && one.is_due()
                };
                flips +=
                    u32::from(last.filter(same).is_some_and(|before| before.state != one.state));
                last = Some(one);
            }
        }
        let dynamic = comparisons.iter().filter(|one| one.state == MotionState::Dynamic);
        let errors = |at: usize| comparisons.iter().filter_map(move |one| Some(one.error?[at]));
        Self {
            // The object that most frames agree on; a track may wander.
            truth: votes.into_iter().max_by_key(|&(_, count)| count).map_or(0, |(truth, _)| truth),
            frames: comparisons.len(),
            confusion,
            late_frames,
            flips,
            motions: errors(0).count(),
            me_t_m: median(errors(0)),
            me_r_deg: median(errors(1)),
            me_t_rms_m: rms(errors(0)),
            me_r_rms_deg: rms(errors(1)),
            true_speed_m_s: median(comparisons.iter().map(|one| one.true_speed_m_s))
                .unwrap_or_default(),
            speed_error_m_s: median(
                dynamic.filter_map(|one| Some(one.speed_m_s? - one.true_speed_m_s)),
            ),
            nearest_m: comparisons.iter().map(|one| one.distance_m).fold(f64::MAX, f64::min),
            moving: comparisons.iter().map(|one| (one.at, one.moving)).collect(),
        }
    }
}
