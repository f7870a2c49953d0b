//! A map that outgrows its pool, with a file for the blocks that leave.

use dynvox::run::store::{BlockFile, PoolAndFile, mesh};
use dynvox_core::objects::NoSink;
use dynvox_core::view::Triangle;
use dynvox_core::volume::{BlockStore, NoStore};
use dynvox_core::{Capacity, Config, Mapper, Report, Serial, Severity};
use dynvox_tests::{Clip, HeapSlab};
use std::collections::BTreeSet;
use std::sync::LazyLock;

/// Rendered once: that takes longer than to map it.
static STREET: LazyLock<Clip> = LazyLock::new(|| Clip::street(320, 96, 40));
const VOXEL_M: f32 = 0.1;
/// Holds what is in view and some metres more.
const SMALL: Capacity = Capacity { blocks: 2_800, visible_blocks: 2_800, ..Capacity::TINY };
const LARGE: Capacity = Capacity { blocks: 40_000, ..SMALL };

fn config(clip: &Clip) -> Config {
    let mut config = clip.config();
    config.volume.voxel_size_m = VOXEL_M;
    config.volume.prune_weight = 0;
    config
}

fn file(folder: &tempfile::TempDir) -> BlockFile<std::fs::File> {
    let (file, _) = BlockFile::open(&folder.path().join("map.blocks"), VOXEL_M, 0.75)
        .expect("a fresh folder takes a file");
    file
}

/// A triangle's bits: places and colours.
type Bits = [(u32, u32, u32, [u8; 3]); 3];

fn bits(corners: [([f32; 3], [u8; 3]); 3]) -> Bits {
    corners.map(|(position_m, colour)| {
        let [x, y, z] = position_m.map(f32::to_bits);
        (x, y, z, colour)
    })
}

fn map_clip<S: BlockStore>(clip: &Clip, mapper: &mut Mapper<'_>, store: &mut S) -> Vec<Report> {
    clip.stereo()
        .map(|frame| mapper.step_with(&frame, &Serial, store, &mut NoSink).expect("a good frame"))
        .collect()
}

fn sum(reports: &[Report], of: fn(&Report) -> u32) -> u32 {
    reports.iter().map(of).sum()
}

#[test]
fn the_streamed_map_equals_the_unbounded_one_triangle_by_triangle() {
    let (clip, config) = (&*STREET, config(&STREET));
    // First with a pool that holds it all.
    let mut unbounded = Vec::new();
    let mut slab = HeapSlab::of(&LARGE);
    let mut mapper = Mapper::new(&LARGE, &config, slab.bytes()).expect("a slab that fits");
    let reports = map_clip(clip, &mut mapper, &mut NoStore);
    assert_eq!(
        sum(&reports, |report| report.allocate.eviction.lost + report.allocate.refused),
        0,
        "the large pool holds it all"
    );
    mapper.triangles(&mut |triangle| {
        unbounded.push(bits(triangle.vertices.map(|corner| (corner.position_m, corner.colour))))
    });

    // Then with a pool that must evict, and a store on disk.
    let folder = tempfile::TempDir::new().expect("a folder for the blocks");
    let (mut store, mut streamed) = (file(&folder), Vec::new());
    let mut slab = HeapSlab::of(&SMALL);
    let mut mapper = Mapper::new(&SMALL, &config, slab.bytes()).expect("a slab that fits");
    let reports = map_clip(clip, &mut mapper, &mut store);
    let evicted = sum(&reports, |report| report.allocate.eviction.stored);
    assert!(evicted > 1_000, "{evicted} blocks left: the pool is outgrown");
    assert_eq!(sum(&reports, |report| report.allocate.eviction.lost + report.allocate.refused), 0);
    // The pool's blocks where they are, joined with those on disk.
    let (mut cube, mut in_place) = (HeapSlab::of(&Capacity::TINY), Vec::new());
    let (how, memory) = ((&config.volume, &config.mesh), (cube.bytes(), false));
    let mut source = PoolAndFile::new(mapper.static_map(), &mut store);
    let count = mesh::triangles(
        &mut source,
        how,
        memory,
        &hashbrown::HashSet::new(),
        &mut |triangle: Triangle| {
            in_place.push(bits(triangle.vertices.map(|corner| (corner.position_m, corner.colour))));
        },
    );
    assert_eq!(count.ok(), Some(in_place.len() as u64));
    // Then all blocks stored, and the mesh from the disk only.
    mapper.stream_out(&mut store);
    drop(mapper);
    let count = mesh::triangles(
        &mut store,
        (&config.volume, &config.mesh),
        (slab.bytes(), false),
        &hashbrown::HashSet::new(),
        &mut |triangle: Triangle| {
            streamed.push(bits(triangle.vertices.map(|corner| (corner.position_m, corner.colour))))
        },
    );
    assert_eq!(count.ok(), Some(streamed.len() as u64));
    assert!(unbounded.len() > 50_000, "{} triangles", unbounded.len());
    assert!(
        in_place == streamed,
        "the pool's blocks where they are, and stored first, in one order"
    );
    // The order of blocks differs between the two pools; the triangles may not.
    unbounded.sort_unstable();
    streamed.sort_unstable();
    assert!(unbounded == streamed, "{} triangles against {}", unbounded.len(), streamed.len());
}

