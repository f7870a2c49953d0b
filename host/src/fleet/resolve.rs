//! One map of several epochs: what agrees is averaged, and where epochs contradict one another a
//! rule decides.
//!
//! Sums alone would blur a parked car that has left with the empty road of the day after. So each
//! epoch's sums are kept apart until here. In a voxel one epoch has a *surface* and another *free
//! space* when the first is at most 0.4 truncations behind its surface and the second at least half
//! a truncation in front of its own: a thin wall seen from both sides is no contradiction. A block
//! with at least [`CONTRADICTIONS_MIN`] such voxels has changed. Of the epochs that contradict one
//! another there, the latest that saw those voxels with a mean weight of at least
//! [`SEEN_OFTEN`] is believed, else the one with the largest weight; the others lose the voxels in which they contradict it.
//!
//! **Memory.** One block of each epoch, and what has changed.

use super::FleetError;
use super::block_sums::{BlockAverage, BlockSums, MAX_WEIGHT};
use super::merge::{TileCursor, least};
use super::tile_file::Lattice;
use super::tile_folder::{WorldTile, tiles};
use dynvox_core::volume::{BLOCK_VOXELS, BlockCoord};
use std::path::{Path, PathBuf};

/// Voxels in a block that contradict, from which on the block has changed.
pub const CONTRADICTIONS_MIN: u32 = 16;
/// Mean weight in these voxels from which on an epoch has seen them often enough.
pub const SEEN_OFTEN: u64 = 4;
/// Farthest behind a surface, as a share of the truncation, that still speaks of it.
const MAX_BEHIND: f64 = 0.4;
/// Nearest in front of a surface that is free space.
const FREE_MIN: f64 = 0.5;
/// From here on there is no surface within the truncation: less than 1, for values are averages and
/// interpolated.
const CLEAR_MIN: f64 = 0.95;
/// The value of a truncation.
const TRUNCATION: f64 = 32_767.0;

/// Change of a block between two epochs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockChange {
    /// The block.
    pub coord: BlockCoord,
    /// The epoch with a surface.
    pub surface: u32,
    /// The epoch with free space.
    pub free: u32,
    /// The epoch that is believed.
    pub believed: u32,
    /// Voxels that contradict.
    pub voxels: u32,
    /// Number of these voxels for which the epoch with free space has no surface within its
    /// truncation.
    pub clear: u32,
}

/// One block of the map that all epochs make.
pub struct ResolvedBlock {
    /// The block.
    pub coord: BlockCoord,
    /// Averages over the epochs that are believed.
    pub average: BlockAverage,
    /// True if the voxel lies on or near a surface; other voxels are known to be free.
    pub has_surface: bool,
}

/// Observation of a voxel in one epoch.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Statement {
    Nothing,
    Free,
    Surface,
    Behind,
}

/// Counts and lattice of a resolved map.
pub struct ResolvedMap {
    /// Lattice of the voxels.
    pub lattice: Lattice,
    /// Blocks that have a surface.
    pub blocks: u64,
    /// Blocks that are known to be free.
    pub free_blocks: u64,
    /// Voxels that were seen too often for their sums.
    pub overflowed: u64,
    /// Blocks that have changed between epochs.
    pub changes: Vec<BlockChange>,
}

/// Reads all blocks of a map, tile by tile, and hands each to `sink`.
///
/// # Errors
/// The folder has no tile, a tile is damaged or of other voxels, or an error of `sink`.
pub fn resolve(
    folder: &Path,
    mut sink: impl FnMut(ResolvedBlock) -> Result<(), FleetError>,
) -> Result<ResolvedMap, FleetError> {
    let files: Vec<(WorldTile, PathBuf)> = tiles(folder)?.into_iter().collect();
    let (mut lattice, mut changes) = (None, Vec::new());
    let (mut with_surface, mut free_blocks, mut overflowed) = (0, 0, 0);
    for of_tile in files.chunk_by(|a, b| a.0.sides == b.0.sides) {
        let mut heads = of_tile
            .iter()
            .map(|(_, path)| TileCursor::open(path, &mut lattice))
            .collect::<Result<Vec<_>, _>>()?;
        // Epochs of one block come together, because files are read in step.
        while let Some(coord) = least(&heads) {
            let mut blocks = Vec::new();
            for ((tile, _), head) in of_tile.iter().zip(&mut heads) {
                blocks.extend(head.take(coord)?.map(|sums| (tile.epoch, sums)));
            }
            let (block, changed) = resolve_block(coord, blocks);
            changes.extend(changed);
            overflowed += block.average.overflowed;
            *(if block.has_surface { &mut with_surface } else { &mut free_blocks }) += 1;
            sink(block)?;
        }
    }
    let lattice =
        lattice.ok_or_else(|| FleetError::content(folder, "has no tile: nothing was mapped"))?;
    Ok(ResolvedMap { lattice, blocks: with_surface, free_blocks, overflowed, changes })
}

