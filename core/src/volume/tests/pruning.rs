//! The window and what leaves it.

mod by_distance;
mod by_support;

use super::*;
use crate::random::Random;
use crate::volume::{block::Voxels, prune::PruneRule};
use std::collections::{BTreeMap, BTreeSet};

/// A config that prunes by weight up to `prune_weight` after `prune_lag` frames.
fn pruning(prune_weight: u8, prune_lag: u32) -> VolumeConfig {
    let prune_rule = PruneBy::Weight;
    VolumeConfig { prune_weight, prune_lag, prune_rule, ..VolumeConfig::default() }
}

/// Resets voxels of low weight, wherever they are.
fn by_weight(weight: u8) -> PruneRule {
    PruneRule { weight, distance: 0.0, support_one_of: 0 }
}

/// Makes a block whose voxels all have that weight, with its digest entered.
fn plant(volume: &mut Volume<'_>, coord: BlockCoord, weight: impl Fn(usize) -> u8) -> Slot {
    let slot = volume.make(volume.key(coord)).unwrap();
    let at = slot.index();
    for voxel in 0..BLOCK_VOXELS {
        volume.blocks.voxels[at].weight[voxel] = weight(voxel);
        volume.blocks.voxels[at].sdf[voxel] = 100 + voxel as i16;
    }
    volume.update_digest(slot);
    slot
}

/// One frame in which exactly these blocks are visible.
fn frame(volume: &mut Volume<'_>, slots: &[Slot]) -> PruneReport {
    volume.visible.begin_frame();
    slots.iter().for_each(|&slot| volume.visible.mark(slot).unwrap());
    volume.visible.sort(volume.pool.high_water());
    volume.prune()
}

fn coords(from: i32, count: i32) -> Vec<BlockCoord> {
    (from..from + count).map(|i| BlockCoord::new(i, -i, 2 * i).unwrap()).collect()
}

#[test]
fn frees_low_weight_blocks_lag_frames_after_they_were_seen_and_no_others() {
    with_volume(&CAPACITY, &pruning(2, 10), |volume| {
        volume.visible.begin_frame();
        let low_weight: Vec<Slot> =
            coords(0, 60).into_iter().map(|coord| plant(volume, coord, |_| 1)).collect();
        let high_weight: Vec<Slot> =
            coords(100, 40).into_iter().map(|coord| plant(volume, coord, |_| 5)).collect();
        let before: Vec<_> = high_weight
            .iter()
            .map(|&slot| {
                (volume.blocks.voxels[slot.index()].sdf, volume.blocks.voxels[slot.index()].weight)
            })
            .collect();
        low_weight.iter().chain(&high_weight).for_each(|&slot| volume.visible.mark(slot).unwrap());
        volume.visible.sort(volume.pool.high_water());
        assert_eq!(volume.prune(), PruneReport::default());
        for _ in 1..10 {
            assert_eq!(
                frame(volume, &[]),
                PruneReport::default(),
                "nothing changes within the lag"
            );
        }
        assert_eq!(volume.pool.len(), 100);
        let report = frame(volume, &[]);
        assert_eq!(
            report,
            PruneReport {
                visited: 100,
                voxels_reset: 60 * 512,
                blocks_freed: 60,
                carried_over: 0,
                early: 0,
                voxels_erased: 0
            }
        );
        assert_eq!((volume.pool.len(), volume.index.len()), (40, 40));
        for (&slot, before) in high_weight.iter().zip(&before) {
            assert_eq!(
                (volume.blocks.voxels[slot.index()].sdf, volume.blocks.voxels[slot.index()].weight),
                *before
            );
        }
        let digest = volume.digest();
        coords(0, 60).into_iter().for_each(|coord| {
            assert_eq!(volume.find(coord), None);
            plant(volume, coord, |_| 1);
        });
        assert_eq!(volume.pool.len(), 100, "as many can be made again");
        volume.prune_whole(2);
        assert_eq!((volume.pool.len(), volume.digest()), (40, digest));
    });
}

