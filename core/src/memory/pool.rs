//! A pool of numbered slots with a free list and a generation per slot.
//!
//! The pool hands out positions, not memory: whoever owns the payload keeps it in arrays of the same length. A [`Handle`] remembers
//! the generation it was born in, so a slot that was freed and given out again is not mistaken for the old one.
//!
//! Memory: 8 bytes per slot (a generation, a free-list entry). Time: constant. Order: a new pool gives out 0, 1, 2, …; a freed slot is
//! the next one given out.

use super::{Carver, region_bytes};
use crate::snapshot::Archive;

/// Every slot is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Full;

/// A slot as it was when it was given out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Handle {
    /// Position of the slot in the pool.
    pub slot: u32,
    /// How often the slot had been freed when this handle was made.
    pub generation: u32,
}

/// The pool. Even generations are free, odd ones taken.
#[derive(Debug)]
pub struct SlotPool<'s> {
    generation: &'s mut [u32],
    freed: &'s mut [u32],
    freed_len: usize,
    fresh: usize,
    peak: usize,
}

impl<'s> SlotPool<'s> {
    /// Bytes of the slab for `slots` slots.
    pub const fn bytes(slots: usize) -> usize {
        2 * region_bytes::<u32>(slots)
    }

    /// Cuts a pool of `slots` slots. `names` are those of its two regions: generations, free list.
    pub fn new_in(carver: &mut Carver<'s>, slots: usize, names: [&'static str; 2]) -> Self {
        let [generations, free_list] = names;
        Self {
            generation: carver.alloc(generations, slots),
            freed: carver.alloc(free_list, slots),
            freed_len: 0,
            fresh: 0,
            peak: 0,
        }
    }

    /// Slots in all.
    pub fn capacity(&self) -> usize {
        self.generation.len()
    }

    /// Slots taken.
    pub fn len(&self) -> usize {
        self.fresh - self.freed_len
    }

    /// Whether no slot is taken.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether every slot is taken.
    pub fn is_full(&self) -> bool {
        self.len() == self.capacity()
    }

    /// The most slots ever taken at once.
    pub fn peak(&self) -> usize {
        self.peak
    }

    /// One past the highest position ever given out: what a walk over all slots has to visit.
    pub fn high_water(&self) -> usize {
        self.fresh
    }

    /// Takes a slot.
    pub fn take(&mut self) -> Result<Handle, Full> {
        let slot = if let Some(last) = self.freed_len.checked_sub(1) {
            let slot = *self.freed.get(last).ok_or(Full)?;
            self.freed_len = last;
            slot as usize
        } else {
            self.fresh
        };
        let generation = self.generation.get_mut(slot).ok_or(Full)?;
        *generation = generation.wrapping_add(1);
        let handle = Handle { slot: slot as u32, generation: *generation };
        if slot == self.fresh {
            self.fresh += 1;
        }
        if self.len() > self.peak {
            self.peak = self.len();
        }
        Ok(handle)
    }

    /// Gives a slot back. Returns `false`, and does nothing, when the handle is stale.
    pub fn free(&mut self, handle: Handle) -> bool {
        if !self.is_live(handle) {
            return false;
        }
        if let (Some(generation), Some(entry)) = (self.generation.get_mut(handle.slot as usize), self.freed.get_mut(self.freed_len)) {
            *generation = generation.wrapping_add(1);
            *entry = handle.slot;
            self.freed_len += 1;
            return true;
        }
        false
    }

    /// Writes or reads the pool: which slots are taken, how often each was, and in which order the freed ones will be given out.
    pub(crate) fn archive(&mut self, archive: &mut impl Archive) {
        let capacity = self.capacity();
        archive.count(&mut self.fresh, capacity);
        archive.count(&mut self.freed_len, self.fresh);
        archive.count(&mut self.peak, capacity);
        archive.u32s(self.generation.get_mut(..self.fresh).unwrap_or(&mut []));
        archive.u32s(self.freed.get_mut(..self.freed_len).unwrap_or(&mut []));
    }

    /// Whether the slot is still the one the handle was made for.
    pub fn is_live(&self, handle: Handle) -> bool {
        handle.generation % 2 == 1 && self.generation.get(handle.slot as usize) == Some(&handle.generation)
    }

    /// The handle of a slot that is taken now.
    pub fn handle(&self, slot: u32) -> Option<Handle> {
        let generation = *self.generation.get(slot as usize)?;
        (generation % 2 == 1).then_some(Handle { slot, generation })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::Slab;

    #[test]
    fn gives_each_slot_once_then_says_full() {
        let mut slab = std::boxed::Box::new(Slab([0u8; SlotPool::bytes(17)]));
        let mut carver = Carver::new(&mut slab.0, SlotPool::bytes(17)).unwrap();
        let mut pool = SlotPool::new_in(&mut carver, 17, ["generation", "freed"]);
        let handles: std::vec::Vec<_> = (0..17).map(|_| pool.take().unwrap()).collect();
        assert!(handles.iter().enumerate().all(|(i, h)| h.slot == i as u32));
        assert_eq!(pool.take(), Err(Full));
        assert!(pool.free(handles[3]));
        assert!(!pool.free(handles[3]), "a slot is freed once");
        let again = pool.take().unwrap();
        assert_eq!(again.slot, 3);
        assert!(!pool.is_live(handles[3]) && pool.is_live(again), "the old handle is stale, the new one is not");
        assert_eq!((pool.len(), pool.peak(), pool.high_water()), (17, 17, 17));
    }
}
