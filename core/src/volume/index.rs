//! From a block's segment and coordinates to its slot: a hash table whose entries are integers.
//!
//! The table is `hashbrown::HashTable<Slot>`: entries are slots of the block pool, keys stay in the
//! pool. It is built once, in the slab, for twice the blocks it will ever hold, so that deletion
//! debris is cleaned in place and no second allocation is asked for; one that was would be refused
//! and reported as [`Full`]. Nothing iterates the table, so its order is never observable.
//!
//! Memory: 5 bytes a bucket; buckets are the power of two at or above 16/7 of the blocks.

use super::{BlockKey, Full, Slot};
use crate::memory::{Carver, OneShot, region_bytes};
use hashbrown::HashTable;

/// Space for the control group that hashbrown appends, and for aligning the control bytes.
const GROUP_BYTES: usize = 64;

/// The index.
pub struct BlockIndex<'s> {
    table: HashTable<Slot, OneShot<'s>>,
}

impl core::fmt::Debug for BlockIndex<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("BlockIndex")
            .field("len", &self.table.len())
            .field("capacity", &self.table.capacity())
            .finish()
    }
}

/// A block's key mixed by constants (the multipliers of Teschner et al., 2003, then a 64-bit
/// finaliser: hashbrown looks at both ends).
pub(super) fn hash(BlockKey { segment, coord }: BlockKey) -> u64 {
    let [x, y, z] = [coord.x, coord.y, coord.z].map(|c| i64::from(c) as u64);
    let mixed =
        x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_669) ^ z.wrapping_mul(83_492_791);
    // The first segment's hash is that of its coordinates.
    let mixed = mixed ^ u64::from(segment.get()).wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
    let mixed = (mixed ^ (mixed >> 32)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    mixed ^ (mixed >> 29)
}

impl<'s> BlockIndex<'s> {
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

    /// Finds a block like [`BlockIndex::find`], and counts the blocks whose keys were compared:
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
    use super::super::BlockCoord;
    use super::*;
    use crate::geometry::MapSegment;
    use crate::random::Random;
    use std::{collections::BTreeMap, vec, vec::Vec};

    const BLOCKS: usize = 700;

