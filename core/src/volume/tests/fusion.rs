//! Allocation and fusion.

mod twin;

use super::*;
use crate::geometry::scalar::{max_f32, min_f32};
use crate::volume::block::{Colour, Voxels};
use bytemuck::TransparentWrapper;
use nalgebra::Point3;
use std::collections::BTreeSet;

#[test]
fn a_wall_ahead_is_stored_at_its_distance() {
    let (depth_m, grey) = (vec![3.0; WIDTH * HEIGHT], vec![77; WIDTH * HEIGHT]);
    let config = VolumeConfig {
        truncation_m: 0.4,
        behind_m: 0.4,
        allocation_m: 0.4,
        ..VolumeConfig::default()
    };
    with_volume(&CAPACITY, &config, |volume| {
        for _ in 0..3 {
            fuse_once(volume, &view([0.0; 3], [0.0; 3]), &depth_m, &grey);
        }
        let mut sampler = volume.sampler();
        for k in 53..=67 {
            let expected = (3.0 - f64::from(k) * 0.05) / 0.4 * 32_767.0;
            let voxel = sampler.voxel([0, 0, k]).unwrap();
            assert!(
                (f64::from(voxel.sdf) - expected).abs() <= 1.5,
                "at {k}: {} for {expected}",
                voxel.sdf
            );
            assert_eq!(voxel.weight, 3);
        }
        assert_eq!(
            sampler.voxel([0, 0, 51]).map(|voxel| voxel.sdf),
            Some(32_767),
            "free space within the block"
        );
        assert_eq!(sampler.voxel([0, 0, 69]), None, "behind the truncation nothing was observed");
        let slot = volume.find(BlockCoord::of_lattice([0, 0, 60]).unwrap()).unwrap();
        assert_eq!(volume.blocks().colour(slot).unwrap()[1][4 << 6], 77);
    });
}

#[test]
fn makes_exactly_the_blocks_of_the_lattice_points_nearest_to_the_rays() {
    let depth_m = bumpy_depth();
    let view = view([0.1, -0.2, 0.05], [1.0, -0.3, 2.0]);
    with_volume(&CAPACITY, &VolumeConfig::default(), |volume| {
        let report = volume.allocate(
            &view,
            View::new(&depth_m, WIDTH, HEIGHT).unwrap(),
            &mut NoStore,
            &Serial,
        );
        let mut fine = BTreeSet::new();
        let block_m = 0.4;
        // The first frame's: every second row from the first on, and in it every second pixel, from
        // the second and the first on by turns.
        let is_taken =
            |i: usize| (i / WIDTH).is_multiple_of(2) && (i % WIDTH + i / WIDTH / 2) % 2 == 1;
        for (i, &depth) in
            depth_m.iter().enumerate().filter(|(i, depth)| **depth > 0.0 && is_taken(*i))
        {
            let direction = Vector3::new(
                ((i % WIDTH) as f64 - RIG.center_u_px) / 80.0,
                ((i / WIDTH) as f64 - RIG.center_v_px) / 80.0,
                1.0,
            );
            // Two rows above and two columns to the left.
            let beside = [i.checked_sub(2 * WIDTH), i.checked_sub(2).filter(|_| i % WIDTH > 1)];
            let beside =
                beside.into_iter().flatten().map(|at| depth_m[at]).filter(|&beside| beside > 0.0);
            let reach = f64::from(min_f32(
                beside.map(|beside| 0.5 * (beside - depth).abs()).fold(0.2, max_f32),
                0.75,
            ));
            for step in 0..=3_000 {
                let at = f64::from(depth) + reach * (f64::from(step) / 1_500.0 - 1.0);
                let point =
                    view.t_world_camera.transform_point(Point3::from(direction * at)).coords
                        / block_m;
                let block = [point.x, point.y, point.z].map(|c| (c + 1.0 / 16.0).floor() as i32);
                fine.insert(BlockCoord::new(block[0], block[1], block[2]).unwrap());
            }
        }
        let made: BTreeSet<_> = volume
            .visible()
            .slots()
            .iter()
            .map(|&slot| volume.blocks().coord(slot).unwrap())
            .collect();
        assert_eq!(report.made as usize, made.len());
        assert!(fine.is_subset(&made), "no block a ray runs through is missed");
        // The sampled twin steps over corners of less than half a millimetre; hardly any block
        // hangs on one.
        assert!(
            made.len() - fine.len() <= made.len() / 100,
            "{} made, {} found by small steps",
            made.len(),
            fine.len()
        );
    });
}

