//! Descriptors by parts of their bits: multi-index hashing (Norouzi, Punjani, Fleet, 2012) with
//! lists of bounded length.
//!
//! Eight substrings of 16 bits are looked up exactly. Descriptors of one point differ in some 30 of
//! 256 bits, so most share a substring; others share one by chance. Each list has eight entries; a
//! further one is refused, because what many points look like says nothing about the place.

use super::descriptor::Descriptor;
use crate::{
    memory::{Carver, region_bytes},
    state::Visitor,
};

/// Substrings of a descriptor that are looked up.
const SUBSTRINGS: usize = 8;
/// Entries of a list.
const LIST: usize = 8;
/// Mean number of entries in a list where every keyframe is full.
const LIST_MEAN: usize = 5;

/// Lists of descriptors, by substring. An entry is a descriptor's number and 1; 0 is none.
#[derive(Debug)]
pub(super) struct Index<'s> {
    lists: &'s mut [[u32; LIST]],
    /// Entries that found their list full.
    refused: u32,
}

/// Lists for a number of descriptors.
const fn list_count(descriptors: usize) -> usize {
    descriptors * SUBSTRINGS / LIST_MEAN
}

impl<'s> Index<'s> {
    pub(super) const fn bytes(descriptors: usize) -> usize {
        region_bytes::<[u32; LIST]>(list_count(descriptors))
    }

    pub(super) fn new_in(descriptors: usize, carver: &mut Carver<'s>) -> Self {
        Self { lists: carver.alloc("places.list", list_count(descriptors)), refused: 0 }
    }

    /// Position of the list of one substring.
    fn list(&mut self, number: usize, descriptor: &Descriptor) -> Option<&mut [u32; LIST]> {
        let key = (number as u64) << 16 | u64::from(descriptor.substring(number));
        // Mixed by multiplication; the upper half spreads over the lists without a division.
        let mixed = (key + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
        let at = (mixed * self.lists.len() as u64) >> 32;
        self.lists.get_mut(at as usize)
    }

    /// Enters a descriptor under its number.
    pub(super) fn insert(&mut self, descriptor: &Descriptor, number: u32) {
        for substring in 0..SUBSTRINGS {
            let Some(list) = self.list(substring, descriptor) else { continue };
            match list.iter_mut().find(|entry| **entry == 0) {
                Some(free) => *free = number + 1,
                None => self.refused = self.refused.saturating_add(1),
            }
        }
    }

    /// Removes what [`Index::insert`] entered.
    pub(super) fn remove(&mut self, descriptor: &Descriptor, number: u32) {
        for substring in 0..SUBSTRINGS {
            let Some(list) = self.list(substring, descriptor) else { continue };
            // Two substrings may share a list: each removal takes one entry.
            if let Some(entry) = list.iter_mut().find(|entry| **entry == number + 1) {
                *entry = 0;
            }
        }
    }

    /// Numbers of the descriptors that share a substring with this one, some of them repeatedly.
    pub(super) fn candidates(&mut self, descriptor: &Descriptor, mut each: impl FnMut(u32)) {
        for substring in 0..SUBSTRINGS {
            let list = self.list(substring, descriptor).copied().unwrap_or_default();
            list.into_iter().filter_map(|entry| entry.checked_sub(1)).for_each(&mut each);
        }
    }

    /// Forgets all entries.
    pub(super) fn clear(&mut self) {
        self.lists.as_flattened_mut().fill(0);
        self.refused = 0;
    }

    /// Visits the lists: which entries were refused depends on all that was ever entered.
    pub(super) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { lists, refused } = self;
        visitor.u32s(lists.iter_mut().flatten());
        visitor.u32(refused);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{memory::SLAB_ALIGN, random::Random};
    use std::{vec, vec::Vec};

    fn with_index<R>(descriptors: usize, test: impl FnOnce(&mut Index<'_>) -> R) -> R {
        let bytes = Index::bytes(descriptors);
        let mut slab = vec![0; bytes + SLAB_ALIGN];
        test(&mut Index::new_in(descriptors, &mut Carver::new(&mut slab, bytes).unwrap()))
    }

    fn random_descriptor(random: &mut Random) -> Descriptor {
        Descriptor(core::array::from_fn(|_| {
            u64::from(random.next_u32()) << 32 | u64::from(random.next_u32())
        }))
    }

    fn found(index: &mut Index<'_>, descriptor: &Descriptor, number: u32) -> usize {
        let mut count = 0;
        index.candidates(descriptor, |at| count += usize::from(at == number));
        count
    }

    #[test]
    fn most_descriptors_are_found_with_a_tenth_of_their_bits_wrong() {
        with_index(1_000, |index| {
            let mut random = Random::new(1);
            let all: Vec<_> = (0..1_000).map(|_| random_descriptor(&mut random)).collect();
            (0..).zip(&all).for_each(|(number, descriptor)| index.insert(descriptor, number));
            let noisy = |descriptor: &Descriptor, random: &mut Random| {
                let mut words = descriptor.0;
                (0..26).for_each(|_| {
                    let bit = random.below(256) as usize;
                    words[bit / 64] ^= 1 << (bit % 64);
                });
                Descriptor(words)
            };
            let hits = (0..).zip(&all).filter(|(number, descriptor)| {
                found(index, &noisy(descriptor, &mut random), *number) > 0
            });
            let hits = hits.count();
            assert!(hits > 700, "{hits} of 1000");
        });
    }

    #[test]
    fn a_removed_descriptor_leaves_no_entry() {
        with_index(100, |index| {
            let mut random = Random::new(2);
            let all: Vec<_> = (0..100).map(|_| random_descriptor(&mut random)).collect();
            (0..).zip(&all).for_each(|(number, descriptor)| index.insert(descriptor, number));
            (0..).zip(&all).for_each(|(number, descriptor)| index.remove(descriptor, number));
            assert!(index.lists.iter().flatten().all(|entry| *entry == 0));
        });
    }

    #[test]
    fn what_many_points_look_like_is_refused_and_counted() {
        with_index(100, |index| {
            let same = Descriptor([7; 4]);
            (0..100).for_each(|number| index.insert(&same, number));
            let mut count = 0;
            index.candidates(&same, |_| count += 1);
            assert!(count <= SUBSTRINGS * LIST && index.refused >= 8 * (100 - 8), "{count}");
        });
    }
}
