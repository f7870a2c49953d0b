//! Errors over all tracks.

use super::association::AssociationFigures;
use super::{FAR_M, LateStates, NEAR_M, TrackComparison, TrackErrors};
use crate::evaluate::quantile::median;
use serde::Serialize;
use std::collections::BTreeMap;

/// Errors over all tracks.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ObjectFigures {
    /// Tracks that belong to a true object.
    pub tracks: usize,
    /// Association of tracks with objects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub association: Option<AssociationFigures>,
    /// Frames by truth (static, dynamic) and state (uncertain, static, dynamic).
    pub confusion: [[u32; 3]; 2],
    /// Tracks with a late motion state, within [`FAR_M`].
    pub tracks_late: usize,
    /// Late motion states within [`NEAR_M`].
    pub late_near: LateStates,
    /// Late motion states from [`NEAR_M`] to [`FAR_M`].
    pub late_far: LateStates,
    /// Changes between static and dynamic of objects whose true state did not change.
    pub flips: u32,
    /// Moving objects within [`NEAR_M`]: frames, median translation error (m) and rotation error
    /// (degrees).
    pub moving_near: Medians,
    /// Moving objects from [`NEAR_M`] to [`FAR_M`].
    pub moving_far: Medians,
    /// Static objects within [`NEAR_M`].
    pub standing_near: Medians,
    /// Most frames in which one static object was classified as dynamic.
    pub false_dynamic_frames: u32,
}

/// Median errors of motions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Medians {
    /// Motions compared.
    pub frames: usize,
    /// Translation, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub t_m: Option<f64>,
    /// Rotation, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub r_deg: Option<f64>,
}

impl ObjectFigures {
    /// Sums up; `None` when nothing was compared.
    pub(super) fn from_comparisons(
        comparisons: &BTreeMap<u32, Vec<TrackComparison>>,
        association: Option<AssociationFigures>,
    ) -> Option<Self> {
        let tracks: Vec<TrackErrors> = comparisons
            .values()
            .map(|comparisons| TrackErrors::from_comparisons(comparisons))
            .collect();
        // Medians: a single wrong association would dominate a mean.
        let medians = |moving: bool, from_m: f64, to_m: f64| {
            let all = comparisons.values().flatten();
            let within =
                all.filter(|one| one.moving == moving && (from_m..to_m).contains(&one.distance_m));
            let errors: Vec<[f64; 2]> = within.filter_map(|one| one.error).collect();
            let of = |at: usize| median(errors.iter().map(|error| error[at]));
            Medians { frames: errors.len(), t_m: of(0), r_deg: of(1) }
        };
        let mut figures = Self {
            tracks: tracks.len(),
            association,
            tracks_late: tracks.iter().filter(|track| track.late_frames > 0).count(),
            late_near: LateStates::from_comparisons(comparisons, 0.0..NEAR_M),
            late_far: LateStates::from_comparisons(comparisons, NEAR_M..FAR_M),
            flips: tracks.iter().map(|track| track.flips).sum(),
            moving_near: medians(true, 0.0, NEAR_M),
            moving_far: medians(true, NEAR_M, FAR_M),
            standing_near: medians(false, 0.0, NEAR_M),
            // The worst track: a static object taken for a moving one is a hole in the map.
            false_dynamic_frames: tracks
                .iter()
                .map(|track| track.confusion[0][2])
                .max()
                .unwrap_or_default(),
            confusion: [[0; 3]; 2],
        };
        for (sum, counts) in tracks.iter().flat_map(|track| track.confusion.iter().enumerate()) {
            figures.confusion[sum].iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
        }
        (!tracks.is_empty()).then_some(figures)
    }
}
