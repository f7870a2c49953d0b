//! The strongest features of every part of an image.
//!
//! An image has as many features as it has texture, and the time of matching grows with their
//! square. Where cells have more than their share the weakest go, class by class: chosen over the
//! whole image the strongest stand in trees and on walls, and it is those on the road that tell
//! best how far the camera moved.
//!
//! Time: a look at each feature, and at those of its cell. Memory: 12 bytes for each that is kept,
//! and 4 bytes for each class of a cell.

use super::{
    cells::Shape,
    suppression::{CLASSES, Candidate},
};
use crate::memory::Capacity;
use bytemuck::{Pod, Zeroable};

/// Side of the smallest cells, px: two to the power of this.
const CELL_SHIFT: u32 = 5;
/// Side of the largest, as wide as the largest image.
const MAX_CELL_SHIFT: u32 = 13;
/// Features a cell may have of a class, at least: where there are fewer to give, cells are larger.
const QUOTA_MIN: usize = 4;

/// Lists of the largest image: one for each class of each cell.
pub(super) const fn lists(capacity: &Capacity) -> usize {
    CLASSES * Shape::new(capacity.image_width, capacity.image_height, 1 << CELL_SHIFT).cells()
}

/// No further feature of a list.
const END: u32 = u32::MAX;

/// A feature of a list.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct CandidateSlot {
    pub candidate: Candidate,
    /// Slot of the previous feature in the same list.
    before: u32,
}

/// The strongest so far.
pub(super) struct Strongest<'a> {
    slots: &'a mut [CandidateSlot],
    len: usize,
    /// Slot of each list's last feature.
    last: &'a mut [u32],
    /// Largest number of features in a list.
    quota: usize,
    columns: usize,
    shift: u32,
    dropped: usize,
}

impl<'a> Strongest<'a> {
    /// None yet, of an image of that size. At most `wanted` will be kept, and as many as there are
    /// slots; `last` has an entry for each of [`lists`].
    pub(super) fn new(
        slots: &'a mut [CandidateSlot],
        last: &'a mut [u32],
        [width, height]: [usize; 2],
        wanted: usize,
    ) -> Self {
        // Cells grow until each can keep the least quota of each class.
        let mut shift = CELL_SHIFT;
        let mut shape = Shape::new(width, height, 1 << shift);
        while shift < MAX_CELL_SHIFT && CLASSES * QUOTA_MIN * shape.cells() > wanted {
            shift += 1;
            shape = Shape::new(width, height, 1 << shift);
        }
        last.fill(END);
        let quota = wanted.checked_div(CLASSES * shape.cells()).unwrap_or_default();
        Self { slots, len: 0, last, quota, columns: shape.columns, shift, dropped: 0 }
    }

    /// Takes in the next one. It is kept while fewer of its class and cell than may be are as
    /// strong.
    #[inline(always)]
    pub(super) fn add(&mut self, candidate: Candidate) {
        let cell = usize::from(candidate.v >> self.shift) * self.columns
            + usize::from(candidate.u >> self.shift);
        let Some(last) = self.last.get_mut(cell * CLASSES + usize::from(candidate.class)) else {
            return;
        };
        // The slots of a cell and class form a list, newest first. Its weakest is remembered on the
        // way.
        let (mut at, mut weakest, mut least) = (*last, END, u16::MAX);
        for _ in 0..self.quota {
            let Some(held) = self.slots.get(at as usize) else {
                // The list has space.
                let Some(free) = self.slots.get_mut(self.len) else { return self.dropped += 1 };
                *free = CandidateSlot { candidate, before: *last };
                *last = self.len as u32;
                self.len += 1;
                return;
            };
            if held.candidate.response < least {
                (weakest, least) = (at, held.candidate.response);
            }
            at = held.before;
        }
        // The quota is used up: the weakest gives way, and of equals the earlier one stays.
        if let Some(held) = self.slots.get_mut(weakest as usize)
            && least < candidate.response
        {
            held.candidate = candidate;
        }
    }

    /// Returns the number of features that found no slot, and the features that were kept.
    pub(super) fn finish(self) -> (usize, &'a [CandidateSlot]) {
        let Self { slots, len, dropped, .. } = self;
        (dropped, slots.get(..len).unwrap_or_default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::{vec, vec::Vec};

    const SIZE: [usize; 2] = [150, 70];

    /// Returns the features that are kept, in order of position, and the number that found no slot.
    fn keep(found: &[Candidate], slots: usize, wanted: usize) -> (Vec<Candidate>, usize) {
        let (mut slots, mut last) = (vec![CandidateSlot::default(); slots], [7; CLASSES * 5 * 3]);
        let mut strongest = Strongest::new(&mut slots, &mut last, SIZE, wanted);
        found.iter().for_each(|candidate| strongest.add(*candidate));
        let (dropped, kept) = strongest.finish();
        (sorted(kept.iter().map(|held| held.candidate).collect()), dropped)
    }

    fn sorted(mut candidates: Vec<Candidate>) -> Vec<Candidate> {
        candidates.sort_by_key(|c| (c.v, c.u, c.class));
        candidates
    }

    /// One for each pixel and class, strong in the upper half.
    fn scatter(random: &mut Random, responses: u32) -> Vec<Candidate> {
        let pixels = (0..SIZE[1] as u16).flat_map(|v| (0..SIZE[0] as u16).map(move |u| (u, v)));
        pixels
            .map(|(u, v)| Candidate {
                u,
                v,
                response: random.below(responses) as u16 + if v < 35 { 900 } else { 0 },
                class: random.below(4) as u8,
                ..Candidate::default()
            })
            .collect()
    }

    #[test]
    fn every_cell_and_class_keeps_its_strongest() {
        let mut random = Random::new(7);
        for responses in [3, 800] {
            let found = scatter(&mut random, responses);
            // 5 x 3 cells of 32 px.
            let (kept, dropped) = keep(&found, 400, 300);
            assert_eq!((kept.len(), dropped), (300, 0));
            for key in 0..CLASSES as u16 * 15 {
                let of = |from: &[Candidate]| {
                    let own = from
                        .iter()
                        .filter(|c| (c.v / 32 * 5 + c.u / 32) * 4 + u16::from(c.class) == key);
                    let mut responses: Vec<u16> = own.map(|c| c.response).collect();
                    responses.sort_by_key(|response| core::cmp::Reverse(*response));
                    responses
                };
                assert_eq!(of(&kept), of(&found)[..5]);
            }
            assert!(kept.iter().all(|c| found.contains(c)));
        }
    }

    #[test]
    fn cells_grow_where_few_are_wanted_and_what_finds_no_slot_is_counted() {
        let found = scatter(&mut Random::new(8), 800);
        // Of 32 px they would have three for each class; of 64 px there are six cells, of 128 px
        // two.
        let kept_of = |wanted| keep(&found, 1_000, wanted).0.len();
        assert_eq!([240, 239, 96, 95, 32].map(kept_of), [240, 216, 96, 88, 32]);
        assert_eq!([31, 4, 3, 0].map(kept_of), [28, 4, 0, 0]);
        assert_eq!(keep(&found, found.len(), usize::MAX), (found.clone(), 0));
        let (first, dropped) = keep(&found, 70, usize::MAX);
        assert_eq!((&first[..], dropped), (&found[..70], found.len() - 70));
        assert_eq!(keep(&[], 100, 100), (Vec::new(), 0));
    }
}
