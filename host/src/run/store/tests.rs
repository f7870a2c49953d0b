//! The store through wear and tear.

use super::mesh::BlockSource;
use super::{record::HEADER, *};
use dynvox_core::geometry::MapSegment;
use dynvox_core::view::{MeshConfig, Triangle};
use dynvox_core::volume::{
    BLOCK_VOXELS, BlockCoord, BlockKey, BlockStore, EvictedBlock, LoadedBlock, VolumeConfig,
};
use hashbrown::HashSet;
use std::{
    fs,
    io::{self, Cursor, Read, Seek, SeekFrom, Write},
};

struct Content {
    sdf: [i16; BLOCK_VOXELS],
    weight: [u8; BLOCK_VOXELS],
    colour: [[u8; BLOCK_VOXELS]; 3],
}

/// A block that differs with its seed in every part, and does not compress to nothing.
fn content(seed: u32) -> Content {
    let value = |i: usize, salt: u32| {
        (seed + salt).wrapping_mul(2_654_435_761).wrapping_add((i as u32).wrapping_mul(40_503)) >> 9
    };
    Content {
        sdf: std::array::from_fn(|i| value(i, 1) as i16),
        weight: std::array::from_fn(|i| value(i, 2) as u8),
        colour: std::array::from_fn(|plane| {
            std::array::from_fn(|i| value(i, plane as u32 + 3) as u8)
        }),
    }
}

/// Blocks of two segments, in turn.
fn key(i: u32) -> BlockKey {
    let segment = MapSegment::new((i % 2) as u16);
    let coord = BlockCoord::new(i as i32 / 2 - 3, -(i as i32) / 2, 7).expect("within the map");
    BlockKey { segment, coord }
}

fn store_block(store: &mut impl BlockStore, number: u32, seed: u32) -> bool {
    let content = content(seed);
    store.store(EvictedBlock {
        key: key(number),
        sdf: &content.sdf,
        weight: &content.weight,
        colour: Some(&content.colour),
    })
}

/// Returns true if block `number` is loaded with the content of `seed`.
fn is_loaded(store: &mut impl BlockStore, number: u32, seed: u32) -> bool {
    let mut back = Content {
        sdf: [0; BLOCK_VOXELS],
        weight: [0; BLOCK_VOXELS],
        colour: [[0; BLOCK_VOXELS]; 3],
    };
    let came = store.load(LoadedBlock {
        key: key(number),
        sdf: &mut back.sdf,
        weight: &mut back.weight,
        colour: Some(&mut back.colour),
    });
    let wanted = content(seed);
    came && back.sdf == wanted.sdf && back.weight == wanted.weight && back.colour == wanted.colour
}

#[test]
fn keeps_blocks_over_a_restart_and_the_newest_counts() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.blocks");
    let (mut store, opened) = BlockFile::open(&path, 0.05, 0.75).unwrap();
    assert_eq!(opened, Opened::default());
    (0..50).for_each(|i| assert!(store_block(&mut store, i, i)));
    assert!(store_block(&mut store, 7, 1_007));
    drop(store);
    let (mut store, opened) = BlockFile::open(&path, 0.05, 0.75).unwrap();
    assert_eq!(opened, Opened { records: 51, cut_bytes: 0 });
    (0..50).for_each(|i| assert!(is_loaded(&mut store, i, if i == 7 { 1_007 } else { i })));
    assert!(!is_loaded(&mut store, 99, 99), "what was never kept does not come back");
    let blocks: Vec<BlockKey> =
        store.tiles().into_iter().flat_map(|tile| store.blocks_of(tile)).collect();
    assert!(blocks.len() == 50 && (0..50).all(|i| blocks.contains(&key(i))), "each block once");
}

#[test]
fn a_block_is_read_back_with_its_segment() {
    let mut file = BlockFile::over(Cursor::new(vec![0; 16]));
    let [first, second] = [0, 1].map(MapSegment::new);
    let at = |segment| BlockKey { segment, coord: BlockCoord { x: 1, y: -2, z: 3 } };
    for (segment, weight) in [(first, 4), (second, 9)] {
        let (sdf, weight) = ([-5; BLOCK_VOXELS], [weight; BLOCK_VOXELS]);
        let key = at(segment);
        assert!(file.store(EvictedBlock { key, sdf: &sdf, weight: &weight, colour: None }));
    }
    assert_eq!(file.tiles().iter().map(|tile| tile.segment).collect::<Vec<_>>(), [first, second]);
    let loaded = |file: &mut dyn BlockStore, key| {
        let (mut sdf, mut weight) = ([0; BLOCK_VOXELS], [0; BLOCK_VOXELS]);
        let block = LoadedBlock { key, sdf: &mut sdf, weight: &mut weight, colour: None };
        file.load(block).then_some(weight[77])
    };
    let both = [first, second].map(|segment| loaded(&mut file, at(segment)));
    assert_eq!((both, loaded(&mut file, at(MapSegment::new(2)))), ([Some(4), Some(9)], None));
    // A segment read as a map of its own.
    let mut own = OneSegment::new(&mut file, second);
    let keys: Vec<_> = own.tiles().into_iter().flat_map(|tile| own.blocks_of(tile)).collect();
    assert_eq!(keys, [at(first)]);
    assert_eq!(loaded(&mut own, keys[0]), Some(9));
}

