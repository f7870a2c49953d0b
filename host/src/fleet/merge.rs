//! Adding the sums of several maps, tile by tile and block by block.

use super::FleetError;
use super::block_sums::BlockSums;
use super::tile_file::{self, Lattice, TileReader};
use super::tile_folder::{WorldTile, tiles};
use crate::owned::DraftFolder;
use dynvox_core::digest::Digest;
use dynvox_core::volume::BlockCoord;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Counts of a merge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Merged {
    /// Tiles written.
    pub tiles: usize,
    /// Blocks written.
    pub blocks: u64,
    /// The voxels they share; `None` where there is no tile.
    pub lattice: Option<Lattice>,
}

/// Adds the maps in the folders `inputs` into a new folder, each epoch by itself. The result does
/// not depend on the order of the inputs, nor on how they were merged before. In memory at once is
/// one block of each input.
///
/// # Errors
/// A tile is damaged or of other voxels, the folder exists, or the disk refuses. Nothing
/// half-written stays behind.
pub fn merge(inputs: &[PathBuf], out: &Path) -> Result<Merged, FleetError> {
    if out.exists() {
        return Err(FleetError::Exists { path: out.to_path_buf() });
    }
    let folders = inputs.iter().map(|folder| tiles(folder)).collect::<Result<Vec<_>, _>>()?;
    // All tiles of all inputs, in order.
    let all: BTreeSet<WorldTile> = folders.iter().flat_map(BTreeMap::keys).copied().collect();
    let draft = DraftFolder::begin(out).map_err(FleetError::io(out))?;
    let mut merged = Merged { tiles: 0, blocks: 0, lattice: None };
    // A tile's blocks are merged as streams: one block of each input is in memory.
    for tile in all {
        let paths = folders.iter().filter_map(|folder| folder.get(&tile));
        let mut heads = paths
            .map(|path| TileCursor::open(path, &mut merged.lattice))
            .collect::<Result<Vec<_>, _>>()?;
        let Some(lattice) = merged.lattice else { continue };
        merged.blocks +=
            u64::from(tile_file::write(&draft.path().join(tile.file_name()), &lattice, || {
                next(&mut heads)
            })?);
        merged.tiles += 1;
    }
    // The folder appears under its name only when it is whole.
    draft.rename(out).map_err(FleetError::io(out))?;
    Ok(merged)
}

/// A reader and the block it stands at.
pub(super) struct TileCursor {
    reader: TileReader,
    pub(super) block: Option<(BlockCoord, BlockSums)>,
}

impl TileCursor {
    /// Opens a tile of the lattice of those before it.
    pub(super) fn open(path: &Path, lattice: &mut Option<Lattice>) -> Result<Self, FleetError> {
        let mut reader = TileReader::open(path)?;
        // The first tile states the lattice of all.
        let (found, expected) = (reader.lattice(), *lattice.get_or_insert(reader.lattice()));
        if found != expected {
            return Err(FleetError::OtherLattice { path: path.to_path_buf(), found, expected });
        }
        let block = reader.next()?;
        Ok(Self { reader, block })
    }

    /// Takes the block it stands at, if its coordinates are `coord`, and goes on to the next.
    pub(super) fn take(&mut self, coord: BlockCoord) -> Result<Option<BlockSums>, FleetError> {
        if self.block.as_ref().is_none_or(|(at, _)| *at != coord) {
            return Ok(None);
        }
        Ok(std::mem::replace(&mut self.block, self.reader.next()?).map(|(_, sums)| sums))
    }
}

/// The least coordinates at which one of the readers stands.
pub(super) fn least(heads: &[TileCursor]) -> Option<BlockCoord> {
    heads.iter().filter_map(|head| Some(head.block.as_ref()?.0)).min()
}

/// The sum of all blocks at the least coordinates.
fn next(heads: &mut [TileCursor]) -> Result<Option<(BlockCoord, BlockSums)>, FleetError> {
    let Some(coord) = least(heads) else { return Ok(None) };
    let mut sum: Option<BlockSums> = None;
    // Each map has its blocks in ascending order.
    for head in heads {
        if let Some(block) = head.take(coord)? {
            match &mut sum {
                Some(sum) => sum.add(&block),
                None => sum = Some(block),
            }
        }
    }
    Ok(sum.map(|sum| (coord, sum)))
}

/// Digest of a map: of the sums of all blocks, with their coordinates.
///
/// # Errors
/// A tile is damaged, or cannot be read.
pub fn digest(folder: &Path) -> Result<u64, FleetError> {
    let (mut digest, mut bytes) = (Digest::default(), Vec::new());
    for (tile, path) in &tiles(folder)? {
        let mut reader = TileReader::open(path)?;
        digest.u64(tile.epoch.into());
        while let Some((coord, sums)) = reader.next()? {
            digest.i16s(&[coord.x, coord.y, coord.z]);
            sums.write(&mut bytes);
            digest.bytes(&bytes);
        }
    }
    Ok(digest.finish())
}

#[cfg(test)]
mod tests {
    use super::*;
    use dynvox_core::random::Random;

