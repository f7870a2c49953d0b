//! A pool too small for the run, and a store for what it evicts.

use super::*;
use crate::random::Random;
use std::collections::BTreeMap;

/// Contents of a block.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Content {
    pub sdf: Vec<i16>,
    pub weight: Vec<u8>,
    pub colour: Vec<u8>,
}

/// A store that keeps everything, or refuses everything.
#[derive(Default)]
pub(super) struct MemoryStore {
    pub blocks: BTreeMap<BlockKey, Content>,
    is_closed: bool,
}

impl BlockStore for MemoryStore {
    fn store(&mut self, block: EvictedBlock<'_>) -> bool {
        if !self.is_closed {
            let colour = block.colour.map_or(vec![], |planes| planes.as_flattened().to_vec());
            self.blocks.insert(
                block.key,
                Content { sdf: block.sdf.to_vec(), weight: block.weight.to_vec(), colour },
            );
        }
        !self.is_closed
    }

    fn load(&mut self, block: LoadedBlock<'_>) -> bool {
        let Some(kept) = self.blocks.remove(&block.key) else { return false };
        block.sdf.copy_from_slice(&kept.sdf);
        block.weight.copy_from_slice(&kept.weight);
        if let Some(planes) = block.colour {
            planes.as_flattened_mut().copy_from_slice(&kept.colour);
        }
        true
    }
}

/// Maps a corridor with a bumpy end wall from the given positions, then evicts every block. Returns
/// the sum of the reports of all frames.
fn run(
    blocks: usize,
    config: &VolumeConfig,
    positions_m: &[f64],
    store: &mut MemoryStore,
) -> EvictionReport {
    let grey: Vec<u8> = (0..WIDTH * HEIGHT).map(|i| (i % 251) as u8).collect();
    let mut sum = EvictionReport::default();
    with_volume(&Capacity { blocks, ..CAPACITY }, config, |volume| {
        let add = |sum: &mut EvictionReport, report: EvictionReport| {
            *sum = EvictionReport {
                stored: sum.stored + report.stored,
                lost: sum.lost + report.lost,
                empty: sum.empty + report.empty,
                loaded: sum.loaded + report.loaded,
            };
        };
        for (i, &z) in positions_m.iter().enumerate() {
            let depth_m: Vec<f32> =
                bumpy_depth().iter().map(|depth| depth * 0.5 + 0.01 * (i % 3) as f32).collect();
            let view = view([0.0; 3], [0.0, 0.0, z]);
            let seen = observation(&depth_m, &grey);
            let report = volume.allocate(&view, seen.depth.depth_m(), store, &Serial);
            assert_eq!(report.refused, 0);
            add(&mut sum, report.eviction);
            volume.fuse(&view, seen, &Serial);
            volume.prune();
            assert_eq!(volume.pool.len(), volume.index.len());
        }
        volume.finish();
        add(&mut sum, volume.stream_out(store));
        assert_eq!(
            (volume.pool.len(), volume.digest()),
            (0, 0),
            "nothing left, nothing miscounted"
        );
    });
    sum
}

fn config(prune_weight: u8) -> VolumeConfig {
    VolumeConfig {
        truncation_m: 0.3,
        far_m: 4.0,
        prune_weight,
        prune_lag: 12,
        prune_rule: PruneBy::Weight,
        ..VolumeConfig::default()
    }
}

#[test]
fn a_run_that_needs_five_pools_leaves_the_same_map_as_an_unbounded_one() {
    let ahead: Vec<f64> = (0..120).map(|i| f64::from(i) * 0.4).collect();
    let (mut unbounded, mut streamed) = (MemoryStore::default(), MemoryStore::default());
    run(6_000, &config(0), &ahead, &mut unbounded);
    let pool = unbounded.blocks.len() / 5;
    let report = run(pool, &config(0), &ahead, &mut streamed);
    assert!(unbounded.blocks.len() >= 5 * pool && report.stored as usize >= unbounded.blocks.len());
    assert_eq!((report.lost, report.loaded), (0, 0));
    assert!(unbounded.blocks == streamed.blocks, "bit for bit");
}

#[test]
fn there_and_back_again_is_the_same_map_too() {
    let way: Vec<f64> = (0..80).chain((0..80).rev()).map(|i| f64::from(i) * 0.4).collect();
    let (mut unbounded, mut streamed) = (MemoryStore::default(), MemoryStore::default());
    run(6_000, &config(0), &way, &mut unbounded);
    let report = run(unbounded.blocks.len() * 2 / 5, &config(0), &way, &mut streamed);
    assert!(report.loaded > 0 && report.lost == 0);
    assert!(unbounded.blocks == streamed.blocks, "bit for bit");
}

