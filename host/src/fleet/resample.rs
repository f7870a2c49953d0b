//! A run's map as sums in the world's lattice.
//!
//! Each lattice point of the world is carried into the run's map, where distance, weight and colour
//! are interpolated between the eight lattice points around it. Corners that count for at least
//! half must have been seen; for the distance at the others the plane through those that were
//! stands in. Where the lattices coincide the values are taken over as they are; elsewhere a
//! surface moves by less than a twentieth of a voxel (tests).

use super::FleetError;
use super::block_sums::BlockSums;
use super::submap::{Source, Submap, lattice_point, voxel_of};
use super::tile_file::{self, Lattice};
use super::tile_folder::WorldTile;
use crate::owned::{self, DraftFolder};
use crate::run::store::BlockFile;
use dynvox_core::geometry::Transform;
use dynvox_core::volume::{BLOCK_SIDE, BLOCK_VOXELS, BlockCoord};
use std::collections::{HashMap, VecDeque};
use std::fs::File;
use std::path::Path;

/// Blocks of the run in memory at once: 3 KiB each, 12 MiB.
const CACHED_BLOCKS: usize = 4_096;
/// Share of a voxel that rounding may move a lattice point by.
const ROUNDING: f64 = 1e-9;
/// Share of a cell, as interpolation counts its corners, that must have been seen.
const SEEN_MIN: f64 = 0.5;

/// Counts of a resampled map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resampled {
    /// Tiles written.
    pub tiles: usize,
    /// Blocks written.
    pub blocks: u64,
    /// Blocks beyond the world's coordinates, which are lost.
    pub beyond: u64,
}

/// Writes a map as sums of an epoch in the world's lattice into a new folder; `t_world_map` carries
/// the map into the world.
///
/// # Errors
/// The folder exists, a block cannot be read, or the disk refuses. Nothing half-written stays
/// behind.
pub fn resample(
    map: &mut Submap,
    epoch: u32,
    t_world_map: &Transform,
    out: &Path,
) -> Result<Resampled, FleetError> {
    if out.exists() {
        return Err(FleetError::Exists { path: out.to_path_buf() });
    }
    let lattice = &map.lattice;
    let mut source = SourceMap::new(&mut map.store, lattice.colour);
    let way = LatticeWay::new(t_world_map, lattice);
    // Blocks of the world in the order of tiles, so that each tile is written once.
    let (targets, beyond) = targets(source.store, &way, lattice, epoch);
    // The folder appears under its name only when it is whole.
    let draft = DraftFolder::begin(out).map_err(FleetError::io(out))?;
    let mut resampled = Resampled { tiles: 0, blocks: 0, beyond };
    for of_tile in targets.chunk_by(|a, b| a.0 == b.0) {
        let path = draft.path().join(of_tile[0].0.file_name());
        let mut coords = of_tile.iter().map(|(_, coord)| *coord);
        let blocks = tile_file::write(&path, lattice, || {
            Ok(coords.next().map(|coord| (coord, source.sums_at(coord, &way, lattice.colour))))
        })?;
        // A tile without any sums leaves no file.
        if blocks == 0 {
            owned::remove_file(&path).map_err(FleetError::io(&path))?;
            continue;
        }
        resampled = Resampled {
            tiles: resampled.tiles + 1,
            blocks: resampled.blocks + u64::from(blocks),
            ..resampled
        };
    }
    // A damaged block would leave a hole that looks like unknown space.
    let unreadable = source.store.unreadable();
    if unreadable > 0 {
        return Err(FleetError::content(
            out,
            format!("is not made: {unreadable} blocks of the run cannot be read"),
        ));
    }
    draft.rename(out).map_err(FleetError::io(out))?;
    Ok(resampled)
}

/// The way from the world's lattice to the run's and back, in voxels.
struct LatticeWay {
    to_map: Affine,
    to_world: Affine,
}

#[derive(Clone, Copy)]
struct Affine {
    rows: [[f64; 3]; 3],
    shift: [f64; 3],
}

impl Affine {
    fn new(transform: &Transform, voxel_size_m: f64) -> Self {
        Self {
            rows: transform.rotation_matrix(),
            shift: transform.translation_m.map(|metres| metres / voxel_size_m),
        }
    }

