//! Errors over all tracks.

use super::association::AssociationFigures;
use super::{FAR_M, Judged, Late, NEAR_M, TrackErrors, median};
use serde::Serialize;
use std::collections::BTreeMap;

/// Errors over all tracks.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ObjectFigures {
    /// Tracks that belong to a true thing.
    pub tracks: usize,
    /// How well tracks stay with things.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub association: Option<AssociationFigures>,
    /// Frames by truth (static, dynamic) and state (uncertain, static, dynamic).
    pub confusion: [[u32; 3]; 2],
    /// Tracks with a state not right in time, within [`FAR_M`].
    pub tracks_late: usize,
    /// Tracks whose state was due within [`NEAR_M`].
    pub late_near: Late,
    /// Tracks whose state was due from [`NEAR_M`] to [`FAR_M`].
    pub late_far: Late,
    /// Changes between static and dynamic of things that did not change.
    pub flips: u32,
    /// Moving things within [`NEAR_M`]: frames, median translation error (m) and rotation error (degrees).
    pub moving_near: Medians,
    /// Moving things from [`NEAR_M`] to [`FAR_M`].
    pub moving_far: Medians,
    /// Standing things within [`NEAR_M`].
    pub standing_near: Medians,
    /// Most frames for which a standing thing was called dynamic.
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
    pub(super) fn of(judged: &BTreeMap<u32, Vec<Judged>>, association: Option<AssociationFigures>) -> Option<Self> {
        let tracks: Vec<TrackErrors> = judged.values().map(|judged| TrackErrors::of(judged)).collect();
        let medians = |moving: bool, from_m: f64, to_m: f64| {
            let all = judged.values().flatten();
            let within = all.filter(|one| one.moving == moving && (from_m..to_m).contains(&one.distance_m));
            let errors: Vec<[f64; 2]> = within.filter_map(|one| one.error).collect();
            let of = |at: usize| median(errors.iter().map(|error| error[at]));
            Medians { frames: errors.len(), t_m: of(0), r_deg: of(1) }
        };
        let mut figures = Self {
            tracks: tracks.len(),
            association,
            tracks_late: tracks.iter().filter(|track| track.late_frames > 0).count(),
            late_near: Late::of(judged, 0.0..NEAR_M),
            late_far: Late::of(judged, NEAR_M..FAR_M),
            flips: tracks.iter().map(|track| track.flips).sum(),
            moving_near: medians(true, 0.0, NEAR_M),
            moving_far: medians(true, NEAR_M, FAR_M),
            standing_near: medians(false, 0.0, NEAR_M),
            false_dynamic_frames: tracks.iter().map(|track| track.confusion[0][2]).max().unwrap_or_default(),
            confusion: [[0; 3]; 2],
        };
        for (sum, counts) in tracks.iter().flat_map(|track| track.confusion.iter().enumerate()) {
            figures.confusion[sum].iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
        }
        (!tracks.is_empty()).then_some(figures)
    }
}