/// One block of some epochs, ascending.
fn resolve_block(
    coord: BlockCoord,
    mut blocks: Vec<(u32, BlockSums)>,
) -> (ResolvedBlock, Vec<BlockChange>) {
    // One epoch alone has nothing to contradict.
    let changes = if blocks.len() > 1 { decide(coord, &mut blocks) } else { Vec::new() };
    let mut blocks = blocks.into_iter().map(|(_, sums)| sums);
    let mut sum = blocks.next().unwrap_or_else(|| BlockSums::zero(false));
    blocks.for_each(|other| sum.add(&other));
    let average = sum.average();
    // Nearer than the truncation: a surface passes here or close by.
    let is_near = |(sdf, weight): (&i16, &u8)| *weight > 0 && f64::from(*sdf) < 0.999 * TRUNCATION;
    let has_surface = average.sdf.iter().zip(&*average.weight).any(is_near);
    (ResolvedBlock { coord, average, has_surface }, changes)
}

/// Takes from the epochs what contradicts those that are believed.
fn decide(coord: BlockCoord, blocks: &mut [(u32, BlockSums)]) -> Vec<BlockChange> {
    let statements: Vec<Vec<Statement>> = blocks
        .iter()
        .map(|(_, sums)| (0..BLOCK_VOXELS).map(|voxel| statement(sums, voxel)).collect())
        .collect();
    let mut changes = Vec::new();
    // The latest pair first: what is taken from an epoch there contradicts nothing any more.
    for later in (1..blocks.len()).rev() {
        for earlier in (0..later).rev() {
            for (surface, free) in [(earlier, later), (later, earlier)] {
                // One epoch sees a surface where the other sees through.
                let differs = |voxel: &usize| {
                    statements[surface][*voxel] == Statement::Surface
                        && statements[free][*voxel] == Statement::Free
                };
                let seen = |of: usize, voxel: usize| blocks[of].1.weight[voxel] > 0;
                let voxels: Vec<usize> = (0..BLOCK_VOXELS)
                    .filter(differs)
                    .filter(|&v| seen(surface, v) && seen(free, v))
                    .collect();
                if (voxels.len() as u32) < CONTRADICTIONS_MIN {
                    continue;
                }
                // Weights over the contradicting voxels: what each epoch saw of them.
                let weight = |of: usize| {
                    voxels.iter().map(|&voxel| u64::from(blocks[of].1.weight[voxel])).sum::<u64>()
                };
                // The later epoch is believed unless it saw far less.
                let is_later = weight(later) >= SEEN_OFTEN * voxels.len() as u64
                    || weight(later) >= weight(earlier);
                let (believed, other) = if is_later { (later, earlier) } else { (earlier, later) };
                let change = BlockChange {
                    coord,
                    surface: blocks[surface].0,
                    free: blocks[free].0,
                    believed: blocks[believed].0,
                    voxels: voxels.len() as u32,
                    clear: voxels
                        .iter()
                        .filter(|&&voxel| share(&blocks[free].1, voxel) >= CLEAR_MIN)
                        .count() as u32,
                };
                // The other epoch loses what the believed one contradicts, and keeps the rest.
                (0..BLOCK_VOXELS)
                    .filter(|&v| contradicts(statements[other][v], statements[believed][v]))
                    .for_each(|v| clear(&mut blocks[other].1, v));
                changes.push(change);
            }
        }
    }
    changes
}

fn statement(sums: &BlockSums, voxel: usize) -> Statement {
    let weight = sums.weight[voxel];
    // Never seen, or more often than its sums can tell.
    if weight == 0 || weight > MAX_WEIGHT {
        return Statement::Nothing;
    }
    match share(sums, voxel) {
        share if share >= FREE_MIN => Statement::Free,
        share if share > 0.0 => Statement::Nothing,
        share if share >= -MAX_BEHIND => Statement::Surface,
        _ => Statement::Behind,
    }
}

/// Mean distance of a voxel that was seen, as a share of the truncation.
fn share(sums: &BlockSums, voxel: usize) -> f64 {
    f64::from(sums.distance[voxel]) / f64::from(sums.weight[voxel]) / TRUNCATION
}

fn contradicts(one: Statement, other: Statement) -> bool {
    matches!(
        (one, other),
        (Statement::Free, Statement::Surface | Statement::Behind)
            | (Statement::Surface | Statement::Behind, Statement::Free)
    )
}

fn clear(sums: &mut BlockSums, voxel: usize) {
    (sums.distance[voxel], sums.weight[voxel]) = (0, 0);
    sums.colour.iter_mut().flat_map(|planes| planes.iter_mut()).for_each(|plane| plane[voxel] = 0);
}