#[test]
fn a_map_of_one_frame_keeps_what_it_saw() {
    for (frames, left) in [(1, 1), (2, 0)] {
        with_volume(&CAPACITY, &pruning(1, 200), |volume| {
            volume.visible.begin_frame();
            let slot = plant(volume, BlockCoord::default(), |_| 1);
            volume.visible.mark(slot).unwrap();
            volume.visible.sort(volume.pool.high_water());
            volume.prune();
            for _ in 1..frames {
                frame(volume, &[]);
            }
            volume.finish();
            assert_eq!(volume.pool.len(), left, "{frames} frames");
        });
    }
}

#[test]
fn a_half_noisy_block_keeps_its_good_voxels() {
    with_volume(&CAPACITY, &pruning(1, 1), |volume| {
        volume.visible.begin_frame();
        let slot = plant(volume, BlockCoord::default(), |voxel| if voxel % 2 == 0 { 1 } else { 2 });
        let planes = &mut volume.blocks.colour[slot.index()];
        planes.iter_mut().for_each(|plane| plane.fill(9));
        frame(volume, &[slot]);
        let report = frame(volume, &[]);
        assert_eq!((report.voxels_reset, report.blocks_freed), (256, 0));
        for voxel in 0..BLOCK_VOXELS {
            let here = (
                volume.blocks.voxels[0].weight[voxel],
                volume.blocks.voxels[0].sdf[voxel],
                volume.blocks.colour[0][2][voxel],
            );
            assert_eq!(here, if voxel % 2 == 0 { (0, 0, 0) } else { (2, 100 + voxel as i16, 9) });
        }
        let content = fuse::block_digest(
            BlockKey::default(),
            &volume.blocks.voxels[0],
            volume.blocks.colour.first(),
        );
        assert_eq!(volume.digest(), content);
    });
}

#[test]
fn blocks_left_unread_have_no_voxel_of_low_weight() {
    let depth_m = bumpy_depth();
    let nearer: Vec<f32> = depth_m.iter().map(|depth| 0.95 * depth).collect();
    let grey = vec![7; WIDTH * HEIGHT];
    for prune_weight in 0..6 {
        let mut digests = Vec::new();
        for known in [true, false] {
            with_volume(&CAPACITY, &VolumeConfig::default(), |volume| {
                for (count, depth_m) in [(2, &depth_m), (3, &nearer), (1, &depth_m)] {
                    for _ in 0..count {
                        fuse_once(volume, &view([0.0; 3], [0.0; 3]), depth_m, &grey);
                    }
                }
                for (slot, Voxels { weight, .. }) in
                    volume.blocks.voxels.iter().enumerate().take(volume.pool.high_water())
                {
                    let least =
                        weight.iter().copied().filter(|&weight| weight > 0).min().unwrap_or(0);
                    assert_eq!(volume.blocks.min_weight[slot], least, "slot {slot}");
                }
                if !known {
                    volume.blocks.min_weight.fill(0);
                }
                digests.push((
                    volume.prune_whole(prune_weight),
                    volume.digest(),
                    volume.pool.len(),
                ));
            });
        }
        assert_eq!(digests[0], digests[1], "weight {prune_weight}");
    }
}

#[test]
fn visits_no_more_blocks_a_frame_than_allowed_and_forgets_none() {
    with_volume(
        &CAPACITY,
        &VolumeConfig { prune_blocks_per_frame: 7, ..pruning(1, 2) },
        |volume| {
            volume.visible.begin_frame();
            let slots: Vec<Slot> =
                coords(0, 30).into_iter().map(|coord| plant(volume, coord, |_| 1)).collect();
            frame(volume, &slots);
            frame(volume, &[]);
            let visited: Vec<_> = (0..6)
                .map(|_| frame(volume, &[]))
                .map(|report| (report.visited, report.carried_over))
                .collect();
            assert_eq!(visited, [(7, 23), (7, 16), (7, 9), (7, 2), (2, 0), (0, 0)]);
            assert!(volume.pool.is_empty());
        },
    );
}