    #[test]
    fn agrees_with_a_tree_in_one_allocation_over_200_000_changes() {
        let mut slab = vec![[0u8; 64]; BlockIndex::bytes(BLOCKS) / 64 + 1];
        let start = (64 - slab.as_ptr() as usize % 64) % 64;
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut slab);
        let mut carver = Carver::new(&mut bytes[start..], BlockIndex::bytes(BLOCKS)).unwrap();
        let mut index = BlockIndex::new_in(BLOCKS, &mut carver);
        let mut coords = [BlockKey::default(); BLOCKS];
        let mut free: Vec<Slot> = (0..BLOCKS as u32).map(Slot::new).collect();
        let mut model = BTreeMap::new();
        let mut random = Random::new(5);
        for _ in 0..200_000 {
            let [x, y, z] = [(); 3].map(|()| random.below(10) as i32 - 5);
            let segment = MapSegment::new(random.below(3) as u16);
            let coord = BlockKey { segment, coord: BlockCoord::new(x, y, z).unwrap() };
            if let Some(slot) = model.remove(&coord) {
                assert_eq!(index.find(coord, |slot| Some(coords[slot.index()])), Some(slot));
                assert!(index.remove(coord, |slot| Some(coords[slot.index()])));
                free.push(slot);
            } else if let Some(slot) = free.pop() {
                coords[slot.index()] = coord;
                index.insert(coord, slot, |slot| Some(coords[slot.index()])).unwrap();
                model.insert(coord, slot);
            }
            let (found, compared) = index.probe(coord, |slot| Some(coords[slot.index()]));
            assert_eq!(found, model.get(&coord).copied());
            assert!(
                compared >= u32::from(found.is_some()) && compared < 64,
                "{compared} blocks compared"
            );
            assert_eq!(index.len(), model.len());
        }
        for (&coord, &slot) in &model {
            assert_eq!(index.find(coord, |slot| Some(coords[slot.index()])), Some(slot));
        }
    }

    #[test]
    fn the_table_is_the_least_power_of_two_for_twice_the_blocks() {
        for blocks in (0..200).chain([BLOCKS, 895, 896, 897, 5_000]) {
            // hashbrown fills a table up to 7/8.
            let buckets = (4..)
                .map(|shift| 1usize << shift)
                .find(|buckets| buckets * 7 / 8 >= 2 * blocks)
                .unwrap();
            assert_eq!(
                BlockIndex::bytes(blocks),
                (5 * buckets + 64).next_multiple_of(64),
                "{blocks} blocks"
            );
            let mut slab = vec![[0u64; 8]; BlockIndex::bytes(blocks) / 64 + 1];
            let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut slab);
            let mut carver = Carver::new(bytes, BlockIndex::bytes(blocks)).unwrap();
            let index = BlockIndex::new_in(blocks, &mut carver);
            assert_eq!(
                (carver.check(), carver.footprint().bytes()),
                (Ok(()), BlockIndex::bytes(blocks))
            );
            assert!(index.table.capacity() >= 2 * blocks && index.is_empty());
            let text = std::format!("{index:?}");
            assert_eq!(
                text,
                std::format!("BlockIndex {{ len: 0, capacity: {} }}", index.table.capacity())
            );
        }
    }

    #[test]
    fn neighbouring_blocks_spread_evenly_over_buckets_and_tags() {
        // What the table looks at: low bits for the bucket, the topmost seven for the tag.
        for apart in [1, 16] {
            let (mut buckets, mut tags, mut both) = ([0u32; 256], [0u32; 128], vec![0u32; 1 << 15]);
            for at in 0..1i32 << 15 {
                let coord = BlockCoord::new(
                    apart * (at % 32 - 16),
                    apart * (at / 32 % 32 - 16),
                    apart * (at / 1_024 - 16),
                );
                let coord = BlockKey::in_first(coord.unwrap());
                let (bucket, tag) = ((hash(coord) % 256) as usize, (hash(coord) >> 57) as usize);
                buckets[bucket] += 1;
                tags[tag] += 1;
                both[bucket * 128 + tag] += 1;
            }
            // Chance leaves the means, 128 and 256, by six standard deviations nowhere. One bucket
            // and tag have one block of the 32,768 on average; chance has up to nine, these
            // multipliers up to 13.
            assert!(buckets.iter().all(|count| (60..=196).contains(count)), "{buckets:?}");
            assert!(tags.iter().all(|count| (160..=352).contains(count)), "{tags:?}");
            let most = both.iter().max().unwrap();
            assert!(*most <= 16, "{most} of one bucket and one tag");
        }
    }

    #[test]
    fn blocks_of_one_hash_are_compared_and_an_absent_one_is_not_found() {
        let mut slab = vec![[0u64; 8]; BlockIndex::bytes(8) / 64 + 1];
        let mut carver =
            Carver::new(bytemuck::cast_slice_mut(&mut slab), BlockIndex::bytes(8)).unwrap();
        let mut index = BlockIndex::new_in(8, &mut carver);
        let coord = BlockKey::in_first(BlockCoord::new(3, -2, 1).unwrap());
        // Two slots whose blocks lie at the same place: the table cannot tell, but both are
        // compared until one is right.
        let (wrong, right) = (Slot::new(4), Slot::new(7));
        index.insert(coord, wrong, |_| Some(coord)).unwrap();
        index.insert(coord, right, |_| Some(coord)).unwrap();
        let coord_of = |slot: Slot| (slot == right).then_some(coord);
        let (found, compared) = index.probe(coord, coord_of);
        assert_eq!((found, index.find(coord, coord_of)), (Some(right), Some(right)));
        assert!((1..=2).contains(&compared));
        assert_eq!((index.probe(coord, |_| None), index.find(coord, |_| None)), ((None, 2), None));
        assert_eq!((index.remove(coord, |_| None), index.len()), (false, 2));
        assert_eq!(
            (index.remove(coord, coord_of), index.find(coord, |_| Some(coord))),
            (true, Some(wrong))
        );
    }
}
