//! Which tracks were late with their state, and of how many one can wonder whether more could be known.

use super::{Judged, Showing};
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::Range;

/// Tracks at some distance whose state was due, and those that did not have the right one. A track that comes nearer may count at both distances.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Late {
    /// Tracks with a frame in which the state was due.
    pub tracks: usize,
    /// Of these, such with a frame in which it was not the true one.
    pub late: usize,
    /// Of the late, such that were so only while the picture's border cut the thing.
    pub late_cut: usize,
    /// Of the others, such that were so only while it was cut or [small](super::SMALL_PX).
    pub late_small: usize,
}

impl Late {
    /// Of the tracks at those distances, m.
    pub(super) fn of(judged: &BTreeMap<u32, Vec<Judged>>, distances_m: Range<f64>) -> Self {
        let mut sum = Self::default();
        for track in judged.values() {
            let due = || track.iter().filter(|one| one.is_due() && distances_m.contains(&one.distance_m));
            let late = || due().filter(|one| one.is_late());
            sum.tracks += usize::from(due().next().is_some());
            if late().next().is_some() {
                sum.late += 1;
                let cut = late().all(|one| one.view == Showing::Cut);
                sum.late_cut += usize::from(cut);
                sum.late_small += usize::from(!cut && late().all(|one| one.view != Showing::Whole));
            }
        }
        sum
    }
}
