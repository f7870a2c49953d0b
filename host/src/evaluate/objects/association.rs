//! Association of tracks with true objects: HOTA at one threshold of the boxes' overlap (Luiten et
//! al., *HOTA: A Higher Order Metric for Evaluating Multi-object Tracking*, IJCV 2021).
//!
//! In each frame tracks and true objects are paired one to one, best overlap first, at least
//! [`super::OVERLAP_MIN`]. `DetA = TP / (TP + FN + FP)`. A pair of a frame has the association
//! `TPA / (TPA + FNA + FPA)`: the frames its track and its object share against all in which either
//! was; `AssA` is the mean over all pairs, `HOTA = sqrt(DetA AssA)`. The original maximises the
//! pairing over the whole sequence and averages over thresholds; here the threshold is one, and the
//! boxes are those of masks. Objects too small for a detection do not count as missed, tracks in
//! unlabelled regions do not count as false.

use dynvox_core::masks::PixelBox;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Association of tracks with true objects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct AssociationFigures {
    /// Root of `deta * assa`.
    pub hota: f64,
    /// Share of matched pairs among all objects and tracks of all frames.
    pub deta: f64,
    /// Mean share of frames that track and object of a pair spend together.
    pub assa: f64,
    /// Pairs over all frames.
    pub matched: u64,
    /// Misses: objects without a track, over all frames.
    pub misses: u64,
    /// Tracks without an object, over all frames.
    pub false_tracks: u64,
    /// Number of times an object changed its track.
    pub id_switches: u64,
}

/// Counts pairs over frames.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Association {
    pairs: BTreeMap<(u32, u32), u64>,
    tracks: BTreeMap<u32, u64>,
    objects: BTreeMap<u32, u64>,
    /// The track an object was last paired with.
    last: BTreeMap<u32, u32>,
    misses: u64,
    false_tracks: u64,
    id_switches: u64,
}

/// An object in a frame: its number, its box, whether it counts as missed without a track.
pub type LabelledBox = (u32, PixelBox, bool);

impl Association {
    /// Takes in a frame: tracks by number and box, true objects, and unlabelled regions.
    pub fn add(
        &mut self,
        tracks: &[(u32, PixelBox)],
        objects: &[LabelledBox],
        unknown: &[PixelBox],
    ) {
        let candidates = tracks.iter().flat_map(|(track, a)| {
            objects.iter().map(move |(object, b, _)| (a.overlap(b), *track, *object))
        });
        let mut candidates: Vec<(f32, u32, u32)> =
            candidates.filter(|pair| pair.0 >= super::OVERLAP_MIN).collect();
        // Best first; of equals the older ones.
        candidates.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        // Greedy one-to-one association: each object has at most one track.
        let (mut paired_tracks, mut paired_objects) = (BTreeSet::new(), BTreeSet::new());
        for (_, track, object) in candidates {
            if paired_tracks.contains(&track) || paired_objects.contains(&object) {
                continue;
            }
            paired_tracks.insert(track);
            paired_objects.insert(object);
            *self.pairs.entry((track, object)).or_default() += 1;
            let before = self.last.insert(object, track);
            // A switch: the object's track is another one than when it was last seen.
            self.id_switches += u64::from(before.is_some_and(|before| before != track));
        }
        // A track on a region without labels may be right: it does not count.
        for (track, pixels) in tracks {
            let hidden = |region: &PixelBox| 2 * pixels.intersection(region).area() > pixels.area();
            if paired_tracks.contains(track) || !unknown.iter().any(hidden) {
                *self.tracks.entry(*track).or_default() += 1;
                self.false_tracks += u64::from(!paired_tracks.contains(track));
            }
        }
        for (object, _, expected) in objects {
            // An object too small to be expected does not count as missed.
            if *expected || paired_objects.contains(object) {
                *self.objects.entry(*object).or_default() += 1;
                self.misses += u64::from(!paired_objects.contains(object));
            }
        }
    }

    /// Sums up; `None` where there was neither track nor object.
    pub fn figures(&self) -> Option<AssociationFigures> {
        let matched: u64 = self.pairs.values().sum();
        let all = matched + self.misses + self.false_tracks;
        // HOTA's association accuracy: frames together over frames that either has.
        let associated = self.pairs.iter().map(|((track, object), &together)| {
            let of = |counts: &BTreeMap<u32, u64>, id| counts.get(id).copied().unwrap_or_default();
            let either = of(&self.tracks, track) + of(&self.objects, object) - together;
            together as f64 * together as f64 / either as f64
        });
        let assa = associated.sum::<f64>() / matched.max(1) as f64;
        let deta = matched as f64 / all.max(1) as f64;
        (all > 0).then(|| AssociationFigures {
            hota: (deta * assa).sqrt(),
            deta,
            assa,
            matched,
            misses: self.misses,
            false_tracks: self.false_tracks,
            id_switches: self.id_switches,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(left: i32) -> PixelBox {
        PixelBox { left, top: 0, width: 10, height: 10 }
    }

    #[test]
    fn an_object_that_changes_its_track_half_way_is_half_associated() {
        let mut perfect = Association::default();
        let mut switched = Association::default();
        for frame in 0..10u32 {
            perfect.add(&[(1, at(0))], &[(7, at(1), true)], &[]);
            switched.add(&[(1 + frame / 5, at(0))], &[(7, at(1), true)], &[]);
        }
        let figures = perfect.figures().unwrap();
        assert_eq!((figures.hota, figures.id_switches, figures.matched), (1.0, 0, 10));
        let figures = switched.figures().unwrap();
        // Each pair was together for 5 of the 10 frames in which its object was there.
        assert_eq!((figures.deta, figures.assa, figures.id_switches), (1.0, 0.5, 1));
        assert!((figures.hota - 0.5f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn misses_and_spurious_tracks_count_but_not_what_is_small_or_unknown() {
        let mut association = Association::default();
        // Two tracks on one object: one of them is of nothing. A small object may be missed; a
        // large one not.
        association.add(
            &[(1, at(0)), (2, at(2))],
            &[(7, at(0), true), (8, at(50), false), (9, at(80), true)],
            &[],
        );
        association.add(&[(3, at(100))], &[], &[at(97)]);
        association.add(&[], &[], &[at(97)]);
        let figures = association.figures().unwrap();
        assert_eq!((figures.matched, figures.misses, figures.false_tracks), (1, 1, 1));
        assert!((figures.deta - 1.0 / 3.0).abs() < 1e-12 && figures.assa == 1.0);
        assert!(Association::default().figures().is_none());
    }
}