    fn apply(&self, p: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|row| {
            let [a, b, c] = self.rows[row];
            a * p[0] + b * p[1] + c * p[2] + self.shift[row]
        })
    }
}

impl LatticeWay {
    fn new(t_world_map: &Transform, lattice: &Lattice) -> Self {
        let voxel_size_m = f64::from(lattice.voxel_size_m);
        Self {
            to_map: Affine::new(&t_world_map.inverse(), voxel_size_m),
            to_world: Affine::new(t_world_map, voxel_size_m),
        }
    }
}

/// The blocks of the world that blocks of the run reach into, by tile; and how many lie beyond the
/// world's coordinates.
fn targets(
    store: &mut BlockFile<File>,
    way: &LatticeWay,
    lattice: &Lattice,
    epoch: u32,
) -> (Vec<(WorldTile, BlockCoord)>, u64) {
    let (mut targets, mut beyond) = (Vec::new(), 0);
    for tile in store.tiles() {
        for source in store.blocks_of(tile).into_iter().map(|key| key.coord) {
            let [low, high] = reach(source, way);
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        match BlockCoord::new(x, y, z) {
                            Some(coord) => {
                                targets.push((WorldTile::of(coord, lattice, epoch), coord))
                            }
                            None => beyond += 1,
                        }
                    }
                }
            }
        }
        // Neighbours reach into the same blocks.
        targets.sort_unstable();
        targets.dedup();
    }
    (targets, beyond)
}

/// The first and the last block of the world that a block of the run reaches into, on each axis.
fn reach(source: BlockCoord, way: &LatticeWay) -> [[i32; 3]; 2] {
    let side = BLOCK_SIDE as f64;
    let origin = [source.x, source.y, source.z].map(|c| f64::from(c) * side);
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for corner in 0..8usize {
        // Lattice points between this block and its neighbours are interpolated with both.
        let point = std::array::from_fn(|axis| {
            origin[axis] + if corner >> axis & 1 == 1 { side } else { -1.0 }
        });
        for (axis, value) in way.to_world.apply(point).into_iter().enumerate() {
            (low[axis], high[axis]) = (low[axis].min(value), high[axis].max(value));
        }
    }
    // Lattice points strictly within.
    let block = |lattice: f64| (lattice / side).floor() as i32;
    [
        low.map(|value| block((value + ROUNDING).ceil())),
        high.map(|value| block((value - ROUNDING).floor())),
    ]
}

/// The run's blocks, the last ones read in memory.
struct SourceMap<'s> {
    store: &'s mut BlockFile<File>,
    colour: bool,
    blocks: HashMap<BlockCoord, Option<Box<Source>>>,
    order: VecDeque<BlockCoord>,
}

impl<'s> SourceMap<'s> {
    fn new(store: &'s mut BlockFile<File>, colour: bool) -> Self {
        Self { store, colour, blocks: HashMap::new(), order: VecDeque::new() }
    }

    fn block(&mut self, coord: BlockCoord) -> Option<&Source> {
        // The oldest of the cached ones goes: neighbours are asked for in turn.
        if !self.blocks.contains_key(&coord) {
            if self.order.len() >= CACHED_BLOCKS
                && let Some(oldest) = self.order.pop_front()
            {
                self.blocks.remove(&oldest);
            }
            let source = Source::load(self.store, coord, self.colour);
            self.blocks.insert(coord, source);
            self.order.push_back(coord);
        }
        self.blocks.get(&coord)?.as_deref()
    }

    /// Distance, weight and colour at a lattice point of the run; `None` where it was not seen.
    fn voxel(&mut self, point: [i32; 3]) -> Option<(i16, u8, [u8; 3])> {
        let block = self.block(BlockCoord::of_lattice(point)?)?;
        let at = voxel_of(point);
        let colour = block
            .colour
            .as_ref()
            .map_or([0; 3], |planes| [planes[0][at], planes[1][at], planes[2][at]]);
        // Weight 0 was never seen.
        (block.weight[at] > 0).then_some((block.sdf[at], block.weight[at], colour))
    }