#[test]
fn threads_change_nothing_and_the_digest_is_that_of_the_content() {
    let (depth_m, grey) = (bumpy_depth(), vec![50; WIDTH * HEIGHT]);
    let run = |threads: bool| {
        let mut digests = Vec::new();
        with_volume(&CAPACITY, &VolumeConfig::default(), |volume| {
            for i in 0..4 {
                let view = view([0.0, 0.05 * f64::from(i), 0.0], [0.0, 0.0, 0.3 * f64::from(i)]);
                let seen = observation(&depth_m, &grey);
                if threads {
                    volume.allocate(&view, seen.depth.depth_m(), &mut NoStore, &TwoThreads);
                    volume.fuse(&view, seen, &TwoThreads)
                } else {
                    volume.allocate(&view, seen.depth.depth_m(), &mut NoStore, &Serial);
                    volume.fuse(&view, seen, &Serial)
                }
                // In slot order: the slots are the same too.
                let coords: Vec<_> = volume
                    .visible()
                    .slots()
                    .iter()
                    .map(|&slot| volume.blocks().coord(slot))
                    .collect();
                digests.push((volume.digest(), coords));
            }
            let of_content = volume
                .pool()
                .live()
                .filter(|&slot| {
                    volume.blocks().weight(slot).unwrap().iter().any(|&weight| weight > 0)
                })
                .map(|slot| {
                    let blocks = volume.blocks();
                    let key = blocks.key(slot).unwrap();
                    fuse::block_digest(key, &blocks.voxels[slot.index()], blocks.colour(slot))
                })
                .fold(0u64, u64::wrapping_add);
            assert_eq!(volume.digest(), of_content);
        });
        digests
    };
    let serial = run(false);
    assert_eq!(serial, run(true));
    assert!(serial.windows(2).all(|pair| pair[0] != pair[1]));
}

#[test]
fn blocks_that_swap_contents_or_planes_change_the_digest() {
    let coords = [BlockCoord { x: 1, y: -2, z: 300 }, BlockCoord { x: -2, y: 1, z: 300 }];
    let contents = [(5, 3), (-5, 4)]
        .map(|(sdf, weight)| Voxels { sdf: [sdf; BLOCK_VOXELS], weight: [weight; BLOCK_VOXELS] });
    let planes = [[0; BLOCK_VOXELS], [1; BLOCK_VOXELS], [2; BLOCK_VOXELS]];
    let sum = |order: [usize; 2], planes: &[[u8; BLOCK_VOXELS]; 3]| {
        let blocks = coords.iter().zip(order.map(|at| &contents[at]));
        blocks
            .map(|(&coord, voxels)| {
                fuse::block_digest(BlockKey::in_first(coord), voxels, Some(planes))
            })
            .fold(0u64, u64::wrapping_add)
    };
    let swapped = [planes[1], planes[0], planes[2]];
    let sums = [
        sum([0, 1], &planes),
        sum([1, 0], &planes),
        sum([0, 0], &planes),
        sum([1, 1], &planes),
        sum([0, 1], &swapped),
    ];
    assert!((0..sums.len()).all(|one| (0..one).all(|other| sums[one] != sums[other])), "{sums:?}");
}

#[test]
fn a_full_pool_refuses_and_counts_and_keeps_what_it_has() {
    let (depth_m, grey) = (bumpy_depth(), vec![50; WIDTH * HEIGHT]);
    for blocks in [1, 2, 17] {
        with_volume(&Capacity { blocks, ..CAPACITY }, &VolumeConfig::default(), |volume| {
            for _ in 0..3 {
                let report = fuse_once(volume, &view([0.0; 3], [0.0; 3]), &depth_m, &grey);
                assert!(report.refused > 0);
                assert_eq!(volume.pool().len(), blocks);
                assert_eq!(volume.visible().slots().len(), blocks);
            }
            let seen = (0..blocks as u32)
                .map(Slot::new)
                .filter(|&slot| volume.blocks().weight(slot).unwrap().contains(&3))
                .count();
            assert!(seen > 0, "the blocks there are keep being fused");
        });
    }
}

