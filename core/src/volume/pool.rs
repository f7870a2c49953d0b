//! A pool of numbered slots with a free list.
//!
//! The pool hands out positions, not memory: the owner of the payload keeps it in arrays of the
//! same length.
//!
//! Memory: 4 bytes and 1 bit per slot (a free-list entry, whether the slot is taken). Time:
//! constant; a walk over the slots taken visits 64 of them a step where none is. Order: a new pool
//! gives out 0, 1, 2, …; a freed slot is the next one given out.

use crate::{
    bits::set_bits,
    memory::{Carver, region_bytes},
    slices::clipped_mut,
    state::Visitor,
};
use bytemuck::{Pod, Zeroable};
use core::fmt;

/// Every slot is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Full;

impl fmt::Display for Full {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("every slot is taken")
    }
}

impl core::error::Error for Full {}

/// A position in a pool, and in the arrays that hold what belongs to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Pod, Zeroable)]
#[repr(transparent)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Slot(u32);

impl Slot {
    /// The slot at a position.
    pub const fn new(position: u32) -> Self {
        Self(position)
    }

    /// The position.
    pub const fn get(self) -> u32 {
        self.0
    }

    /// The position, to index arrays with.
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// The pool.
#[derive(Debug)]
pub struct SlotPool<'s> {
    /// A bit per slot: whether it is taken.
    live: &'s mut [u64],
    freed: &'s mut [Slot],
    freed_len: usize,
    fresh: usize,
    peak: usize,
}

impl<'s> SlotPool<'s> {
    /// Bytes of the slab for `slots` slots.
    pub(crate) const fn bytes(slots: usize) -> usize {
        region_bytes::<u64>(slots.div_ceil(64)) + region_bytes::<Slot>(slots)
    }

