//! Which block was seen last when: a doubly linked list through the slots, so that the one unseen
//! for longest is at hand in constant time.
//!
//! Memory: 8 bytes a block.

use super::{Slot, SlotPool};
use crate::state::Visitor;
use crate::{
    memory::{Carver, region_bytes},
    slices::clipped_mut,
};

/// The list. Links are slot + 1; 0 is none.
#[derive(Debug)]
pub(crate) struct LruList<'s> {
    /// Towards blocks unseen for longer, and towards those seen later.
    links: &'s mut [[u32; 2]],
    /// Slot + 1 of the block unseen for longest and of the one seen last.
    ends: [u32; 2],
}

/// Returns the list's value for a slot.
fn link(slot: Slot) -> u32 {
    slot.get() + 1
}

const OLDER: usize = 0;
const NEWER: usize = 1;

impl<'s> LruList<'s> {
    /// Bytes of the slab.
    pub(crate) const fn bytes(blocks: usize) -> usize {
        region_bytes::<[u32; 2]>(blocks)
    }

    /// Cuts an empty list for `blocks` slots.
    pub(crate) fn new_in(blocks: usize, carver: &mut Carver<'s>) -> Self {
        Self { links: carver.alloc("volume.lru_list", blocks), ends: [0; 2] }
    }

    /// The slot unseen for longest.
    pub(crate) fn oldest(&self) -> Option<Slot> {
        self.ends[OLDER].checked_sub(1).map(Slot::new)
    }

    /// Makes `slot` the one seen last; it need not be in the list yet.
    pub(super) fn touch(&mut self, slot: Slot) {
        // The usual case: a block that is seen again and again.
        if self.ends[NEWER] == link(slot) {
            return;
        }
        // From where it stands to the newer end.
        self.remove(slot);
        let last = self.ends[NEWER];
        self.link(link(slot), [last, 0]);
        self.set(last, NEWER, link(slot));
        self.ends[NEWER] = link(slot);
    }

    /// Takes `slot` out of the list; nothing happens when it is not in it.
    pub(super) fn remove(&mut self, slot: Slot) {
        let Some(&[older, newer]) = self.links.get(slot.index()) else { return };
        // The only entry has no neighbours either.
        let alone = self.ends == [link(slot); 2];
        if [older, newer] == [0; 2] && !alone {
            return;
        }
        self.set(older, NEWER, newer);
        self.set(newer, OLDER, older);
        self.link(link(slot), [0; 2]);
    }

    /// Returns true if the list leads once through the slots in use, and no other has neighbours.
    pub(super) fn is_whole(&self, pool: &SlotPool<'_>) -> bool {
        let (mut before, mut entry) = (0, self.ends[OLDER]);
        for _ in 0..pool.len() {
            let slot = entry.checked_sub(1).map(Slot::new).filter(|&slot| pool.is_live(slot));
            let links = slot.and_then(|slot| self.links.get(slot.index()));
            match links {
                // Each names the one before: none is met twice.
                Some(&[older, newer]) if older == before => (before, entry) = (entry, newer),
                _ => return false,
            }
        }
        let given_out = (0..).zip(self.links.iter().take(pool.high_water()));
        let mut others = given_out.filter(|(slot, _)| !pool.is_live(Slot::new(*slot)));
        entry == 0 && before == self.ends[NEWER] && others.all(|(_, links)| *links == [0; 2])
    }

    /// Visits every field, in a pool that gave out `slots` slots at most.
    pub(super) fn visit(&mut self, slots: usize, visitor: &mut impl Visitor) {
        let Self { links, ends } = self;
        visitor.u32s(ends);
        visitor.u32s(clipped_mut(links, ..slots).as_flattened_mut());
    }

    fn link(&mut self, entry: u32, links: [u32; 2]) {
        if let Some(entry_links) =
            entry.checked_sub(1).and_then(|slot| self.links.get_mut(slot as usize))
        {
            *entry_links = links;
        }
    }

    /// Sets the link of `entry` on one side; beyond the list lie its ends.
    fn set(&mut self, entry: u32, side: usize, to: u32) {
        let neighbour = match entry.checked_sub(1) {
            Some(slot) => self.links.get_mut(slot as usize).and_then(|links| links.get_mut(side)),
            // What follows the missing newer neighbour of the oldest is the oldest end, and the
            // other way round.
            None => self.ends.get_mut(1 - side),
        };
        if let Some(neighbour) = neighbour {
            *neighbour = to;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{memory::Slab, random::Random};
    use std::{boxed::Box, vec::Vec};

    #[test]
    fn keeps_the_order_of_last_touch_through_a_hundred_thousand_operations() {
        const SLOTS: u32 = 40;
        let mut slab = Box::new(Slab([0u8; LruList::bytes(SLOTS as usize)]));
        let len = slab.0.len();
        let mut lru = LruList::new_in(SLOTS as usize, &mut Carver::new(&mut slab.0, len).unwrap());
        let (mut model, mut random) = (Vec::<Slot>::new(), Random::new(1));
        for _ in 0..100_000 {
            let slot = Slot::new(random.below(SLOTS));
            model.retain(|&other| other != slot);
            if random.below(3) == 0 {
                lru.remove(slot);
            } else {
                lru.touch(slot);
                model.push(slot);
            }
            assert_eq!(lru.oldest(), model.first().copied());
            let mut walked = Vec::new();
            let mut at = lru.ends[OLDER];
            while let Some(slot) = at.checked_sub(1) {
                walked.push(Slot::new(slot));
                at = lru.links[slot as usize][NEWER];
            }
            assert_eq!(walked, model);
        }
    }
}
