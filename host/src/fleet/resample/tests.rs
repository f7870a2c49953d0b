use super::*;
use crate::fleet::tile_file::TileReader;
use crate::fleet::tile_folder::tiles;
use dynvox_core::volume::{BlockKey, BlockStore, EvictedBlock, LoadedBlock};

const LATTICE: Lattice = Lattice { voxel_size_m: 0.1, truncation_m: 0.5, colour: true };
/// Units of distance in a voxel.
const UNITS: f64 = 32_767.0 / 5.0;

/// Distance of a lattice point from a plane through (2, 0, 0), in voxels: its normal leans.
fn plane(point: [f64; 3]) -> f64 {
    0.8 * (point[0] - 2.0) + 0.6 * point[2]
}

/// A map of the plane in six by six blocks, seen within four voxels.
fn map(folder: &Path) -> Submap {
    let (mut store, _) =
        BlockFile::open(&folder.join("map.blocks"), LATTICE.voxel_size_m, LATTICE.truncation_m)
            .unwrap();
    for block in 0..216 {
        let coord = BlockCoord { x: block % 6 - 3, y: block / 6 % 6 - 3, z: block / 36 - 3 };
        let (mut sdf, mut weight) = ([0; BLOCK_VOXELS], [0; BLOCK_VOXELS]);
        // A voxel's distance from the plane, in voxels.
        for at in 0..BLOCK_VOXELS {
            let offset = [at % 8, at / 8 % 8, at / 64];
            let point = std::array::from_fn(|axis| {
                f64::from([coord.x, coord.y, coord.z][axis]) * 8.0 + offset[axis] as f64
            });
            if plane(point).abs() < 4.0 {
                (sdf[at], weight[at]) = ((plane(point) * UNITS).round() as i16, 9);
            }
        }
        assert!(store.store(EvictedBlock {
            key: BlockKey::in_first(coord),
            sdf: &sdf,
            weight: &weight,
            colour: Some(&[[50; BLOCK_VOXELS]; 3])
        }));
    }
    Submap { lattice: LATTICE, store }
}

fn all_sums(folder: &Path) -> Vec<(BlockCoord, BlockSums)> {
    let mut all = Vec::new();
    for path in tiles(folder).unwrap().values() {
        let mut reader = TileReader::open(path).unwrap();
        while let Some(block) = reader.next().unwrap() {
            all.push(block);
        }
    }
    all
}

#[test]
fn lattices_that_coincide_keep_every_value() {
    let root = tempfile::TempDir::new().unwrap();
    let mut map = map(root.path());
    // Whole blocks, in the lattice's own voxel size, which is an f32.
    let shifted = Transform::from_translation([
        1.6 * f64::from(0.1f32) / 0.1,
        0.0,
        -0.8 * f64::from(0.1f32) / 0.1,
    ]);
    for (name, t_world_map, blocks) in
        [("same", Transform::IDENTITY, [0, 0, 0]), ("shifted", shifted, [2, 0, -1])]
    {
        let out = root.path().join(name);
        resample(&mut map, 0, &t_world_map, &out).unwrap();
        let all = all_sums(&out);
        assert!(all.len() > 60, "{}", all.len());
        // Block by block the source's values, shifted by whole blocks.
        for (coord, sums) in &all {
            let source = BlockCoord {
                x: coord.x - blocks[0],
                y: coord.y - blocks[1],
                z: coord.z - blocks[2],
            };
            let (mut sdf, mut weight, mut colour) =
                ([0; BLOCK_VOXELS], [0; BLOCK_VOXELS], [[0; BLOCK_VOXELS]; 3]);
            assert!(map.store.load(LoadedBlock {
                key: BlockKey::in_first(source),
                sdf: &mut sdf,
                weight: &mut weight,
                colour: Some(&mut colour)
            }));
            let average = sums.average();
            // Voxels without weight have no distance to compare.
            assert!(
                *average.weight == weight
                    && weight
                        .iter()
                        .zip(&*average.sdf)
                        .zip(&sdf)
                        .all(|((w, a), b)| *w == 0 || a == b),
                "{coord:?}"
            );
        }
    }
    assert!(matches!(resample(&mut map, 0, &shifted, root.path()), Err(FleetError::Exists { .. })));
}

#[test]
fn a_turned_map_shows_the_same_surface() {
    let root = tempfile::TempDir::new().unwrap();
    let mut map = map(root.path());
    let t_world_map = Transform::new([0.1, -0.4, 0.2], [3.03, -1.21, 0.57]);
    let out = root.path().join("turned");
    resample(&mut map, 0, &t_world_map, &out).unwrap();
    // Back into the map's lattice, where the plane is known.
    let to_map = LatticeWay::new(&t_world_map, &LATTICE).to_map;
    let (mut seen, mut worst) = (0, 0.0f64);
    for (coord, sums) in all_sums(&out) {
        let average = sums.average();
        for at in (0..BLOCK_VOXELS).filter(|at| average.weight[*at] > 0) {
            let offset = [at % 8, at / 8 % 8, at / 64];
            let point = std::array::from_fn(|axis| {
                f64::from([coord.x, coord.y, coord.z][axis]) * 8.0 + offset[axis] as f64
            });
            worst =
                worst.max((f64::from(average.sdf[at]) / UNITS - plane(to_map.apply(point))).abs());
            (seen, _) = (seen + 1, assert_eq!(average.weight[at], 9));
        }
    }
    assert!(seen > 10_000 && worst < 0.05, "{seen} voxels, {worst} of a voxel off");
}