#[test]
fn pruning_catches_what_leaves_within_the_window() {
    let ahead: Vec<f64> = (0..120).map(|i| f64::from(i) * 0.4).collect();
    let (mut unbounded, mut streamed) = (MemoryStore::default(), MemoryStore::default());
    run(6_000, &config(2), &ahead, &mut unbounded);
    run(unbounded.blocks.len() / 5, &config(2), &ahead, &mut streamed);
    assert!(unbounded.blocks == streamed.blocks, "bit for bit");
    assert!(
        unbounded
            .blocks
            .values()
            .all(|kept| kept.weight.iter().all(|&weight| weight == 0 || weight > 2))
    );
}

#[test]
fn what_a_closed_store_refuses_is_counted_as_lost() {
    let ahead: Vec<f64> = (0..60).map(|i| f64::from(i) * 0.4).collect();
    let mut closed = MemoryStore { is_closed: true, ..MemoryStore::default() };
    let report = run(900, &config(0), &ahead, &mut closed);
    assert!(report.lost > 900 && report.stored == 0);
}

#[test]
fn a_map_set_to_refuse_evicts_nothing() {
    let (depth_m, grey) = (vec![3.0; WIDTH * HEIGHT], vec![50; WIDTH * HEIGHT]);
    let config = VolumeConfig { when_full: WhenFull::Refuse, ..config(0) };
    with_volume(&Capacity { blocks: 300, ..CAPACITY }, &config, |volume| {
        let mut refused = 0;
        for i in 0..20 {
            let seen = observation(&depth_m, &grey);
            let report = volume.allocate(
                &view([0.0; 3], [0.0, 0.0, f64::from(i)]),
                seen.depth.depth_m(),
                &mut NoStore,
                &Serial,
            );
            assert_eq!(report.eviction, EvictionReport::default());
            refused += report.refused;
        }
        assert!(refused > 0);
        assert!(
            volume.find(BlockCoord::of_lattice([0, 0, 60]).unwrap()).is_some(),
            "the first wall is still there"
        );
    });
}

#[test]
fn a_million_random_changes_of_blocks_agree_with_a_model() {
    const BLOCKS: usize = 60;
    let capacity = Capacity { blocks: BLOCKS, visible_blocks: BLOCKS, colour: false, ..CAPACITY };
    let config = VolumeConfig { prune_weight: 1, prune_lag: 3, ..VolumeConfig::default() };
    with_volume(&capacity, &config, |volume| {
        let (mut store, mut random) = (MemoryStore::default(), Random::new(9));
        // Per block of three segments its weight everywhere; in the store or in the map.
        let mut model: BTreeMap<BlockKey, u8> = BTreeMap::new();
        let mut operations = 0;
        while operations < 1_000_000 {
            volume.visible.begin_frame();
            volume.enter_segment(MapSegment::new(random.below(3) as u16));
            let mut report = AllocationReport::default();
            for _ in 0..random.below(25) {
                operations += 1;
                let coord =
                    BlockCoord::new(random.below(5) as i32, random.below(5) as i32, 3).unwrap();
                let key = volume.key(coord);
                let (refused, empty) = (report.refused, report.eviction.empty);
                volume.request(coord.origin().map(|c| c >> 3), [0; 3], &mut store, &mut report);
                if report.eviction.empty > empty {
                    // A block of weight 1 left within the window and was pruned on its way.
                    model.retain(|key, weight| {
                        *weight > 1
                            || volume.find_key(*key).is_some()
                            || store.blocks.contains_key(key)
                    });
                }
                let Some(slot) = volume.find(coord) else {
                    assert!(report.refused > refused);
                    continue;
                };
                let old = model.get(&key).copied().unwrap_or(0);
                assert_eq!(
                    volume.blocks.voxels[slot.index()].weight[7],
                    old,
                    "a block is as it was left, in the map or loaded"
                );
                if random.below(4) > 0 {
                    volume.blocks.voxels[slot.index()].weight.fill(old.saturating_add(1));
                    volume.update_digest(slot);
                    model.insert(key, old.saturating_add(1));
                }
            }
            volume.visible.sort(volume.pool.high_water());
            volume.prune();
            model.retain(|key, weight| {
                *weight > 1 || volume.find_key(*key).is_some() || store.blocks.contains_key(key)
            });
            assert_eq!(volume.pool.len(), volume.index.len());
        }
        let stored = store.blocks.iter().map(|(&key, kept)| (key, kept.weight[7]));
        let live = volume.pool.live().map(|slot| {
            (volume.blocks.key(slot).unwrap(), volume.blocks.voxels[slot.index()].weight[7])
        });
        let all: BTreeMap<_, _> = stored.chain(live).filter(|(_, weight)| *weight > 0).collect();
        assert_eq!(all, model);
    });
}