    const LATTICE: Lattice = Lattice { voxel_size_m: 0.2, truncation_m: 1.0, colour: true };

    /// A map of some blocks in four tiles.
    fn map(folder: &Path, seed: u64, lattice: &Lattice) {
        let mut random = Random::new(seed);
        let mut blocks = BTreeMap::new();
        for _ in 0..6 {
            // On both sides of 0, so that the blocks lie in four tiles.
            let mut side = || random.below(8) as i16 * 10 - 40;
            let coord = BlockCoord { x: side(), y: 0, z: side() };
            let mut sums = BlockSums::zero(lattice.colour);
            for _ in 0..50 {
                let mixed = random.next_u32();
                // One random number for position, distance, weight and a colour.
                sums.observe(
                    (mixed % 512) as usize,
                    (mixed >> 16) as i16,
                    (mixed >> 8) as u8,
                    [1, 2, mixed as u8],
                );
            }
            blocks.insert((WorldTile::of(coord, lattice, (coord.x & 1) as u32), coord), sums);
        }
        std::fs::create_dir_all(folder).unwrap();
        for tile in blocks.keys().map(|(tile, _)| *tile).collect::<BTreeSet<_>>() {
            let mut own = blocks
                .iter()
                .filter(|((of, _), _)| *of == tile)
                .map(|((_, coord), sums)| (*coord, sums.clone()));
            tile_file::write(&folder.join(tile.file_name()), lattice, || Ok(own.next())).unwrap();
        }
    }

    /// Merges maps in a random tree, up to `workers` sums at once; the folder of the last one.
    fn merged_by(
        workers: usize,
        mut maps: Vec<PathBuf>,
        scratch: &Path,
        random: &mut Random,
    ) -> PathBuf {
        let mut step = 0;
        while maps.len() > 1 {
            let mut groups = Vec::new();
            for _ in 0..workers.min(maps.len() / 2) {
                // Some of those that are left, at random, become one.
                let most = (maps.len() as u32 - 1).min(8);
                let count = 2 + random.below(most) as usize;
                let chosen: Vec<_> = (0..count.min(maps.len()))
                    .map(|_| maps.swap_remove(random.below(maps.len() as u32) as usize))
                    .collect();
                groups.push((chosen, scratch.join(format!("merged-{step}"))));
                step += 1;
                if maps.len() < 2 {
                    break;
                }
            }
            std::thread::scope(|scope| {
                groups
                    .iter()
                    .for_each(|(chosen, out)| drop(scope.spawn(|| merge(chosen, out).unwrap())));
            });
            maps.extend(groups.into_iter().map(|(_, out)| out));
        }
        maps.remove(0)
    }

    #[dynvox_needs::long]
    #[test]
    fn maps_merged_in_any_order_and_tree_by_any_number_of_workers_are_one() {
        let root = tempfile::TempDir::new().unwrap();
        let path = |nth: usize| root.path().join(format!("map-{nth}"));
        for nth in 0..64 {
            map(&path(nth), nth as u64, &LATTICE);
        }
        let mut random = Random::new(77);
        let mut digests = BTreeSet::new();
        // The digest must depend on the maps alone: not on their order, the tree, or the workers.
        for count in [2, 3, 8, 64] {
            let mut expected = None;
            for trial in 0..100 {
                let scratch = tempfile::TempDir::new_in(root.path()).unwrap();
                let merged = merged_by(
                    1 + trial % 4,
                    (0..count).map(path).collect(),
                    scratch.path(),
                    &mut random,
                );
                let found = digest(&merged).unwrap();
                assert_eq!(*expected.get_or_insert(found), found, "{count} maps, trial {trial}");
            }
            digests.extend(expected);
        }
        assert_eq!(digests.len(), 4, "other maps have another digest");
    }

    #[test]
    fn other_voxels_damage_and_a_folder_that_exists_are_refused() {
        let root = tempfile::TempDir::new().unwrap();
        let path = |name: &str| root.path().join(name);
        map(&path("a"), 1, &LATTICE);
        // Voxels with and without colour have different sums.
        map(&path("b"), 2, &Lattice { colour: false, ..LATTICE });
        let both = [path("a"), path("b")];
        assert!(matches!(merge(&both, &path("out")), Err(FleetError::OtherLattice { .. })));
        assert!(matches!(merge(&both, &path("a")), Err(FleetError::Exists { .. })));
        let tile = tiles(&path("a")).unwrap().into_values().next().unwrap();
        let bytes = std::fs::read(&tile).unwrap();
        // A byte is missing at the end.
        std::fs::write(&tile, &bytes[..bytes.len() - 1]).unwrap();
        assert!(merge(&both[..1], &path("out")).unwrap_err().to_string().contains("is damaged"));
        std::fs::write(path("a").join("notes.txt"), "").unwrap();
        assert!(
            merge(&both[..1], &path("out"))
                .unwrap_err()
                .to_string()
                .contains("notes.txt is no tile")
        );
        let mut names: Vec<_> =
            root.path().read_dir().unwrap().map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, ["a", "b"], "nothing half-written");
    }
}
