//! A plain table: linear probes, and deletion by shifting back.
//!
//! It needs no allocator, and never cleans itself: what is removed leaves no debris.
//!
//! An entry is a word: in its low bits a slot and one more, 0 for none; above them the top of its
//! block's hash, so that most blocks that are not the one sought are passed without a look at their
//! keys.
//!
//! Memory: 4 bytes an entry; entries are the power of two at or above twice the blocks. Time: a
//! lookup visits two entries on average where half are taken, and never more than there are.

use super::{BlockKey, Full, Slot, hash};
use crate::memory::{Carver, region_bytes};

/// An index in a plain table.
pub struct PlainIndex<'s> {
    entries: &'s mut [u32],
    len: usize,
}

impl core::fmt::Debug for PlainIndex<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("PlainIndex")
            .field("len", &self.len)
            .field("capacity", &(self.entries.len() / 2))
            .finish()
    }
}

impl<'s> PlainIndex<'s> {
    const fn entries(blocks: usize) -> usize {
        if blocks < 8 { 16 } else { (2 * blocks).next_power_of_two() }
    }

    /// Bytes of the slab for `blocks` blocks.
    pub const fn bytes(blocks: usize) -> usize {
        region_bytes::<u32>(Self::entries(blocks))
    }

    /// Cuts an index for `blocks` blocks.
    pub fn new_in(blocks: usize, carver: &mut Carver<'s>) -> Self {
        Self { entries: carver.alloc("volume.index", Self::entries(blocks)), len: 0 }
    }

    /// Blocks indexed.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns true if no block is indexed.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The slot of the block of a key; `key_of` tells the key of the block in a slot.
    #[inline]
    pub fn find(&self, key: BlockKey, key_of: impl Fn(Slot) -> Option<BlockKey>) -> Option<Slot> {
        self.probe(key, key_of).0
    }

    /// Finds a block like [`PlainIndex::find`], and counts the blocks whose keys were compared:
    /// 1 if nothing collides.
    #[inline]
    pub fn probe(
        &self,
        key: BlockKey,
        key_of: impl Fn(Slot) -> Option<BlockKey>,
    ) -> (Option<Slot>, u32) {
        let (at, compared) = self.seek(key, key_of);
        (at.and_then(|at| self.slot(at)), compared)
    }

    /// Enters `slot`, whose block must have that key by `key_of`, and which must not be in the
    /// index yet.
    pub fn insert(
        &mut self,
        key: BlockKey,
        slot: Slot,
        _key_of: impl Fn(Slot) -> Option<BlockKey>,
    ) -> Result<(), Full> {
        // A full table, or a slot that no word of this table holds.
        if 2 * self.len >= self.entries.len() || slot.index() >= self.mask() {
            return Err(Full);
        }
        let hash = hash(key);
        let free = self.places(hash).find(|&at| self.slot(at).is_none()).ok_or(Full)?;
        self.set(free, self.tag((hash >> 32) as u32) | (slot.get() + 1));
        self.len += 1;
        Ok(())
    }

    /// Removes the block of a key. Whether it was there.
    pub fn remove(&mut self, key: BlockKey, key_of: impl Fn(Slot) -> Option<BlockKey>) -> bool {
        let (Some(mut hole), _) = self.seek(key, &key_of) else { return false };
        for at in self.places(hole as u64 + 1) {
            let Some(slot) = self.slot(at) else { break };
            // It fills the hole, which then is where it was, unless its home lies behind the hole.
            let home = key_of(slot).map_or(0, hash) as usize;
            if self.steps(home, at) >= self.steps(hole, at) {
                self.set(hole, self.entry(at));
                hole = at;
            }
        }
        self.set(hole, 0);
        self.len -= 1;
        true
    }