#[test]
fn a_full_visible_list_leaves_blocks_out_and_counts() {
    let (depth_m, grey) = (bumpy_depth(), vec![50; WIDTH * HEIGHT]);
    with_volume(&Capacity { visible_blocks: 10, ..CAPACITY }, &VolumeConfig::default(), |volume| {
        let report = fuse_once(volume, &view([0.0; 3], [0.0; 3]), &depth_m, &grey);
        assert_eq!(volume.visible().slots().len(), 10);
        assert!(report.unlisted > 0);
    });
}

#[test]
fn beyond_the_map_is_refused_and_counted() {
    let (depth_m, grey) = (vec![3.0; WIDTH * HEIGHT], vec![50; WIDTH * HEIGHT]);
    with_volume(&CAPACITY, &VolumeConfig::default(), |volume| {
        for far in [13_106.0, 1e9, -1e300] {
            let report = fuse_once(volume, &view([0.0; 3], [0.0, 0.0, far]), &depth_m, &grey);
            assert!(report.beyond > 0 && report.made == 0, "at {far} m: {report:?}");
        }
    });
}

#[test]
fn near_observations_weigh_more_up_to_the_maximum() {
    for (depth, expected) in [(10.0, 10), (15.0, 6), (19.9, 5), (5.0, 10)] {
        let config = VolumeConfig {
            observation_weight: ObservationWeight::Depth,
            max_weight: 25,
            ..VolumeConfig::default()
        };
        with_volume(
            &Capacity { blocks: 20_000, visible_blocks: 20_000, ..CAPACITY },
            &config,
            |volume| {
                let (depth_m, grey) = (vec![depth; WIDTH * HEIGHT], vec![50; WIDTH * HEIGHT]);
                let point = [0, 0, (depth / 0.05) as i32];
                fuse_once(volume, &view([0.0; 3], [0.0; 3]), &depth_m, &grey);
                assert_eq!(volume.sampler().voxel(point).unwrap().weight, expected);
                for _ in 0..6 {
                    fuse_once(volume, &view([0.0; 3], [0.0; 3]), &depth_m, &grey);
                }
                assert_eq!(volume.sampler().voxel(point).unwrap().weight, 25);
            },
        );
    }
}

#[test]
fn what_was_taken_for_free_space_yields_to_a_surface() {
    // A surface 5 m away, twice what lies 10 m away behind it, and the surface again.
    let distance = |observation_weight| {
        let config = VolumeConfig { observation_weight, ..VolumeConfig::default() };
        let mut sdf = 0;
        with_volume(
            &Capacity { blocks: 20_000, visible_blocks: 20_000, ..CAPACITY },
            &config,
            |volume| {
                for depth_m in [5.0, 10.0, 10.0, 5.0] {
                    fuse_once(
                        volume,
                        &view([0.0; 3], [0.0; 3]),
                        &vec![depth_m; WIDTH * HEIGHT],
                        &vec![50; WIDTH * HEIGHT],
                    );
                }
                sdf = volume.sampler().voxel([0, 0, 100]).unwrap().sdf;
            },
        );
        sdf
    };
    // Those of 10 m weigh 20 of 40 parts, or 4 of 24.
    assert!((i32::from(distance(ObservationWeight::Depth)) - 16_384).abs() < 4);
    assert!((i32::from(distance(ObservationWeight::Band)) - 5_461).abs() < 4);
}

#[test]
fn near_observations_replace_the_past_and_weights_still_count() {
    for (observation_weight, depth, past) in [
        (ObservationWeight::Nearest, 4.0, 2),
        (ObservationWeight::Nearest, 16.0, 8),
        (ObservationWeight::One, 4.0, 10),
    ] {
        let config = VolumeConfig {
            observation_weight,
            distance: DistanceAlong::Ray,
            ..VolumeConfig::default()
        };
        with_volume(
            &Capacity { blocks: 20_000, visible_blocks: 20_000, ..CAPACITY },
            &config,
            |volume| {
                let point = [0, 0, (depth / 0.05) as i32 - 2];
                let mut fused = |depth: f32| {
                    fuse_once(
                        volume,
                        &view([0.0; 3], [0.0; 3]),
                        &vec![depth; WIDTH * HEIGHT],
                        &vec![50; WIDTH * HEIGHT],
                    );
                    let voxel = volume.sampler().voxel(point).unwrap();
                    (f64::from(voxel.sdf), voxel.weight)
                };
                let before = (0..10).map(|_| fused(depth)).last().unwrap().0;
                let (after, weight) = fused(depth + 0.15);
                let step = 0.15 / 0.75 * 32_767.0 / f64::from(past + 1);
                assert!(
                    (after - before - step).abs() < 3.0,
                    "{observation_weight:?} at {depth} m: {before} to {after}"
                );
                assert_eq!(weight, 11);
            },
        );
    }
}