#[test]
fn a_short_history_prunes_early_and_says_so() {
    with_volume(&Capacity { history_frames: 1, ..CAPACITY }, &pruning(1, 10), |volume| {
        volume.visible.begin_frame();
        let slot = plant(volume, BlockCoord::default(), |_| 1);
        assert_eq!(frame(volume, &[slot]).early, 0);
        let report = frame(volume, &[]);
        assert_eq!((report.early, report.blocks_freed), (1, 1));
    });
}

#[test]
fn a_history_as_long_as_the_lag_prunes_in_time() {
    with_volume(&Capacity { history_frames: 3, ..CAPACITY }, &pruning(1, 3), |volume| {
        volume.visible.begin_frame();
        let slot = plant(volume, BlockCoord::default(), |_| 1);
        frame(volume, &[slot]);
        for _ in 0..2 {
            assert_eq!(frame(volume, &[]), PruneReport::default());
        }
        assert_eq!(volume.history.len(), 3);
        let report = frame(volume, &[]);
        assert_eq!((report.early, report.blocks_freed, volume.history.len()), (0, 1, 3));
    });
}

#[test]
fn voxels_of_a_block_are_counted_by_how_often_they_were_seen() {
    with_volume(&CAPACITY, &pruning(3, 1), |volume| {
        volume.visible.begin_frame();
        // 64 voxels of each weight from 0 to 7.
        let slot = plant(volume, BlockCoord::default(), |voxel| (voxel % 8) as u8);
        assert_eq!(volume.prune_block(slot, by_weight(3)), (3 * 64, false));
        assert_eq!(
            volume.prune_block(slot, by_weight(3)),
            (0, false),
            "nothing of low weight is left"
        );
        assert_eq!(volume.prune_block(slot, by_weight(6)), (3 * 64, false), "4 to 6");
        assert_eq!(volume.prune_block(slot, by_weight(7)), (64, true));
    });
}

#[test]
fn weight_zero_is_off() {
    with_volume(&CAPACITY, &pruning(0, 1), |volume| {
        volume.visible.begin_frame();
        let slot = plant(volume, BlockCoord::default(), |_| 1);
        let digest = volume.digest();
        for _ in 0..5 {
            assert_eq!(frame(volume, &[slot]), PruneReport::default());
        }
        assert_eq!(volume.finish(), PruneReport::default());
        assert_eq!((volume.digest(), volume.pool.len()), (digest, 1));
    });
}

#[test]
fn finish_prunes_what_is_still_in_the_window() {
    with_volume(&CAPACITY, &pruning(1, 50), |volume| {
        volume.visible.begin_frame();
        let slots: Vec<Slot> =
            coords(0, 5).into_iter().map(|coord| plant(volume, coord, |_| 1)).collect();
        frame(volume, &slots);
        assert_eq!(volume.finish().blocks_freed, 5);
        assert_eq!((volume.digest(), volume.pool.len(), volume.history.len()), (0, 0, 0));
    });
}

/// A model that keeps everything: the coordinates and births of the blocks seen in each frame.
#[derive(Default)]
struct Model {
    seen: BTreeMap<u32, BTreeSet<(BlockCoord, u32)>>,
    alive: BTreeMap<BlockCoord, (Slot, u32)>,
}