    /// Place of the block of a key, and how many blocks were compared.
    #[inline]
    fn seek(
        &self,
        key: BlockKey,
        key_of: impl Fn(Slot) -> Option<BlockKey>,
    ) -> (Option<usize>, u32) {
        let hash = hash(key);
        let mut compared = 0;
        for at in self.places(hash) {
            let Some(slot) = self.slot(at) else { break };
            if self.tag(self.entry(at)) == self.tag((hash >> 32) as u32) {
                compared += 1;
                if key_of(slot) == Some(key) {
                    return (Some(at), compared);
                }
            }
        }
        (None, compared)
    }

    /// All places from a hash's home on, each once.
    #[inline]
    fn places(&self, hash: u64) -> impl Iterator<Item = usize> + use<> {
        let (home, mask) = (hash as usize, self.mask());
        (0..self.entries.len()).map(move |step| home.wrapping_add(step) & mask)
    }

    /// Steps from one place ahead to another.
    fn steps(&self, from: usize, to: usize) -> usize {
        to.wrapping_sub(from) & self.mask()
    }

    #[inline]
    fn mask(&self) -> usize {
        self.entries.len().wrapping_sub(1)
    }

    #[inline]
    fn entry(&self, at: usize) -> u32 {
        self.entries.get(at).copied().unwrap_or(0)
    }

    fn set(&mut self, at: usize, entry: u32) {
        if let Some(old) = self.entries.get_mut(at) {
            *old = entry;
        }
    }

    /// The slot entered at a place.
    #[inline]
    fn slot(&self, at: usize) -> Option<Slot> {
        (self.entry(at) & self.mask() as u32).checked_sub(1).map(Slot::new)
    }

    /// The bits of a word that an entry has of its block's hash.
    #[inline]
    fn tag(&self, word: u32) -> u32 {
        word & !(self.mask() as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::super::BlockCoord, *};
    use std::vec;

    #[test]
    fn the_table_is_filled_to_half_at_most_and_then_full() {
        for blocks in (0..200usize).chain([700, 1_023, 1_024, 1_025]) {
            let entries = (2 * blocks).next_power_of_two().max(16);
            assert_eq!(PlainIndex::bytes(blocks), (4 * entries).next_multiple_of(64));
            let mut slab = vec![[0u64; 8]; PlainIndex::bytes(blocks) / 64 + 1];
            let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut slab);
            let mut carver = Carver::new(bytes, PlainIndex::bytes(blocks)).unwrap();
            let mut index = PlainIndex::new_in(blocks, &mut carver);
            assert_eq!(
                (carver.check(), carver.footprint().bytes()),
                (Ok(()), PlainIndex::bytes(blocks))
            );
            let key = |at: u32| BlockKey::in_first(BlockCoord::new(at as i32, 0, 0).unwrap());
            let key_of = |slot: Slot| Some(key(slot.get()));
            for at in 0..entries as u32 / 2 {
                assert_eq!(index.insert(key(at), Slot::new(at), key_of), Ok(()), "{blocks}");
            }
            assert_eq!(index.insert(key(9_999), Slot::new(0), key_of), Err(Full));
            assert_eq!(index.len(), entries / 2);
            for at in 0..entries as u32 / 2 {
                assert_eq!(index.find(key(at), key_of), Some(Slot::new(at)));
            }
        }
    }

    #[test]
    fn a_slot_that_no_entry_holds_is_refused() {
        let mut slab = vec![[0u64; 8]; PlainIndex::bytes(8) / 64 + 1];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut slab);
        let mut carver = Carver::new(bytes, PlainIndex::bytes(8)).unwrap();
        let mut index = PlainIndex::new_in(8, &mut carver);
        let key = BlockKey::default();
        assert_eq!(index.insert(key, Slot::new(15), |_| Some(key)), Err(Full));
        assert_eq!(index.insert(key, Slot::new(14), |_| Some(key)), Ok(()));
        assert_eq!(index.find(key, |_| Some(key)), Some(Slot::new(14)));
    }
}
