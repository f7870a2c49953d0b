//! The signed distance of a run's map at any point, and points on its surface.
//!
//! **Memory.** 1 KiB and some bytes a block.

use super::submap::{Source, blocks, lattice_point, voxel_of};
use super::tile_file::Lattice;
use crate::run::store::BlockFile;
use dynvox_core::volume::{BLOCK_VOXELS, BlockCoord};
use hashbrown::HashMap;
use std::fs::File;

/// Distance of a voxel that was not seen.
const UNSEEN: i16 = i16::MIN;

/// Distances of a map.
pub struct DistanceField {
    blocks: HashMap<BlockCoord, Box<[i16; BLOCK_VOXELS]>>,
    /// Ascending within tiles: the table has no order.
    order: Vec<BlockCoord>,
    /// Side of a voxel, m.
    pub voxel_size_m: f64,
    /// Truncation, m.
    pub truncation_m: f64,
}

/// A point on a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Position, m.
    pub at_m: [f64; 3],
    /// Direction of free space, of length 1.
    pub normal: [f64; 3],
}

impl DistanceField {
    /// The distances of the voxels of a map with at least `min_weight`.
    pub fn of(store: &mut BlockFile<File>, lattice: &Lattice, min_weight: u8) -> Self {
        let order = blocks(store);
        let mut field = Self {
            blocks: HashMap::with_capacity(order.len()),
            order,
            voxel_size_m: lattice.voxel_size_m.into(),
            truncation_m: lattice.truncation_m.into(),
        };
        for &coord in &field.order {
            // A block that cannot be read is unknown.
            if let Some(source) = Source::load(store, coord, lattice.colour) {
                let mut sdf = Box::new([UNSEEN; BLOCK_VOXELS]);
                let seen = source
                    .sdf
                    .iter()
                    .zip(&source.weight)
                    .map(|(sdf, weight)| if *weight >= min_weight { *sdf } else { UNSEEN });
                sdf.iter_mut().zip(seen).for_each(|(to, value)| *to = value);
                field.blocks.insert(coord, sdf);
            }
        }
        field
    }

    /// Returns true if a block was observed.
    pub fn holds(&self, coord: BlockCoord) -> bool {
        self.blocks.contains_key(&coord)
    }

    /// Distance at a lattice point, in units of truncation / 32,767; `None` where it was not seen.
    pub fn voxel(&self, point: [i32; 3]) -> Option<i16> {
        let block = self.blocks.get(&BlockCoord::of_lattice(point)?)?;
        Some(block[voxel_of(point)]).filter(|sdf| *sdf != UNSEEN)
    }

    /// Distance, m, and its gradient at a point, between eight lattice points that were all seen.
    pub fn at(&self, point_m: [f64; 3]) -> Option<(f64, [f64; 3])> {
        let point = point_m.map(|metres| metres / self.voxel_size_m);
        let low = point.map(f64::floor);
        let share: [f64; 3] = std::array::from_fn(|axis| point[axis] - low[axis]);
        let first = low.map(|value| value as i32);
        let (mut distance, mut gradient) = (0.0, [0.0; 3]);
        for corner in 0..8usize {
            let ahead: [bool; 3] = std::array::from_fn(|axis| corner >> axis & 1 == 1);
            let value = f64::from(
                self.voxel(std::array::from_fn(|axis| first[axis] + i32::from(ahead[axis])))?,
            );
            let factor: [f64; 3] =
                std::array::from_fn(
                    |axis| if ahead[axis] { share[axis] } else { 1.0 - share[axis] },
                );
            // Trilinear.
            distance += value * factor[0] * factor[1] * factor[2];
            for axis in 0..3 {
                let others = factor[(axis + 1) % 3] * factor[(axis + 2) % 3];
                gradient[axis] += if ahead[axis] { value * others } else { -value * others };
            }
        }
        // Units of distance to metres, and of the gradient to metres by metre.
        let unit_m = self.truncation_m / 32_767.0;
        Some((distance * unit_m, gradient.map(|part| part * unit_m / self.voxel_size_m)))
    }

    /// Points where the distance changes its sign between two neighbouring voxels, at most `most`:
    /// of more, every second, fourth, ... is kept.
    pub fn surface(&self, most: usize) -> Vec<SurfacePoint> {
        let (mut points, mut stride, mut count) = (Vec::new(), 1usize, 0usize);
        for &coord in &self.order {
            for voxel in 0..BLOCK_VOXELS {
                let at = lattice_point(coord, voxel);
                for axis in 0..3 {
                    let Some(crossing) = self.crossing(at, axis) else { continue };
                    count += 1;
                    // The surface is thinned while it is read: memory stays bounded.
                    if !count.is_multiple_of(stride) {
                        continue;
                    }
                    points.extend(self.point(crossing));
                    if points.len() >= most.max(2) {
                        let mut nth = 0usize;
                        points.retain(|_| {
                            nth += 1;
                            nth.is_multiple_of(2)
                        });
                        stride *= 2;
                    }
                }
            }
        }
        points
    }

    /// Finds the zero crossing of the distance between a lattice point and the next along an axis,
    /// in voxels.
    fn crossing(&self, at: [i32; 3], axis: usize) -> Option<[f64; 3]> {
        let mut next = at;
        next[axis] += 1;
        let (here, there) = (f64::from(self.voxel(at)?), f64::from(self.voxel(next)?));
        // Of neighbours whose distances differ by more than two voxels at least one is no distance
        // from this surface.
        let most = 2.0 * self.voxel_size_m / self.truncation_m * 32_767.0;
        if (here > 0.0) == (there > 0.0) || (here - there).abs() > most {
            return None;
        }
        let mut point = at.map(f64::from);
        point[axis] += here / (here - there);
        Some(point)
    }

    fn point(&self, point: [f64; 3]) -> Option<SurfacePoint> {
        let at_m = point.map(|part| part * self.voxel_size_m);
        let (_, gradient) = self.at(at_m)?;
        let length = gradient.iter().map(|part| part * part).sum::<f64>().sqrt();
        (length > 0.1).then(|| SurfacePoint { at_m, normal: gradient.map(|part| part / length) })
    }
}