#[test]
fn a_full_disk_is_told_from_the_first_lost_block_on_and_the_drive_goes_on() {
    let (clip, config) = (&*STREET, config(&STREET));
    let folder = tempfile::TempDir::new().expect("a folder for the blocks");
    let mut store = file(&folder);
    // Enough for some blocks, and not for all.
    store.limit(300_000);
    let mut slab = HeapSlab::of(&SMALL);
    let mut mapper = Mapper::new(&SMALL, &config, slab.bytes()).expect("a slab that fits");
    let reports = map_clip(clip, &mut mapper, &mut store);
    assert!(store.failure().is_some() && store.bytes() <= 300_000);
    let kept = sum(&reports, |report| report.allocate.eviction.stored);
    assert!(kept > 0 && sum(&reports, |report| report.allocate.eviction.lost) > 0);
    assert_eq!(u64::from(kept), store.records());
    // Each frame in which a block is lost says so.
    for report in &reports {
        let harmed = report.severity() == Severity::MapAffected;
        assert_eq!(harmed, report.allocate.eviction.lost > 0, "frame {}", report.frame);
    }
    let stored: BTreeSet<_> =
        store.tiles().into_iter().flat_map(|tile| store.blocks_of(tile)).collect();
    assert!(!stored.is_empty() && stored.len() <= kept as usize, "what was kept can still be read");
}

#[test]
fn pools_of_a_few_blocks_count_every_block_they_make_and_lose() {
    let clip = Clip::street(160, 64, 12);
    for (blocks, prune_weight) in [(1, 0), (1, 1), (2, 1), (17, 0), (17, 1), (17, 3)] {
        let capacity = Capacity { blocks, history_frames: 1, ..SMALL };
        let mut config = config(&clip);
        config.volume.prune_weight = prune_weight;
        let folder = tempfile::TempDir::new().expect("a folder for the blocks");
        let mut store = file(&folder);
        let mut slab = HeapSlab::of(&capacity);
        let mut mapper = Mapper::new(&capacity, &config, slab.bytes()).expect("a slab that fits");
        let reports = map_clip(&clip, &mut mapper, &mut store);
        let pruned = mapper.finish();
        let last = reports.last().expect("frames were taken");
        // Blocks made are blocks that left or are still there: none is lost uncounted.
        let made = sum(&reports, |report| report.allocate.made);
        let left = sum(&reports, |report| {
            report.allocate.eviction.stored
                + report.allocate.eviction.empty
                + report.prune.blocks_freed
        });
        let now = mapper.static_map().pool().len() as u32;
        assert_eq!(
            made,
            left + pruned.blocks_freed + now,
            "{blocks} blocks, weight {prune_weight}"
        );
        assert!(
            last.blocks.peak as usize <= blocks
                && sum(&reports, |report| report.allocate.refused) > 0
        );
        assert_eq!(sum(&reports, |report| report.allocate.eviction.lost), 0);
        if prune_weight > 0 {
            assert!(
                sum(&reports, |report| report.prune.early) > 0,
                "a history of one frame is cut short, and says so"
            );
        }
        // A starved map can still be drawn and written.
        let mut triangles = 0;
        assert_eq!(mapper.triangles(&mut |_| triangles += 1), triangles);
        assert!(mapper.raycast(&last.t_world_camera, &Serial).is_ok());
        let out = mapper.stream_out(&mut store);
        assert_eq!((out.stored + out.empty, out.lost), (now, 0));
    }
}
