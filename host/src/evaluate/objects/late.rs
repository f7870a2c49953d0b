//! Tracks whose motion state was not right in time, and how many of them only while the image
//! showed little of the object.

use super::{TrackComparison, Visibility};
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::Range;

/// Tracks at some distance that were seen long enough for a right motion state, and those that did
/// not have it. A track that comes nearer may count at both distances.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LateStates {
    /// Tracks with a frame in which the state should have been right.
    pub tracks: usize,
    /// Number of these tracks with a frame in which the state was still wrong.
    pub late: usize,
    /// Late ones that were late only while the image border cut the object.
    pub late_cut: usize,
    /// Other late ones that were late only while it was cut or [small](super::SMALL_PX).
    pub late_small: usize,
}

impl LateStates {
    /// Counts the tracks at those distances, m.
    pub(super) fn from_comparisons(
        comparisons: &BTreeMap<u32, Vec<TrackComparison>>,
        distances_m: Range<f64>,
    ) -> Self {
        let mut sum = Self::default();
        for track in comparisons.values() {
            // Only frames in which the state should be known by now.
            let due =
                || track.iter().filter(|one| one.is_due() && distances_m.contains(&one.distance_m));
            let late = || due().filter(|one| one.is_late());
            sum.tracks += usize::from(due().next().is_some());
            if late().next().is_some() {
                sum.late += 1;
                // Late tracks are split by what was in view: a cut or small object cannot be told
                // earlier.
                let cut = late().all(|one| one.view == Visibility::Cut);
                sum.late_cut += usize::from(cut);
                sum.late_small +=
                    usize::from(!cut && late().all(|one| one.view != Visibility::Whole));
            }
        }
        sum
    }
}
