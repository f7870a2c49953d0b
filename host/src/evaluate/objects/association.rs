//! How well tracks stay with things: HOTA at one threshold of the boxes' overlap (Luiten et al., *HOTA: A Higher Order Metric for Evaluating
//! Multi-object Tracking*, IJCV 2021).
//!
//! In each frame tracks and true things are paired one to one, best overlap first, at least [`super::OVERLAP_MIN`]. `DetA = TP / (TP + FN + FP)`.
//! A pair of a frame has the association `TPA / (TPA + FNA + FPA)`: the frames its track and its thing share against all in which either was; `AssA` is the
//! mean over all pairs, `HOTA = sqrt(DetA AssA)`. The original maximises the pairing over the whole drive and averages over thresholds; here
//! the threshold is one, and the boxes are those of masks. Things too small to be a detection are not missed, tracks in regions of which the
//! labels say nothing are not spurious.

use dynvox_core::masks::PixelBox;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// How well tracks stay with things.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct AssociationFigures {
    /// Root of `deta * assa`.
    pub hota: f64,
    /// Share of all things and tracks in all frames that found each other.
    pub deta: f64,
    /// How much of their common life they spent together, over all pairs.
    pub assa: f64,
    /// Pairs over all frames.
    pub matched: u64,
    /// Things nobody tracked, over all frames.
    pub missed: u64,
    /// Tracks of nothing true, over all frames.
    pub spurious: u64,
    /// How often a thing changed its track.
    pub switches: u64,
}

/// Counts pairs over frames.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Association {
    pairs: BTreeMap<(u32, u32), u64>,
    tracks: BTreeMap<u32, u64>,
    things: BTreeMap<u32, u64>,
    /// The track a thing was last paired with.
    last: BTreeMap<u32, u32>,
    missed: u64,
    spurious: u64,
    switches: u64,
}

/// A thing in a frame: its number, its box, whether not tracking it is a miss.
pub type Thing = (u32, PixelBox, bool);

impl Association {
    /// Takes in a frame: tracks by number and box, things, and regions of which nothing is known.
    pub fn add(&mut self, tracks: &[(u32, PixelBox)], things: &[Thing], unknown: &[PixelBox]) {
        let candidates = tracks.iter().flat_map(|(track, a)| things.iter().map(move |(thing, b, _)| (a.overlap(b), *track, *thing)));
        let mut candidates: Vec<(f32, u32, u32)> = candidates.filter(|pair| pair.0 >= super::OVERLAP_MIN).collect();
        // Best first; of equals the older ones.
        candidates.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        let (mut paired_tracks, mut paired_things) = (BTreeSet::new(), BTreeSet::new());
        for (_, track, thing) in candidates {
            if paired_tracks.contains(&track) || paired_things.contains(&thing) {
                continue;
            }
            paired_tracks.insert(track);
            paired_things.insert(thing);
            *self.pairs.entry((track, thing)).or_default() += 1;
            let before = self.last.insert(thing, track);
            self.switches += u64::from(before.is_some_and(|before| before != track));
        }
        for (track, pixels) in tracks {
            let hidden = |region: &PixelBox| 2 * pixels.intersection(region).area() > pixels.area();
            if paired_tracks.contains(track) || !unknown.iter().any(hidden) {
                *self.tracks.entry(*track).or_default() += 1;
                self.spurious += u64::from(!paired_tracks.contains(track));
            }
        }
        for (thing, _, expected) in things {
            if *expected || paired_things.contains(thing) {
                *self.things.entry(*thing).or_default() += 1;
                self.missed += u64::from(!paired_things.contains(thing));
            }
        }
    }

    /// Sums up; `None` where there was neither track nor thing.
    pub fn figures(&self) -> Option<AssociationFigures> {
        let matched: u64 = self.pairs.values().sum();
        let all = matched + self.missed + self.spurious;
        let associated = self.pairs.iter().map(|((track, thing), &together)| {
            let of = |counts: &BTreeMap<u32, u64>, id| counts.get(id).copied().unwrap_or_default();
            let either = of(&self.tracks, track) + of(&self.things, thing) - together;
            together as f64 * together as f64 / either as f64
        });
        let assa = associated.sum::<f64>() / matched.max(1) as f64;
        let deta = matched as f64 / all.max(1) as f64;
        (all > 0).then(|| AssociationFigures {
            hota: (deta * assa).sqrt(),
            deta,
            assa,
            matched,
            missed: self.missed,
            spurious: self.spurious,
            switches: self.switches,
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
    fn a_thing_that_changes_its_track_half_way_is_half_associated() {
        let mut perfect = Association::default();
        let mut switched = Association::default();
        for frame in 0..10u32 {
            perfect.add(&[(1, at(0))], &[(7, at(1), true)], &[]);
            switched.add(&[(1 + frame / 5, at(0))], &[(7, at(1), true)], &[]);
        }
        let figures = perfect.figures().unwrap();
        assert_eq!((figures.hota, figures.switches, figures.matched), (1.0, 0, 10));
        let figures = switched.figures().unwrap();
        // Each pair was together for 5 of the 10 frames in which its thing was there.
        assert_eq!((figures.deta, figures.assa, figures.switches), (1.0, 0.5, 1));
        assert!((figures.hota - 0.5f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn misses_and_spurious_tracks_count_but_not_what_is_small_or_unknown() {
        let mut association = Association::default();
        // Two tracks on one thing: one of them is of nothing. A small thing may be missed; a large one not.
        association.add(&[(1, at(0)), (2, at(2))], &[(7, at(0), true), (8, at(50), false), (9, at(80), true)], &[]);
        association.add(&[(3, at(100))], &[], &[at(97)]);
        association.add(&[], &[], &[at(97)]);
        let figures = association.figures().unwrap();
        assert_eq!((figures.matched, figures.missed, figures.spurious), (1, 1, 1));
        assert!((figures.deta - 1.0 / 3.0).abs() < 1e-12 && figures.assa == 1.0);
        assert!(Association::default().figures().is_none());
    }
}
