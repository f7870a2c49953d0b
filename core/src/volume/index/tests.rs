//! What either table must do.

use super::{super::BlockKey, *};
use crate::{geometry::MapSegment, memory::Carver, random::Random, volume::BlockCoord};
use std::{collections::BTreeMap, vec, vec::Vec};

const BLOCKS: usize = 700;

macro_rules! tests_of {
    ($module:ident, $index:ident) => {
        mod $module {
            use super::*;

            #[test]
            fn agrees_with_a_tree_over_200_000_changes() {
                let mut slab = vec![[0u8; 64]; $index::bytes(BLOCKS) / 64 + 1];
                let start = (64 - slab.as_ptr() as usize % 64) % 64;
                let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut slab);
                let mut carver = Carver::new(&mut bytes[start..], $index::bytes(BLOCKS)).unwrap();
                let mut index = $index::new_in(BLOCKS, &mut carver);
                let mut coords = [BlockKey::default(); BLOCKS];
                let mut free: Vec<Slot> = (0..BLOCKS as u32).map(Slot::new).collect();
                let mut model = BTreeMap::new();
                let mut random = Random::new(5);
                for _ in 0..200_000 {
                    let [x, y, z] = [(); 3].map(|()| random.below(10) as i32 - 5);
                    let segment = MapSegment::new(random.below(3) as u16);
                    let coord = BlockKey { segment, coord: BlockCoord::new(x, y, z).unwrap() };
                    if let Some(slot) = model.remove(&coord) {
                        assert_eq!(
                            index.find(coord, |slot| Some(coords[slot.index()])),
                            Some(slot)
                        );
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
            fn blocks_of_one_hash_are_compared_and_an_absent_one_is_not_found() {
                let mut slab = vec![[0u64; 8]; $index::bytes(8) / 64 + 1];
                let mut carver =
                    Carver::new(bytemuck::cast_slice_mut(&mut slab), $index::bytes(8)).unwrap();
                let mut index = $index::new_in(8, &mut carver);
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
                assert_eq!(
                    (index.probe(coord, |_| None), index.find(coord, |_| None)),
                    ((None, 2), None)
                );
                assert_eq!((index.remove(coord, |_| None), index.len()), (false, 2));
                assert_eq!(
                    (index.remove(coord, coord_of), index.find(coord, |_| Some(coord))),
                    (true, Some(wrong))
                );
            }
        }
    };
}

#[cfg(feature = "hashbrown")]
tests_of!(hashed, HashedIndex);
tests_of!(plain, PlainIndex);