#[test]
fn a_file_of_another_version_is_refused_by_its_number() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.blocks");
    for (head, expected) in [
        (&b"dynvoxB2"[..], "a block store of version 2, this release reads version 3. Map the"),
        (b"dynvoxB2 and its records, longer than a preamble", "of version 2, this release reads"),
        (b"dynvoxB9aaaabbbb", "of version 9, this release reads version 3"),
        (b"dynvoxBB", "is not a block store"),
        (b"ply\nformat binary", "is not a block store"),
    ] {
        fs::write(&path, head).unwrap();
        let message = BlockFile::open(&path, 0.05, 0.75).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
        assert_eq!(fs::read(&path).unwrap(), head, "the file stays as it is");
    }
}

#[test]
fn opens_after_being_torn_at_every_byte_of_its_last_record() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.blocks");
    let (mut store, _) = BlockFile::open(&path, 0.05, 0.75).unwrap();
    (0..3).for_each(|i| assert!(store_block(&mut store, i, i)));
    let whole_len = store.bytes();
    assert!(store_block(&mut store, 3, 3));
    drop(store);
    let whole = fs::read(&path).unwrap();
    for torn in whole_len as usize..whole.len() {
        fs::write(&path, &whole[..torn]).unwrap();
        let (mut store, opened) = BlockFile::open(&path, 0.05, 0.75).unwrap();
        assert_eq!(opened, Opened { records: 3, cut_bytes: torn as u64 - whole_len });
        assert!(
            is_loaded(&mut store, 2, 2)
                && store_block(&mut store, 3, 3)
                && is_loaded(&mut store, 3, 3)
        );
        drop(store);
        assert_eq!(fs::read(&path).unwrap(), whole, "and goes on as if nothing had been");
    }
    for torn in 0..16 {
        fs::write(&path, &whole[..torn]).unwrap();
        assert_eq!(
            BlockFile::open(&path, 0.05, 0.75).unwrap().1,
            Opened { records: 0, cut_bytes: torn as u64 }
        );
    }
}

#[test]
fn a_flipped_bit_ends_the_store_before_its_record() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.blocks");
    let (mut store, _) = BlockFile::open(&path, 0.05, 0.75).unwrap();
    assert!(store_block(&mut store, 0, 0));
    let first = store.bytes() as usize;
    assert!(store_block(&mut store, 1, 1));
    drop(store);
    let whole = fs::read(&path).unwrap();
    for at in (first..whole.len()).step_by(97).chain(first..first + HEADER) {
        let mut damaged = whole.clone();
        damaged[at] ^= 4;
        fs::write(&path, &damaged).unwrap();
        let (mut store, opened) = BlockFile::open(&path, 0.05, 0.75).unwrap();
        assert_eq!((opened.records, store.holds(key(1))), (1, false), "byte {at}");
    }
}

#[test]
fn refuses_other_files_and_other_voxels_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.blocks");
    fs::write(&path, b"ply\nformat binary").unwrap();
    assert!(
        BlockFile::open(&path, 0.05, 0.75)
            .unwrap_err()
            .to_string()
            .contains("is not a block store")
    );
    fs::write(&path, b"ply").unwrap();
    assert!(BlockFile::open(&path, 0.05, 0.75).is_err());
    fs::remove_file(&path).unwrap();
    drop(BlockFile::open(&path, 0.05, 0.75).unwrap());
    let other = BlockFile::open(&path, 0.1, 0.75).unwrap_err().to_string();
    assert!(other.contains("0.05 m voxels") && other.contains("0.1 m"), "{other}");
}

/// A disk with limited space.
struct SmallDisk {
    bytes: Cursor<Vec<u8>>,
    space: usize,
}

impl Read for SmallDisk {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        self.bytes.read(to)
    }
}

impl Seek for SmallDisk {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.bytes.seek(to)
    }
}