    /// The sums of a block of the world.
    fn sums_at(&mut self, coord: BlockCoord, way: &LatticeWay, colour: bool) -> BlockSums {
        let mut sums = BlockSums::zero(colour);
        for voxel in 0..BLOCK_VOXELS {
            // Each lattice point of the world, looked up in the map.
            let point = lattice_point(coord, voxel).map(f64::from);
            if let Some((sdf, weight, colour)) = self.interpolated(way.to_map.apply(point)) {
                sums.observe(voxel, sdf, weight, colour);
            }
        }
        sums
    }

    /// Distance, weight and colour at a point of the run's lattice, between its lattice points.
    fn interpolated(&mut self, point: [f64; 3]) -> Option<(i16, u8, [u8; 3])> {
        let near = point.map(f64::round);
        // A point that rounding moved off a lattice point is on it.
        let point: [f64; 3] = std::array::from_fn(|axis| {
            if (point[axis] - near[axis]).abs() < ROUNDING { near[axis] } else { point[axis] }
        });
        let low = point.map(f64::floor);
        let share: [f64; 3] = std::array::from_fn(|axis| point[axis] - low[axis]);
        let (mut sums, mut seen, mut distances) = ([0.0; 5], 0.0, [None; 8]);
        for (corner, distance) in distances.iter_mut().enumerate() {
            let factor = factor(&share, corner);
            // On a lattice point no other counts.
            if factor == 0.0 {
                continue;
            }
            let point = std::array::from_fn(|axis| low[axis] as i32 + (corner >> axis & 1) as i32);
            let Some((sdf, weight, [red, green, blue])) = self.voxel(point) else { continue };
            *distance = Some(f64::from(sdf));
            let values =
                [0.0, f64::from(weight), f64::from(red), f64::from(green), f64::from(blue)];
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += factor * value);
            // Distance, weight and colour are interpolated alike; distances separately below.
            seen += factor;
        }
        // Too much of the cell is unknown.
        if seen < SEEN_MIN {
            return None;
        }
        sums[0] = distance(&distances, &share)? * seen;
        let sums = sums.map(|sum| sum / seen);
        let [sdf, weight, red, green, blue] = sums.map(f64::round);
        let sdf = if sdf.abs() > 32_767.0 { 32_767.0f64.copysign(sdf) } else { sdf };
        Some((sdf as i16, (weight as u8).max(1), [red as u8, green as u8, blue as u8]))
    }
}

/// Returns the trilinear weight of a cell's corner.
fn factor(share: &[f64; 3], corner: usize) -> f64 {
    (0..3).fold(1.0, |product, axis| {
        product * if corner >> axis & 1 == 1 { share[axis] } else { 1.0 - share[axis] }
    })
}

/// Distance between the corners of a cell. For a corner that was not seen the plane through the
/// others stands in; `None` where they give none.
fn distance(corners: &[Option<f64>; 8], share: &[f64; 3]) -> Option<f64> {
    let counts = |corner: &usize| factor(share, *corner) > 0.0;
    // Mean steps along each axis, from the edges with both ends seen.
    let steps: [Option<f64>; 3] = std::array::from_fn(|axis| {
        let pairs = (0..8usize)
            .filter(|corner| corner >> axis & 1 == 0)
            .filter_map(|low| Some(corners[low | 1 << axis]? - corners[low]?));
        let (sum, count) = pairs.fold((0.0, 0.0), |(sum, count), step| (sum + step, count + 1.0));
        (count > 0.0).then(|| sum / count)
    });
    (0..8usize).filter(counts).try_fold(0.0, |sum, corner| {
        // Through each seen neighbour of the corner.
        let beside = |axis: usize| {
            let from = corners[corner ^ 1 << axis]?;
            Some(if corner >> axis & 1 == 1 { from + steps[axis]? } else { from - steps[axis]? })
        };
        let stand_in = || {
            let (sum, count) = (0..3)
                .filter_map(beside)
                .fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
            (count > 0.0).then(|| sum / count)
        };
        Some(sum + factor(share, corner) * corners[corner].or_else(stand_in)?)
    })
}

#[cfg(test)]
mod tests;
