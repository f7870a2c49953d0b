//! From a block's segment and coordinates to its slot: a hash table whose entries are integers.
//!
//! There are two tables, with the same results: [`PlainIndex`], and with the feature `hashbrown`
//! `HashedIndex`, which is faster and needs an allocator, and with it the crate `alloc` (decision 7
//! in docs/decisions). Nothing iterates a table, so its order is never observable.

#[cfg(feature = "hashbrown")]
mod hashed;
mod plain;
#[cfg(test)]
mod tests;

#[cfg(feature = "hashbrown")]
pub use hashed::HashedIndex;
pub use plain::PlainIndex;

use super::{BlockKey, Full, Slot};

/// The index of a map: hashbrown's table unless the feature `plain-index` is on.
#[cfg(all(feature = "hashbrown", not(feature = "plain-index")))]
pub type BlockIndex<'s> = HashedIndex<'s>;
/// The index of a map: a plain table.
#[cfg(not(all(feature = "hashbrown", not(feature = "plain-index"))))]
pub type BlockIndex<'s> = PlainIndex<'s>;

/// A block's key mixed by constants (the multipliers of Teschner et al., 2003, then a 64-bit
/// finaliser: tables look at both ends).
pub(super) fn hash(BlockKey { segment, coord }: BlockKey) -> u64 {
    let [x, y, z] = [coord.x, coord.y, coord.z].map(|c| i64::from(c) as u64);
    let mixed =
        x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_669) ^ z.wrapping_mul(83_492_791);
    // The first segment's hash is that of its coordinates.
    let mixed = mixed ^ u64::from(segment.get()).wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
    let mixed = (mixed ^ (mixed >> 32)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    mixed ^ (mixed >> 29)
}

#[cfg(test)]
mod hash_tests {
    use super::{super::BlockCoord, *};
    use std::vec;

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
}
