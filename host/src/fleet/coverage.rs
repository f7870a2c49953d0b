//! Coverage: the number of recordings that saw each block.
//!
//! **Memory.** One block of each recording, and 4 bytes for each column of blocks.

use super::FleetError;
use super::block_sums::BlockSums;
use super::merge::{TileCursor, least};
use super::tile_folder::{WorldTile, tiles};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Numbers of recordings that observed each block.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Coverage {
    /// Blocks with a surface by the number of recordings that saw one there, from one on.
    pub blocks_by_recordings: Vec<u64>,
    /// Coverage of each tile.
    pub tiles: Vec<TileCoverage>,
    /// The most recordings that saw a surface in a column of blocks, by x and z.
    #[serde(skip)]
    pub columns: BTreeMap<[i16; 2], u16>,
}

/// Coverage of one tile.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TileCoverage {
    /// Coordinates in the world, in tiles.
    pub sides: [i16; 3],
    /// Recordings that saw a surface there.
    pub recordings: usize,
    /// Blocks with a surface by the number of recordings that saw one there, from one on.
    pub blocks_by_recordings: Vec<u64>,
}

/// Counts how recordings, each a folder of sums, cover the world.
///
/// # Errors
/// A tile is damaged or of other voxels.
pub fn coverage(recordings: &[PathBuf]) -> Result<Coverage, FleetError> {
    let mut files: Vec<(WorldTile, usize, PathBuf)> = Vec::new();
    for (nth, folder) in recordings.iter().enumerate() {
        files.extend(tiles(folder)?.into_iter().map(|(tile, path)| (tile, nth, path)));
    }
    // Tiles in order, so that files of one tile come together.
    files.sort();
    let (mut coverage, mut lattice) = (Coverage::default(), None);
    for of_tile in files.chunk_by(|a, b| a.0.sides == b.0.sides) {
        let mut heads = of_tile
            .iter()
            .map(|(_, _, path)| TileCursor::open(path, &mut lattice))
            .collect::<Result<Vec<_>, _>>()?;
        let mut tile = TileCoverage {
            sides: of_tile[0].0.sides,
            recordings: 0,
            blocks_by_recordings: Vec::new(),
        };
        let mut saw = vec![false; heads.len()];
        // Blocks are merged in order, one read from each file at a time.
        while let Some(coord) = least(&heads) {
            let mut count = 0;
            for (head, saw) in heads.iter_mut().zip(&mut saw) {
                if head.take(coord)?.is_some_and(|sums| has_surface(&sums)) {
                    (count, *saw) = (count + 1, true);
                }
            }
            // No recording saw a surface there.
            let Some(last) = usize::checked_sub(count, 1) else { continue };
            for counts in [&mut tile.blocks_by_recordings, &mut coverage.blocks_by_recordings] {
                counts.resize(counts.len().max(count), 0);
                counts[last] += 1;
            }
            // A column has the recordings of its best block.
            let column = coverage.columns.entry([coord.x, coord.z]).or_default();
            *column = (*column).max(count as u16);
        }
        tile.recordings = saw.into_iter().filter(|saw| *saw).count();
        coverage.tiles.push(tile);
    }
    Ok(coverage)
}

/// Returns true if a voxel lies nearer to a surface than the truncation.
fn has_surface(sums: &BlockSums) -> bool {
    let is_near = |(distance, weight): (&i32, &u32)| {
        *weight > 0 && i64::from(*distance) < i64::from(*weight) * 32_767
    };
    sums.distance.iter().zip(&*sums.weight).any(is_near)
}
