//! Segments of a map: lattices of their own in one pool and one store.

use super::eviction::{Content, MemoryStore};
use super::*;
use crate::view::{MeshConfig, RaycastConfig, Raycaster, Triangle};
use std::{boxed::Box, collections::BTreeMap};

const SECOND: MapSegment = MapSegment::new(1);

/// The wall of the second segment: no block of it is where one of the first is empty.
fn wall() -> Vec<f32> {
    vec![3.0; WIDTH * HEIGHT]
}

/// Fuses a frame as seen from the origin, through a store.
fn fuse_into(
    volume: &mut Volume<'_>,
    depth_m: &[f32],
    store: &mut impl BlockStore,
) -> AllocationReport {
    let grey = vec![120; WIDTH * HEIGHT];
    let (view, seen) = (view([0.0; 3], [0.0; 3]), observation(depth_m, &grey));
    let report = volume.allocate(&view, seen.depth.depth_m(), store, &Serial);
    volume.fuse(&view, seen, &Serial);
    report
}

/// Distances and weights of a segment's blocks that are in the pool.
fn content(volume: &Volume<'_>, segment: MapSegment) -> BTreeMap<BlockCoord, Content> {
    let blocks = volume.blocks();
    let of_slot = |slot: Slot| Content {
        sdf: blocks.sdf(slot).unwrap().to_vec(),
        weight: blocks.weight(slot).unwrap().to_vec(),
        colour: vec![],
    };
    let keyed = volume.pool().live().map(|slot| (blocks.key(slot).unwrap(), of_slot(slot)));
    keyed.filter(|(key, _)| key.segment == segment).map(|(key, of)| (key.coord, of)).collect()
}

/// The current segment's surface, and what the camera at the origin sees of it.
fn shown(volume: &Volume<'_>) -> (Vec<Triangle>, Vec<f32>) {
    let mut triangles = Vec::new();
    volume.triangles(&MeshConfig::default(), &mut |triangle| triangles.push(triangle));
    triangles.sort_by_key(|of| of.vertices.map(|corner| corner.position_m.map(f32::to_bits)));
    let bytes = Raycaster::bytes(&CAPACITY);
    let memory = Box::leak(vec![0u8; bytes + 64].into_boxed_slice());
    let start = memory.as_ptr().align_offset(64);
    let mut carver = Carver::new(&mut memory[start..], bytes).unwrap();
    let mut caster = Raycaster::new_in(&CAPACITY, &RaycastConfig::default(), &mut carver);
    caster.cast(volume, &view([0.0; 3], [0.0; 3]), &Serial).unwrap();
    let depth_m = caster.depth_m().unwrap().pixels().to_vec();
    (triangles, depth_m)
}

#[test]
fn each_segment_is_fused_cast_and_meshed_as_a_map_of_its_own() {
    let config = VolumeConfig::default();
    let alone = |depth_m: &[f32], frames_before: u32| {
        let mut found = None;
        with_volume(&CAPACITY, &config, |volume| {
            // The pixels whose rays are walked depend on the frame's number.
            (0..frames_before).for_each(|_| volume.visible.begin_frame());
            for _ in 0..4 {
                fuse_into(volume, depth_m, &mut NoStore);
            }
            found = Some((content(volume, MapSegment::FIRST), shown(volume), volume.digest()));
        });
        found.unwrap()
    };
    let (first, second) = (alone(&bumpy_depth(), 0), alone(&wall(), 4));
    assert!(first.0.keys().any(|coord| second.0.contains_key(coord)), "they share coordinates");
    assert!(!first.1.0.is_empty() && !second.1.0.is_empty());
    with_volume(&CAPACITY, &config, |volume| {
        for _ in 0..4 {
            fuse_into(volume, &bumpy_depth(), &mut NoStore);
        }
        volume.enter_segment(SECOND);
        let report = fuse_into(volume, &wall(), &mut NoStore);
        assert!(report.made > 100, "none of the first segment's is taken: {report:?}");
        for _ in 0..3 {
            fuse_into(volume, &wall(), &mut NoStore);
        }
        assert!(content(volume, MapSegment::FIRST) == first.0, "the first segment is as it was");
        assert!(content(volume, SECOND) == second.0);
        assert!(shown(volume) == second.1, "the second segment is shown, and it only");
        assert_ne!(volume.digest(), first.2.wrapping_add(second.2), "a digest tells the segment");
        volume.enter_segment(MapSegment::FIRST);
        assert!(shown(volume) == first.1);
        let mut sampler = volume.sampler();
        let at_wall = [0, 0, (3.0 / config.voxel_size_m) as i32];
        let sampled = sampler.voxel(at_wall).map(|voxel| voxel.weight);
        volume.enter_segment(SECOND);
        assert_eq!((sampled, volume.sampler().voxel(at_wall).unwrap().weight), (None, 4));
    });
}