impl Write for SmallDisk {
    fn write(&mut self, from: &[u8]) -> io::Result<usize> {
        let space = self.space.saturating_sub(self.bytes.position() as usize).min(from.len());
        if space == 0 {
            Err(io::ErrorKind::StorageFull.into())
        } else {
            self.bytes.write(&from[..space])
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_ends_storing_and_stored_blocks_stay() {
    let mut store = BlockFile::over(SmallDisk { bytes: Cursor::new(vec![0; 16]), space: 20_000 });
    let kept: Vec<u32> = (0..50).take_while(|&i| store_block(&mut store, i, i)).collect();
    assert!(!kept.is_empty() && kept.len() < 50);
    assert_eq!(store.failure().map(io::Error::kind), Some(io::ErrorKind::StorageFull));
    assert!(!store_block(&mut store, 60, 60), "it does not try again");
    for i in kept {
        assert!(is_loaded(&mut store, i, i));
    }
    assert_eq!(store.unreadable(), 0);
}

#[test]
fn a_store_is_reopened_at_its_mark_and_later_records_are_removed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.blocks");
    let (mut store, _) = BlockFile::open(&path, 0.05, 0.3).unwrap();
    let empty = store.position().unwrap();
    (0..5).for_each(|number| assert!(store_block(&mut store, number, number)));
    let marked = store.position().unwrap();
    assert!(store_block(&mut store, 3, 30) && store_block(&mut store, 9, 9));
    let after = store.position().unwrap();
    drop(store);
    let whole = fs::read(&path).unwrap();
    let mut store = BlockFile::reopen(&path, 0.05, 0.3, &marked).unwrap();
    assert_eq!(
        (store.records(), store.bytes(), fs::metadata(&path).unwrap().len()),
        (5, marked.bytes, marked.bytes)
    );
    assert!(is_loaded(&mut store, 3, 3) && !store.holds(key(9)));
    // Storing the same blocks again gives the same file.
    assert!(store_block(&mut store, 3, 30) && store_block(&mut store, 9, 9));
    assert_eq!(store.position().unwrap(), after);
    assert!(fs::read(&path).unwrap() == whole);
    drop(store);
    for at in (16..marked.bytes as usize).step_by(7) {
        let mut changed = whole.clone();
        changed[at] ^= 1 << (at % 8);
        fs::write(&path, &changed).unwrap();
        assert!(
            matches!(BlockFile::reopen(&path, 0.05, 0.3, &marked), Err(StoreError::Changed { .. })),
            "byte {at}"
        );
        assert!(fs::read(&path).unwrap() == changed, "it stays as it is");
    }
    fs::write(&path, &whole[..marked.bytes as usize - 1]).unwrap();
    assert!(matches!(
        BlockFile::reopen(&path, 0.05, 0.3, &marked),
        Err(StoreError::Changed { .. })
    ));
    fs::write(&path, &whole).unwrap();
    assert_eq!(BlockFile::reopen(&path, 0.05, 0.3, &empty).unwrap().records(), 0);
    fs::remove_file(&path).unwrap();
    assert!(matches!(
        BlockFile::reopen(&path, 0.05, 0.3, &marked),
        Err(StoreError::Missing { .. })
    ));
    assert!(!path.exists(), "no file is made");
}

#[test]
fn a_full_store_stays_full_when_it_is_reopened() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.blocks");
    let (mut store, _) = BlockFile::open(&path, 0.05, 0.3).unwrap();
    assert!(store_block(&mut store, 1, 1));
    store.limit(store.bytes() + 1);
    assert!(!store_block(&mut store, 2, 2));
    let (marked, failure) = (store.position().unwrap(), store.failure().unwrap().to_string());
    let mut store = BlockFile::reopen(&path, 0.05, 0.3, &marked).unwrap();
    assert!(!store_block(&mut store, 2, 2) && is_loaded(&mut store, 1, 1));
    assert_eq!(store.failure().unwrap().to_string(), failure);
}

#[test]
fn every_segment_is_in_the_mesh_and_later_ones_stand_higher() {
    let mut file = BlockFile::over(Cursor::new(vec![0; 16]));
    // A wall across the block: at another depth in the second segment.
    for (segment, wall) in [(0, 3), (1, 5)] {
        let distance = |voxel: usize| 1_000 * (wall - (voxel / 64) as i16) + 500;
        let (sdf, weight) = (std::array::from_fn(distance), [9; BLOCK_VOXELS]);
        let key = BlockKey { segment: MapSegment::new(segment), coord: BlockCoord::default() };
        assert!(file.store(EvictedBlock { key, sdf: &sdf, weight: &weight, colour: None }));
    }
    let config = VolumeConfig { voxel_size_m: 0.1, ..VolumeConfig::default() };
    let how = (&config, &MeshConfig::default());
    let mut slab = vec![0; mesh::slab_bytes(false) + 64];
    let start = slab.as_ptr().align_offset(64);
    let mut corners = Vec::new();
    let mut take = |triangle: Triangle| {
        corners.extend(triangle.vertices.map(|corner| corner.position_m));
    };
    let memory = (&mut slab[start..], false);
    mesh::triangles(&mut file, how, memory, &HashSet::new(), &mut take).unwrap();
    let (first, second) = corners.split_at(corners.len() / 2);
    assert!(first.len() >= 3 * 49, "{} corners", first.len());
    let is_at = |of: &[[f32; 3]], y: f32, z: f32| {
        of.iter().all(|at| (y..y + 0.8).contains(&at[1]) && (at[2] - z).abs() < 1e-4)
    };
    assert!(is_at(first, 0.0, 0.35) && is_at(second, -100.0, 0.55), "{corners:?}");
}