#[test]
fn a_class_of_weight_zero_stays_out_of_the_map_and_another_counts_thrice() {
    let mut config = VolumeConfig::default();
    config.class_weight[7] = 0;
    config.class_weight[8] = 3;
    let (depth_m, grey) = (vec![3.0; WIDTH * HEIGHT], vec![50; WIDTH * HEIGHT]);
    let class: Vec<u8> =
        (0..WIDTH * HEIGHT).map(|i| if i % WIDTH < WIDTH / 2 { 7 } else { 8 }).collect();
    with_volume(&CAPACITY, &config, |volume| {
        let mut seen = observation(&depth_m, &grey);
        seen.class = View::new(&class, WIDTH, HEIGHT);
        volume.allocate(&view([0.0; 3], [0.0; 3]), seen.depth.depth_m(), &mut NoStore, &Serial);
        volume.fuse(&view([0.0; 3], [0.0; 3]), seen, &Serial);
        assert_eq!(volume.sampler().voxel([-10, 0, 60]), None);
        assert_eq!(volume.sampler().voxel([10, 0, 60]).unwrap().weight, 3);
    });
}

#[test]
fn a_surface_made_by_noise_becomes_free_space() {
    let grey = vec![50; WIDTH * HEIGHT];
    let config = VolumeConfig { truncation_m: 0.3, ..VolumeConfig::default() };
    with_volume(&CAPACITY, &config, |volume| {
        fuse_once(volume, &view([0.0; 3], [0.0; 3]), &vec![2.0; WIDTH * HEIGHT], &grey);
        assert!(volume.sampler().voxel([0, 0, 42]).unwrap().sdf < 0);
        for _ in 0..8 {
            fuse_once(volume, &view([0.0; 3], [0.0; 3]), &vec![8.0; WIDTH * HEIGHT], &grey);
        }
        assert!(volume.sampler().voxel([0, 0, 42]).unwrap().sdf > 20_000);
    });
}

#[test]
fn what_stood_before_a_surface_too_far_to_be_fused_is_cleared() {
    let grey = vec![50; WIDTH * HEIGHT];
    let config = VolumeConfig { truncation_m: 0.3, far_m: 4.0, ..VolumeConfig::default() };
    with_volume(&CAPACITY, &config, |volume| {
        let ahead = view([0.0; 3], [0.0; 3]);
        fuse_once(volume, &ahead, &vec![2.0; WIDTH * HEIGHT], &grey);
        fuse_once(volume, &ahead, &vec![3.9; WIDTH * HEIGHT], &grey);
        let behind = |volume: &Volume<'_>, z| volume.sampler().voxel([0, 0, z]).unwrap();
        let (near, far) = (behind(volume, 42), behind(volume, 80));
        for _ in 0..8 {
            let report = fuse_once(volume, &ahead, &vec![5.0; WIDTH * HEIGHT], &grey);
            assert_eq!((report.made, report.requests), (0, 0), "it is not fused itself");
        }
        assert!(near.sdf < 20_000 && behind(volume, 42).sdf > 25_000, "{near:?}");
        assert_eq!(behind(volume, 80), far, "within a quarter of its depth it tells nothing");
    });
}

#[test]
fn what_has_gone_while_the_camera_looked_away_is_cleared() {
    let grey = vec![50; WIDTH * HEIGHT];
    let config = VolumeConfig { truncation_m: 0.3, ..VolumeConfig::default() };
    with_volume(&CAPACITY, &config, |volume| {
        let (ahead, back) = (view([0.0; 3], [0.0; 3]), view([0.0, 3.0, 0.0], [0.0; 3]));
        fuse_once(volume, &ahead, &vec![2.0; WIDTH * HEIGHT], &grey);
        fuse_once(volume, &back, &vec![6.0; WIDTH * HEIGHT], &grey);
        assert!(volume.sampler().voxel([0, 0, 42]).unwrap().sdf < 0);
        for _ in 0..12 {
            fuse_once(volume, &ahead, &vec![8.0; WIDTH * HEIGHT], &grey);
        }
        assert!(volume.sampler().voxel([0, 0, 42]).unwrap().sdf > 20_000);
    });
}
