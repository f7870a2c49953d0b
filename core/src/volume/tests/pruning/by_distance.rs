//! Blocks far from any surface.

use super::*;
use crate::view::MeshConfig;

#[test]
fn a_block_far_from_any_surface_goes_only_when_asked() {
    let by_support = PruneBy::Support;
    for (prune_rule, units, left) in
        [(PruneBy::Weight, -16_384, 1), (by_support, -1_000, 1), (by_support, -16_384, 0)]
    {
        with_volume(&CAPACITY, &VolumeConfig { prune_rule, ..pruning(1, 1) }, |volume| {
            volume.visible.begin_frame();
            let slot = plant(volume, BlockCoord::default(), |_| 9);
            volume.blocks.voxels[slot.index()].sdf.fill(units);
            frame(volume, &[slot]);
            frame(volume, &[]);
            assert_eq!(volume.pool.len(), left, "{units} by {prune_rule:?}");
        });
    }
}

#[test]
fn a_far_block_stays_while_it_is_visible_and_needs_no_low_weight_to_go() {
    with_volume(
        &CAPACITY,
        &VolumeConfig { prune_rule: PruneBy::Support, ..pruning(1, 3) },
        |volume| {
            volume.visible.begin_frame();
            let slot = plant(volume, BlockCoord::default(), |_| 9);
            volume.blocks.voxels[slot.index()].sdf.fill(16_384);
            for _ in 0..6 {
                frame(volume, &[slot]);
            }
            frame(volume, &[]);
            frame(volume, &[]);
            assert_eq!(volume.pool.len(), 1, "visible in the window");
            let report = frame(volume, &[]);
            assert_eq!(
                (report.visited, report.voxels_reset, report.blocks_freed, volume.pool.len()),
                (1, 0, 1, 0)
            );
        },
    );
}

#[test]
fn surfaces_stay_when_blocks_two_voxels_from_them_go() {
    let mesh = |volume: &Volume<'_>| {
        let mut triangles = Vec::new();
        volume.triangles(&MeshConfig::default(), &mut |triangle| {
            triangles.push(triangle.vertices.map(|vertex| vertex.position_m.map(f32::to_bits)));
        });
        triangles.sort_unstable();
        triangles
    };
    let config = VolumeConfig { behind_m: 0.75, allocation_m: 0.75, ..pruning(0, 1) };
    with_volume(&CAPACITY, &VolumeConfig { prune_rule: PruneBy::Support, ..config }, |volume| {
        // Oblique, as a road is, and without the jumps in depth over which a surface of one
        // cell spans the truncation.
        let depth_m: Vec<f32> = (0..WIDTH * HEIGHT)
            .map(|i| 2.0 + (i % WIDTH) as f32 * 0.03 + (i / WIDTH) as f32 * 0.007)
            .collect();
        fuse_once(volume, &view([0.0; 3], [0.0; 3]), &depth_m, &[90; WIDTH * HEIGHT]);
        let (whole, blocks) = (mesh(volume), volume.pool.len());
        let report = volume.prune_whole(0);
        assert!(
            report.blocks_freed as usize > blocks / 4 && report.voxels_reset == 0,
            "{report:?} of {blocks}"
        );
        let left = mesh(volume);
        assert!(left.iter().all(|triangle| whole.binary_search(triangle).is_ok()));
        let lost = (whole.len() - left.len()) as f64;
        assert!(lost <= 0.001 * whole.len() as f64, "{lost} of {} triangles", whole.len());
    });
}

#[test]
fn a_block_is_far_where_all_that_was_seen_of_it_is_farther_than_allowed() {
    let units = 16_384;
    let at_units = f32::from(units as u16) / 32_767.0;
    for (distance, near, weight, left) in [
        (at_units, units, 9, 1),
        (at_units.next_down(), units, 9, 0),
        (at_units.next_down(), units - 1, 9, 1),
        (at_units.next_down(), 0, 0, 0),
    ] {
        with_volume(&CAPACITY, &pruning(1, 1), |volume| {
            volume.visible.begin_frame();
            let slot =
                plant(volume, BlockCoord::default(), |voxel| if voxel == 77 { weight } else { 9 });
            volume.blocks.voxels[slot.index()].sdf.fill(-units);
            volume.blocks.voxels[slot.index()].sdf[77] = near;
            assert_eq!(
                volume.prune_block(slot, PruneRule { distance, ..volume.rule() }),
                (0, left == 0)
            );
            assert_eq!(volume.pool.len(), left, "at {distance}, nearest {near} of weight {weight}");
        });
    }
}
