//! Voxels of low weight beside others of the same surface.

use super::*;

#[test]
fn voxels_seen_once_stay_where_a_tenth_of_the_block_was_seen_more_often() {
    for (prune_rule, often, reset) in [
        (PruneBy::Support, 52, 0),
        (PruneBy::Support, 51, 512 - 51),
        (PruneBy::Support, 0, 512),
        (PruneBy::Weight, 52, 512 - 52),
    ] {
        with_volume(&CAPACITY, &VolumeConfig { prune_rule, ..pruning(1, 1) }, |volume| {
            volume.visible.begin_frame();
            let weight = |voxel: usize| if voxel < often { 5 } else { 1 };
            let slot = plant(volume, BlockCoord::default(), weight);
            let before = volume.digest();
            frame(volume, &[slot]);
            let report = frame(volume, &[]);
            assert_eq!(
                (report.voxels_reset, report.blocks_freed),
                (reset, u32::from(often == 0)),
                "{often} seen often, by {prune_rule:?}"
            );
            assert_eq!(volume.digest() == before, reset == 0, "the digest follows the voxels");
        });
    }
}

#[test]
fn nothing_goes_by_support_where_pruning_is_off() {
    let config = VolumeConfig { prune_rule: PruneBy::Support, ..pruning(0, 1) };
    with_volume(&CAPACITY, &config, |volume| {
        volume.visible.begin_frame();
        let slot = plant(volume, BlockCoord::default(), |_| 1);
        volume.blocks.voxels[slot.index()].sdf.fill(16_384);
        frame(volume, &[slot]);
        assert_eq!((frame(volume, &[]), volume.pool.len()), (PruneReport::default(), 1));
    });
}
