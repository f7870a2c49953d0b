//! Regions of one slab and of two.

use super::*;
use std::string::ToString;

#[test]
fn allocates_aligned_zeroed_regions_and_records_them() {
    let mut slab = std::boxed::Box::new(Slab([7u8; 256]));
    let mut carver = Carver::new(&mut slab.0, 256).unwrap();
    let a = carver.alloc::<u16>("a", 5);
    let b = carver.alloc::<u64>("b", 16);
    assert_eq!(a, [0; 5]);
    assert_eq!(b, [0; 16]);
    assert_eq!(b.as_ptr() as usize % SLAB_ALIGN, 0);
    assert_eq!(carver.alloc_as_found::<u8>("c", 2), [7; 2]);
    let footprint = carver.footprint();
    assert_eq!(footprint.bytes(), 256);
    assert_eq!(footprint.region("b").unwrap().bytes, 128);
    assert_eq!(carver.check(), Ok(()));
}

#[test]
fn cold_regions_come_from_their_own_slab_if_there_is_one() {
    let mut slabs = std::boxed::Box::new([Slab([1u8; 192]), Slab([2u8; 192])]);
    let [hot, cold] = &mut *slabs;
    let mut carver = Carver::new_in_two(TwoSlabs { hot, cold }, [128, 192]).unwrap();
    assert_eq!(carver.alloc_as_found::<u8>("stereo.rows", 3), [1; 3]);
    assert_eq!(carver.alloc_as_found::<u8>("volume.voxels", 65), [2; 65]);
    assert_eq!(carver.group("places", |c| c.alloc_as_found::<u8>("list", 2)), [2; 2]);
    assert_eq!(carver.alloc_as_found::<u8>("depth_m", 64), [1; 64]);
    // Each slab is full by itself: what the other has left is no help.
    assert_eq!(carver.alloc::<u8>("raycast.depth", 1).len(), 0);
    assert_eq!(carver.check(), Err(SlabError::TooSmall { missing: 64 }));
    let [hot, cold] = &mut *slabs;
    let short = Carver::new_in_two(TwoSlabs { hot, cold }, [192, 200]).unwrap_err();
    assert_eq!(short, SlabError::TooSmall { missing: 8 });
}

#[test]
fn after_the_first_failure_allocates_nothing_and_returns_that_failure() {
    let mut slab = std::boxed::Box::new(Slab([0u8; 192]));
    let mut carver = Carver::new(&mut slab.0, 192).unwrap();
    assert_eq!(carver.alloc::<u8>("a", 64).len(), 64);
    assert_eq!(carver.alloc::<u8>("b", 200).len(), 0);
    assert_eq!(carver.alloc::<u8>("c", 1_000).len(), 0);
    // A failed carver gives out nothing more: no caller may go on with half of its regions.
    assert_eq!(carver.alloc::<u8>("d", 1).len(), 0, "although it would fit");
    assert_eq!(carver.check(), Err(SlabError::TooSmall { missing: 256 - 128 }));
    assert_eq!(carver.footprint().bytes(), 64);
}

#[test]
fn records_a_group_or_one_name_in_a_row_as_one_region() {
    let mut slab = std::boxed::Box::new(Slab([0u8; 512]));
    let mut carver = Carver::new(&mut slab.0, 512).unwrap();
    carver.alloc::<u8>("a", 1);
    // A second region of the same name follows: both are one, of three cache lines.
    carver.alloc::<u8>("a", 65);
    for _ in 0..2 {
        carver.group("both", |carver| {
            (carver.alloc::<u8>("b", 1).len(), carver.alloc::<u8>("c", 1).len())
        });
    }
    carver.alloc::<u8>("a", 1);
    let regions: std::vec::Vec<_> =
        carver.footprint().regions().iter().map(|region| (region.name, region.bytes)).collect();
    assert_eq!(regions, [("a", 192), ("both", 256), ("a", 64)]);
}

#[test]
fn more_regions_than_have_names_are_a_failure() {
    let mut slab = std::boxed::Box::new(Slab([0u8; 64 * 128]));
    let mut carver = Carver::new(&mut slab.0, 0).unwrap();
    for name in ["a", "b"].into_iter().cycle().take(120) {
        carver.alloc::<u8>(name, 1);
    }
    assert_eq!(carver.check(), Err(SlabError::TooManyRegions));
}

#[test]
fn names_the_bytes_it_lacks() {
    let mut slab = std::boxed::Box::new(Slab([0u8; 128]));
    assert_eq!(Carver::new(&mut slab, 200).unwrap_err(), SlabError::TooSmall { missing: 72 });
    assert_eq!(SlabError::TooSmall { missing: 72 }.to_string(), "the slab is 72 bytes too small");
}

#[test]
fn skips_to_the_first_aligned_byte() {
    let mut slab = std::boxed::Box::new(Slab([0u8; 192]));
    // A slab that begins at any byte has its first aligned one up to 63 bytes further.
    for offset in 1..=64 {
        let needed = 128;
        let mut carver = Carver::new(&mut slab[offset..], needed).unwrap();
        assert_eq!(carver.alloc::<u64>("a", 16).as_ptr().align_offset(SLAB_ALIGN), 0);
        assert_eq!(carver.check(), Ok(()));
        let short = Carver::new(&mut slab[offset..], needed + 1).unwrap_err();
        assert_eq!(
            short,
            SlabError::TooSmall { missing: 1 },
            "{offset} bytes behind an aligned one"
        );
    }
    assert_eq!(Carver::new(&mut slab[1..3], 0).unwrap_err(), SlabError::TooSmall { missing: 61 });
}
