//! The table of `hashbrown`: entries are slots of the block pool, keys stay in the pool.
//!
//! It is built once, in the slab, for twice the blocks it will ever hold, so that deletion debris
//! is cleaned in place and no second allocation is asked for; one that was would be refused and
//! reported as [`Full`].
//!
//! Memory: 5 bytes a bucket; buckets are the power of two at or above 16/7 of the blocks.

use super::{BlockKey, Full, Slot, hash};
use crate::memory::{Carver, OneShot, region_bytes};
use hashbrown::HashTable;

/// Space for the control group that hashbrown appends, and for aligning the control bytes.
const GROUP_BYTES: usize = 64;

/// An index in a table of hashbrown.
pub struct HashedIndex<'s> {
    table: HashTable<Slot, OneShot<'s>>,
}

impl core::fmt::Debug for HashedIndex<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("HashedIndex")
            .field("len", &self.table.len())
            .field("capacity", &self.table.capacity())
            .finish()
    }
}

impl<'s> HashedIndex<'s> {
    const fn buckets(blocks: usize) -> usize {
        let wanted = 2 * blocks;
        let buckets = if wanted < 8 { 8 } else { wanted * 8 / 7 };
        if buckets < 16 { 16 } else { buckets.next_power_of_two() }
    }

    /// Bytes of the slab for `blocks` blocks.
    pub const fn bytes(blocks: usize) -> usize {
        region_bytes::<u8>(Self::buckets(blocks) * 5 + GROUP_BYTES)
    }

    /// Cuts an index for `blocks` blocks.
    pub fn new_in(blocks: usize, carver: &mut Carver<'s>) -> Self {
        let region = carver.alloc::<u8>("volume.index", Self::buckets(blocks) * 5 + GROUP_BYTES);
        let mut table = HashTable::new_in(OneShot::new(region));
        // The one allocation: an empty table hashes nothing.
        carver.require_fit(table.try_reserve(2 * blocks, |_| 0).is_ok());
        Self { table }
    }

    /// Blocks indexed.
    pub fn len(&self) -> usize {
        self.table.len()
    }

    /// Returns true if no block is indexed.
    pub fn is_empty(&self) -> bool {
        self.table.is_empty()
    }

    /// The slot of the block of a key; `key_of` tells the key of the block in a slot.
    #[inline]
    pub fn find(&self, key: BlockKey, key_of: impl Fn(Slot) -> Option<BlockKey>) -> Option<Slot> {
        self.table.find(hash(key), |&slot| key_of(slot) == Some(key)).copied()
    }

    /// Finds a block like [`HashedIndex::find`], and counts the blocks whose keys were compared:
    /// 1 if nothing collides.
    #[inline]
    pub fn probe(
        &self,
        key: BlockKey,
        key_of: impl Fn(Slot) -> Option<BlockKey>,
    ) -> (Option<Slot>, u32) {
        // Equal hashes may belong to other blocks.
        let mut compared = 0;
        let same = |&slot: &Slot| {
            compared += 1;
            key_of(slot) == Some(key)
        };
        (self.table.find(hash(key), same).copied(), compared)
    }

    /// Enters `slot`, whose block must have that key by `key_of`, and which must not be in the
    /// index yet.
    pub fn insert(
        &mut self,
        key: BlockKey,
        slot: Slot,
        key_of: impl Fn(Slot) -> Option<BlockKey>,
    ) -> Result<(), Full> {
        let rehash = |&slot: &Slot| key_of(slot).map_or(0, hash);
        self.table.try_reserve(1, rehash).map_err(|_| Full)?;
        // Known from the line above to the table, but not to the compiler, which else keeps the way
        // to a panic.
        if self.table.capacity() == self.table.len() {
            return Err(Full);
        }
        self.table.insert_unique(hash(key), slot, rehash);
        Ok(())
    }

    /// Removes the block of a key. Whether it was there.
    pub fn remove(&mut self, key: BlockKey, key_of: impl Fn(Slot) -> Option<BlockKey>) -> bool {
        match self.table.find_entry(hash(key), |&slot| key_of(slot) == Some(key)) {
            Ok(entry) => {
                entry.remove();
                true
            }
            Err(_) => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    #[test]
    fn the_table_is_the_least_power_of_two_for_twice_the_blocks() {
        for blocks in (0..200).chain([700, 895, 896, 897, 5_000]) {
            // hashbrown fills a table up to 7/8.
            let buckets = (4..)
                .map(|shift| 1usize << shift)
                .find(|buckets| buckets * 7 / 8 >= 2 * blocks)
                .unwrap();
            assert_eq!(
                HashedIndex::bytes(blocks),
                (5 * buckets + 64).next_multiple_of(64),
                "{blocks} blocks"
            );
            let mut slab = vec![[0u64; 8]; HashedIndex::bytes(blocks) / 64 + 1];
            let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut slab);
            let mut carver = Carver::new(bytes, HashedIndex::bytes(blocks)).unwrap();
            let index = HashedIndex::new_in(blocks, &mut carver);
            assert_eq!(
                (carver.check(), carver.footprint().bytes()),
                (Ok(()), HashedIndex::bytes(blocks))
            );
            assert!(index.table.capacity() >= 2 * blocks && index.is_empty());
            let text = std::format!("{index:?}");
            assert_eq!(
                text,
                std::format!("HashedIndex {{ len: 0, capacity: {} }}", index.table.capacity())
            );
        }
    }
}