    /// Cuts a pool of `slots` slots. `names` are those of its two regions: taken slots, free list.
    pub(crate) fn new_in(carver: &mut Carver<'s>, slots: usize, names: [&'static str; 2]) -> Self {
        let [live, free_list] = names;
        Self {
            // A bit for each slot.
            live: carver.alloc(live, slots.div_ceil(64)),
            freed: carver.alloc(free_list, slots),
            freed_len: 0,
            fresh: 0,
            peak: 0,
        }
    }

    /// Slots in all.
    pub(crate) fn capacity(&self) -> usize {
        self.freed.len()
    }

    /// Slots taken.
    pub fn len(&self) -> usize {
        self.fresh - self.freed_len
    }

    /// Returns true if no slot is taken.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns true if every slot is taken.
    pub(crate) fn is_full(&self) -> bool {
        self.len() == self.capacity()
    }

    /// The most slots ever taken at once.
    pub fn peak(&self) -> usize {
        self.peak
    }

    /// One past the highest position ever given out.
    pub fn high_water(&self) -> usize {
        self.fresh
    }

    /// Takes a slot.
    pub(crate) fn take(&mut self) -> Result<Slot, Full> {
        // The slot freed last first, and fresh ones only when none is left.
        let slot = if let Some(last) = self.freed_len.checked_sub(1) {
            let slot = *self.freed.get(last).ok_or(Full)?;
            self.freed_len = last;
            slot
        } else if self.fresh < self.capacity() {
            self.fresh += 1;
            Slot(self.fresh as u32 - 1)
        } else {
            return Err(Full);
        };
        debug_assert!(!self.is_live(slot), "a slot given out is free");
        self.set_live(slot, true);
        if self.len() > self.peak {
            self.peak = self.len();
        }
        Ok(slot)
    }

    /// Gives a slot back, which must be taken.
    pub(crate) fn free(&mut self, slot: Slot) {
        debug_assert!(self.is_live(slot), "a slot is freed once");
        // A slot that is freed twice would be given out twice.
        if self.is_live(slot)
            && let Some(entry) = self.freed.get_mut(self.freed_len)
        {
            *entry = slot;
            self.freed_len += 1;
            self.set_live(slot, false);
        }
    }

    /// Returns true if a slot is taken.
    pub(crate) fn is_live(&self, slot: Slot) -> bool {
        self.live.get(slot.index() / 64).is_some_and(|word| word >> (slot.0 % 64) & 1 == 1)
    }

    /// The slots taken, ascending.
    pub fn live(&self) -> impl Iterator<Item = Slot> + Clone + '_ {
        let words = self.live.iter().take(self.fresh.div_ceil(64));
        (0u32..).zip(words).flat_map(|(i, &word)| set_bits(word).map(move |bit| Slot(64 * i + bit)))
    }

    /// The first slot at or after position `from` that is taken: a walk that may free slots on its
    /// way.
    pub(crate) fn next_live(&self, from: u32) -> Option<Slot> {
        let first = from / 64;
        let words = (first..).zip(self.live.iter().skip(first as usize));
        words
            .map(|(i, &word)| (i, if i == first { word & u64::MAX << (from % 64) } else { word }))
            .find_map(|(i, word)| {
                let bit = set_bits(word).next()?;
                Some(Slot(64 * i + bit))
            })
    }

    fn set_live(&mut self, slot: Slot, live: bool) {
        if let Some(word) = self.live.get_mut(slot.index() / 64) {
            let bit = 1 << (slot.0 % 64);
            *word = if live { *word | bit } else { *word & !bit };
        }
    }

    /// Visits every field: how many slots were given out, and in which order the freed ones will be
    /// given out again.
    /// [`SlotPool::rebuild`] must follow a reading.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { live: _, freed, freed_len, fresh, peak } = self;
        visitor.count(fresh, freed.len());
        visitor.count(freed_len, *fresh);
        visitor.count(peak, freed.len());
        visitor.u32s(bytemuck::cast_slice_mut::<_, u32>(clipped_mut(freed, ..*freed_len)));
    }

    /// Finds which slots are taken: those given out and not in the free list. Whether that list can
    /// be: each slot in it given out, and once.
    pub(crate) fn rebuild(&mut self) -> bool {
        self.live.fill(0);
        (0..self.fresh as u32).for_each(|position| self.set_live(Slot(position), true));
        for at in 0..self.freed_len {
            let Some(slot) = self.freed.get(at).copied().filter(|&slot| self.is_live(slot)) else {
                return false;
            };
            self.set_live(slot, false);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{memory::SLAB_ALIGN, random::Random};
    use std::{boxed::Box, collections::BTreeSet, vec, vec::Vec};

    fn pool(slots: usize) -> SlotPool<'static> {
        let bytes = SlotPool::bytes(slots);
        let memory = Box::leak(vec![0u8; bytes + SLAB_ALIGN].into_boxed_slice());
        let start = memory.as_ptr().align_offset(SLAB_ALIGN);
        SlotPool::new_in(
            &mut Carver::new(&mut memory[start..], bytes).unwrap(),
            slots,
            ["live", "freed"],
        )
    }

    #[test]
    fn gives_each_slot_once_then_says_full() {
        let mut pool = pool(17);
        let slots: Vec<_> = (0..17).map(|_| pool.take().unwrap()).collect();
        assert!(slots.iter().enumerate().all(|(i, slot)| slot.index() == i));
        assert_eq!(pool.take(), Err(Full));
        pool.free(slots[3]);
        assert!(!pool.is_live(slots[3]));
        assert_eq!(pool.take(), Ok(slots[3]), "freed last, given out next");
        assert_eq!((pool.len(), pool.peak(), pool.high_water()), (17, 17, 17));
    }

    #[test]
    #[should_panic(expected = "a slot is freed once")]
    fn a_slot_freed_twice_is_a_fault_of_the_software() {
        let mut pool = pool(3);
        let slot = pool.take().unwrap();
        pool.free(slot);
        pool.free(slot);
    }

    #[test]
    fn walks_over_taken_slots_in_order_and_reuses_freed_ones() {
        let (mut pool, mut model, mut random) = (pool(200), BTreeSet::new(), Random::new(4));
        for round in 0..5_000 {
            if random.below(5) < 2 && !model.is_empty() {
                let slot = *model.iter().nth(random.below(model.len() as u32) as usize).unwrap();
                model.remove(&slot);
                pool.free(slot);
            } else if let Ok(slot) = pool.take() {
                assert!(model.insert(slot));
            }
            if round % 50 == 0 {
                assert!(pool.live().eq(model.iter().copied()));
                let from = random.below(210);
                assert_eq!(pool.next_live(from), model.range(Slot::new(from)..).next().copied());
                assert!(pool.rebuild() && pool.live().eq(model.iter().copied()));
            }
        }
    }

    #[test]
    fn refuses_a_free_list_that_cannot_be() {
        for wrong in [Slot::new(1), Slot::new(2)] {
            let mut pool = pool(3);
            let slots = [pool.take().unwrap(), pool.take().unwrap()];
            slots.into_iter().for_each(|slot| pool.free(slot));
            pool.freed[0] = wrong;
            assert!(!pool.rebuild(), "freed twice, or never given out");
        }
    }
}
