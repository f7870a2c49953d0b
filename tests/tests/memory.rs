//! Memory is what the formula says, in every profile.

use dynvox_core::{
    Capacity, Mapper, NewError, Serial,
    memory::{SLAB_ALIGN, SlabError},
};
use dynvox_tests::{Clip, HeapSlab};

#[test]
fn the_footprint_matches_the_formula_to_the_byte() {
    let clip = Clip::street(320, 96, 1);
    for (name, capacity) in Capacity::PROFILES {
        clip.with_mapper(&capacity, |mapper| {
            assert_eq!(mapper.footprint().bytes(), capacity.bytes(), "{name}");
        });
    }
}

#[test]
fn a_slab_too_small_is_refused_with_the_bytes_it_lacks() {
    let clip = Clip::street(320, 96, 1);
    let mut slab = HeapSlab::of(&Capacity::TINY);
    let mut refusal =
        |len: usize| Mapper::new(&Capacity::TINY, &clip.config(), &mut slab.bytes()[..len]).err();
    let short = Capacity::TINY.bytes() - 77;
    let Some(NewError::Slab(SlabError::TooSmall { missing })) = refusal(short) else {
        panic!("too small by 77 bytes")
    };
    // Up to an alignment's bytes more, where the allocator put the slab.
    assert!((77..77 + SLAB_ALIGN).contains(&missing), "{missing}");
    assert_eq!(
        refusal(short + missing - 1),
        Some(NewError::Slab(SlabError::TooSmall { missing: 1 }))
    );
    assert_eq!(refusal(short + missing), None);
}

#[test]
fn use_grows_with_the_map_and_never_beyond_its_regions() {
    let clip = Clip::street(320, 96, 6);
    clip.with_mapper(&Capacity::TINY, |mapper| {
        let mut last = 0;
        for frame in clip.stereo() {
            let report = mapper.step(&frame, &Serial).expect("a good frame");
            let footprint = mapper.footprint();
            let voxels = footprint.region("volume.voxels").expect("the map has voxels");
            assert_eq!(voxels.used, report.blocks.used as usize * 1_536);
            assert!(voxels.used >= last && voxels.peak <= voxels.bytes);
            last = voxels.used;
        }
        assert!(last > 0);
    });
}

#[test]
fn a_block_takes_the_bytes_promised_and_its_index_few_more() {
    let clip = Clip::street(320, 96, 1);
    for (capacity, voxel_bytes) in
        [(Capacity::ONBOARD, 3_072), (Capacity { colour: false, ..Capacity::ONBOARD }, 1_536)]
    {
        clip.with_mapper(&capacity, |mapper| {
            let footprint = mapper.footprint();
            let bytes = |names: &[&str]| {
                names
                    .iter()
                    .filter_map(|name| footprint.region(name))
                    .map(|region| region.bytes)
                    .sum::<usize>()
            };
            let voxels = bytes(&["volume.voxels", "volume.colour"]);
            assert_eq!(voxels, voxel_bytes * capacity.blocks);
            // What is kept for each block besides its voxels.
            let beside = bytes(&[
                "volume.index",
                "volume.history",
                "volume.history_due",
                "volume.allocated_at",
            ]);
            assert!(beside > 0 && 20 * beside <= voxels, "{beside} bytes beside {voxels}");
        });
    }
}