#[test]
fn blocks_of_both_segments_are_stored_and_come_back_with_their_own() {
    let config = VolumeConfig { far_m: 6.0, ..VolumeConfig::default() };
    let mut store = MemoryStore::default();
    with_volume(&Capacity { blocks: 450, ..CAPACITY }, &config, |volume| {
        fuse_into(volume, &bumpy_depth(), &mut store);
        let first = content(volume, MapSegment::FIRST);
        assert!(store.blocks.is_empty() && first.len() > 225, "{} blocks", first.len());
        volume.enter_segment(SECOND);
        fuse_into(volume, &[0.0; WIDTH * HEIGHT], &mut store);
        let began = fuse_into(volume, &bumpy_depth(), &mut store);
        assert_eq!(began.eviction.loaded, 0, "blocks of the first segment are not loaded into it");
        let second = content(volume, SECOND);
        assert!(began.eviction.stored > 0 && began.eviction.lost == 0);
        assert!(store.blocks.keys().all(|key| key.segment == MapSegment::FIRST));
        // Back in the first segment, what left for the second one is loaded again.
        fuse_into(volume, &[0.0; WIDTH * HEIGHT], &mut store);
        volume.enter_segment(MapSegment::FIRST);
        fuse_into(volume, &[0.0; WIDTH * HEIGHT], &mut store);
        let back = fuse_into(volume, &bumpy_depth(), &mut store);
        assert!(back.eviction.loaded > 0);
        volume.stream_out(&mut store);
        let stored = |segment, coord| store.blocks.get(&BlockKey { segment, coord });
        let is_seen = |of: &Content| of.weight.iter().any(|&weight| weight > 0);
        for (coord, then) in second.iter().filter(|(_, of)| is_seen(of)) {
            assert_eq!(stored(SECOND, *coord).map(|of| &of.weight), Some(&then.weight));
        }
        // What was seen in the first segment once was seen there twice in the end, or once where no
        // ray met its block again.
        let mut twice = 0;
        for (coord, then) in first.iter().filter(|(_, of)| is_seen(of)) {
            let now = stored(MapSegment::FIRST, *coord).expect("stored");
            let both = || then.weight.iter().zip(&now.weight);
            let times = |times: u8| both().all(|(then, now)| *now == times * *then);
            assert!(times(1) || times(2), "{coord:?}");
            twice += usize::from(times(2));
        }
        assert!(2 * twice > first.len(), "{twice} of {} blocks", first.len());
    });
}

#[test]
fn without_a_store_earlier_segments_leave_last_seen_first_and_are_counted() {
    let config = VolumeConfig { far_m: 6.0, ..VolumeConfig::default() };
    with_volume(&Capacity { blocks: 450, ..CAPACITY }, &config, |volume| {
        let made = fuse_into(volume, &bumpy_depth(), &mut NoStore).made;
        volume.enter_segment(SECOND);
        assert_eq!(volume.pool().len(), made as usize, "nothing is lost where a segment begins");
        fuse_into(volume, &[0.0; WIDTH * HEIGHT], &mut NoStore);
        let began = fuse_into(volume, &bumpy_depth(), &mut NoStore);
        assert!(began.made > 225 && began.refused == 0, "there is space for all of it");
        let left = content(volume, MapSegment::FIRST).len();
        assert_eq!(began.eviction.lost + began.eviction.empty, made - left as u32);
        assert!(began.eviction.lost > 0);
    });
}
