//! What moving objects left in the map.

use super::*;
use crate::geometry::OrientedBox;

/// A wall 2 m before the camera, fused that often.
fn fuse_wall(volume: &mut Volume<'_>, times: usize) {
    let (depth_m, grey) = (vec![2.0; WIDTH * HEIGHT], vec![90; WIDTH * HEIGHT]);
    (0..times).for_each(|_| {
        fuse_once(volume, &view([0.0; 3], [0.0; 3]), &depth_m, &grey);
    });
}

/// Voxels seen, within a box and outside.
fn seen(volume: &Volume<'_>, within: &OrientedBox) -> [usize; 2] {
    let voxel_m = f64::from(volume.config().voxel_size_m);
    let mut counts = [0; 2];
    for slot in volume.pool().live() {
        let origin = volume.blocks().coord(slot).unwrap().origin();
        for (index, weight) in volume.blocks.voxels[slot.index()].weight.iter().enumerate() {
            let offset = [index % 8, index / 8 % 8, index / 64];
            let point_m =
                [0, 1, 2].map(|axis| voxel_m * (f64::from(origin[axis]) + offset[axis] as f64));
            counts[usize::from(!within.contains(point_m))] += usize::from(*weight > 0);
        }
    }
    counts
}

#[test]
fn erases_what_was_seen_in_few_frames_within_the_box_and_nothing_else() {
    // A turned box over the middle of the wall.
    let turned = OrientedBox {
        t_box_world: Transform::new([0.0, 0.4, 0.2], [0.0, 0.0, -2.0]),
        low_m: [-0.5, -0.4, -1.5],
        high_m: [0.5, 0.4, 1.5],
    };
    with_volume(&CAPACITY, &VolumeConfig::default(), |volume| {
        fuse_wall(volume, 3);
        let (digest, [inside, outside]) = (volume.digest(), seen(volume, &turned));
        assert!(inside > 1_000 && outside > 1_000);
        assert_eq!(volume.erase(&turned, 2), 0, "all was seen in three frames");
        assert_eq!(volume.digest(), digest);
        assert_eq!(volume.erase(&turned, 3), inside as u32);
        assert_eq!(seen(volume, &turned), [0, outside]);
        assert_ne!(volume.digest(), digest);
    });
}

#[test]
fn a_block_with_nothing_left_goes_back_to_the_pool() {
    let all = OrientedBox { t_box_world: Transform::IDENTITY, low_m: [-4.0; 3], high_m: [4.0; 3] };
    with_volume(&CAPACITY, &VolumeConfig::default(), |volume| {
        fuse_wall(volume, 1);
        let [seen, _] = seen(volume, &all);
        assert_eq!(volume.erase(&all, 1), seen as u32);
        // Blocks that were made and never seen in stay: pruning frees them.
        assert_eq!(
            volume
                .pool()
                .live()
                .filter(|slot| volume.blocks.voxels[slot.index()]
                    .weight
                    .iter()
                    .any(|weight| *weight > 0))
                .count(),
            0
        );
        fuse_wall(volume, 1);
        assert_eq!(volume.erase(&OrientedBox { high_m: [f64::NAN; 3], ..all }, 1), 0);
        let endless = OrientedBox { low_m: [-1e9; 3], high_m: [1e9; 3], ..all };
        assert_eq!(
            [volume.erase(&endless, 1), volume.erase(&endless, 1)],
            [seen as u32, 0],
            "by the blocks that there are"
        );
    });
}