#[test]
fn yields_the_blocks_visible_lag_frames_ago_through_reuse() {
    const LAG: u32 = 9;
    let capacity =
        Capacity { blocks: 90, visible_blocks: 90, history_frames: LAG as usize, ..CAPACITY };
    // Weight 9 everywhere: pruning visits blocks but takes none, so that only the test frees.
    with_volume(&capacity, &pruning(1, LAG), |volume| {
        let (mut model, mut random) = (Model::default(), Random::new(77));
        for now in 1..4_000u32 {
            volume.visible.begin_frame();
            assert_eq!(volume.visible.frame(), now);
            for _ in 0..random.below(12) {
                let [x, y, z] = [(); 3].map(|()| random.below(6) as i32 - 3);
                let coord = BlockCoord::new(x, y, z).unwrap();
                if let Some((slot, _)) = model.alive.remove(&coord) {
                    volume.free_block(slot);
                } else if volume.pool.len() < 90 {
                    let slot = plant(volume, coord, |_| 9);
                    model.alive.insert(coord, (slot, now));
                }
            }
            let mut seen = BTreeSet::new();
            for (&coord, &(slot, frame_made)) in &model.alive {
                if random.below(3) > 0 {
                    volume.visible.mark(slot).unwrap();
                    seen.insert((coord, frame_made));
                }
            }
            volume.visible.sort(volume.pool.high_water());
            model.seen.insert(now, seen);
            // What leaves the window now, of the blocks that are still the same.
            let expected: BTreeSet<BlockCoord> = now
                .checked_sub(LAG)
                .and_then(|then| model.seen.get(&then))
                .into_iter()
                .flatten()
                .filter(|(coord, frame_made)| {
                    model.alive.get(coord).is_some_and(|(_, alive)| alive == frame_made)
                })
                .map(|(coord, _)| *coord)
                .collect();
            if volume.history.len() == volume.history.capacity() {
                volume.history.expire();
            }
            volume.history.push(now, volume.visible.slots());
            let mut due = BTreeSet::new();
            while let Some(slot) = volume.history.take_due(0) {
                due.insert(volume.blocks.coord(slot).unwrap());
            }
            assert_eq!(due, expected, "in frame {now}");
        }
    });
}

#[test]
fn a_million_blocks_made_and_freed_leak_nothing() {
    const BLOCKS: usize = 300;
    let capacity = Capacity { blocks: BLOCKS, visible_blocks: BLOCKS, colour: false, ..CAPACITY };
    with_volume(&capacity, &pruning(1, 1), |volume| {
        let (mut model, mut random) = (BTreeMap::new(), Random::new(3));
        for _ in 0..1_000_000 {
            let coord = BlockCoord::new(
                random.below(9) as i32,
                random.below(9) as i32,
                random.below(9) as i32,
            )
            .unwrap();
            assert_eq!(volume.find(coord), model.get(&coord).copied());
            if let Some(slot) = model.remove(&coord) {
                volume.free_block(slot);
            } else {
                let made = volume.make(volume.key(coord));
                assert_eq!(made.is_some(), model.len() < BLOCKS);
                if let Some(slot) = made {
                    model.insert(coord, slot);
                }
            }
            assert_eq!((volume.pool.len(), volume.index.len()), (model.len(), model.len()));
        }
    });
}

#[test]
fn six_blocks_of_one_bucket_can_be_removed_in_any_order() {
    let capacity = Capacity { blocks: 64, visible_blocks: 64, colour: false, ..CAPACITY };
    with_volume(&capacity, &pruning(1, 1), |volume| {
        let all = (0..64).flat_map(|x| (0..64).map(move |z| BlockCoord::new(x, 0, z).unwrap()));
        // The table has 256 buckets: equal low bytes of the hash share one.
        let of_bucket = |&coord: &BlockCoord| index::hash(BlockKey::in_first(coord)) & 255 == 17;
        let mates: Vec<_> = all.filter(of_bucket).take(6).collect();
        assert_eq!(mates.len(), 6);
        let mut orders = vec![vec![]];
        for _ in 0..6 {
            orders = orders
                .into_iter()
                .flat_map(|order: Vec<usize>| {
                    (0..6)
                        .filter(|i| !order.contains(i))
                        .map(|i| [&order[..], &[i]].concat())
                        .collect::<Vec<_>>()
                })
                .collect();
        }
        assert_eq!(orders.len(), 720);
        for order in orders {
            let made = |&coord: &BlockCoord| volume.make(volume.key(coord)).unwrap();
            let slots: Vec<Slot> = mates.iter().map(made).collect();
            for (removed, &which) in order.iter().enumerate() {
                volume.free_block(slots[which]);
                for (i, (&coord, &slot)) in mates.iter().zip(&slots).enumerate() {
                    assert_eq!(
                        volume.find(coord),
                        (!order[..=removed].contains(&i)).then_some(slot)
                    );
                }
            }
            assert!(volume.pool.is_empty() && volume.index.is_empty());
        }
    });
}
