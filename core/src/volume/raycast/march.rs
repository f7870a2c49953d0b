//! One ray's way to the surface.

use super::{
    cell::{Corners, Field, Passage, shares},
    eye::{Eye, Ray},
    signs::Layers,
    surface::{NONE, Surface},
};
use crate::{
    geometry::scalar::min_f32,
    volume::{BLOCK_SIDE, BLOCK_VOXELS, Blocks},
};

/// Most blocks one ray visits.
const MAX_BLOCKS: usize = 6 * super::eye::MAX_REACH_BLOCKS as usize;
/// Most cells a ray passes in one block.
const MAX_CELLS: usize = 3 * BLOCK_SIDE;

/// What a ray met.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    pub depth_m: f32,
    /// Unit normal in camera axes, towards the camera.
    pub normal: [f32; 3],
    pub colour: [u8; 3],
    /// Weight of the nearest lattice point.
    pub weight: u8,
}

/// Where on the ray the surface was met.
struct Crossing {
    entry: usize,
    /// The cell in its block.
    voxel: [usize; 3],
    field: Field,
    place: [f32; 3],
    depth_m: f32,
}

/// Sends rays through one map.
pub(super) struct Marcher<'a, 's> {
    pub surface: &'a Surface<'s>,
    pub blocks: &'a Blocks<'s>,
    pub eye: &'a Eye,
    pub min_weight: u8,
}

/// What a ray knows of the surface as it goes from cell to cell.
#[derive(Clone, Copy, Default)]
struct Trail {
    /// Whether the last crossed cell was left before the surface, and the depth at which it was left.
    before: bool,
    left_at_m: f32,
}

impl Marcher<'_, '_> {
    /// The first place between two depths at which the ray comes from seen free space through the surface.
    #[inline]
    pub fn cast(&self, u: usize, v: usize, [from_m, to_m]: [f32; 2]) -> Option<Hit> {
        let ray = self.eye.ray(u, v);
        let crossing = self.march(&ray, from_m, to_m)?;
        Some(self.hit(&crossing))
    }

    fn march(&self, ray: &Ray, from_m: f32, to_m: f32) -> Option<Crossing> {
        let mut depth_m = from_m;
        let mut cell = ray.cell_at(depth_m);
        let mut trail = Trail::default();
        for _ in 0..MAX_BLOCKS {
            let block = cell.map(|c| c >> 3);
            match self.surface.entry(block).and_then(|entry| Some((entry, self.surface.cells(entry)?))) {
                Some((entry, cells)) => {
                    if let Some(crossing) = self.through_block(ray, entry, cells, &mut cell, &mut depth_m, &mut trail) {
                        return Some(crossing);
                    }
                }
                None => {
                    depth_m = ray.leaves(block.map(|c| c * BLOCK_SIDE as i32), BLOCK_SIDE as i32);
                    cell = ray.cell_at(depth_m);
                }
            }
            if depth_m > to_m {
                return None;
            }
        }
        None
    }

    /// Walks the cells of a block; leaves `cell` and `depth_m` where the ray leaves it.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3; cell & 7 is below 8")]
    fn through_block(
        &self,
        ray: &Ray,
        entry: usize,
        cells: &Layers,
        cell: &mut [i32; 3],
        depth_m: &mut f32,
        trail: &mut Trail,
    ) -> Option<Crossing> {
        let ahead = ray.forward.map(i32::from);
        let mut next = [0, 1, 2].map(|axis| ray.crossing(axis, cell[axis] + ahead[axis]));
        let block = cell.map(|c| c >> 3);
        for _ in 0..MAX_CELLS {
            let [x, y, z] = next;
            let leaves_m = min_f32(min_f32(x, y), z);
            let voxel = cell.map(|c| (c & 7) as usize);
            if cells[voxel[2]] >> (voxel[0] + 8 * voxel[1]) & 1 == 1
                && leaves_m > *depth_m
                && let Some(crossing) = self.through_cell(ray, entry, *cell, [*depth_m, leaves_m], trail)
            {
                return Some(crossing);
            }
            let axis = if x == leaves_m { 0 } else { 1 + usize::from(y != leaves_m) };
            cell[axis] += 2 * ahead[axis] - 1;
            *depth_m = leaves_m;
            if cell[axis] >> 3 != block[axis] {
                return None;
            }
            next[axis] = ray.crossing(axis, cell[axis] + ahead[axis]);
        }
        None
    }

    /// Looks for the surface in a crossed cell.
    #[inline]
    fn through_cell(&self, ray: &Ray, entry: usize, cell: [i32; 3], depth_m: [f32; 2], trail: &mut Trail) -> Option<Crossing> {
        let voxel = cell.map(|c| (c & 7) as usize);
        let corners = self.corners(entry, voxel)?.complete()?;
        let field = Field::new(&corners.sdf);
        let passage = Passage::new(ray, cell, depth_m);
        let (first, last) = (field.at(passage.at(0.0)), field.at(passage.at(1.0)));
        let came_from_before = trail.before && trail.left_at_m == depth_m[0];
        *trail = Trail { before: last > 0.0, left_at_m: depth_m[1] };
        let share = if first > 0.0 {
            if last > 0.0 {
                return None;
            }
            passage.root(&field, first, last)
        } else if came_from_before {
            // The cells disagree by a rounding, or by a guessed corner, about their wall: the surface is the wall.
            0.0
        } else {
            return None;
        };
        let depth_m = depth_m[0] + (depth_m[1] - depth_m[0]) * share;
        Some(Crossing { entry, voxel, field, place: passage.at(share), depth_m })
    }

    /// Slot and voxel of a cell's corners.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "the block index is made of three bits")]
    fn places(&self, entry: usize, [x, y, z]: [usize; 3]) -> Option<[(u32, usize); 8]> {
        let slots = self.surface.slots(entry)?;
        let mut places = [(NONE, 0); 8];
        for (corner, place) in places.iter_mut().enumerate() {
            let (x, y, z) = (x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2));
            let block = (x >> 3) | (y >> 3) << 1 | (z >> 3) << 2;
            *place = (slots[block & 7], ((x & 7) | (y & 7) << 3 | (z & 7) << 6) % BLOCK_VOXELS);
        }
        Some(places)
    }

    #[inline]
    fn corners(&self, entry: usize, voxel: [usize; 3]) -> Option<Corners> {
        let mut corners = Corners::default();
        for ((corner, sdf), (slot, voxel)) in corners.sdf.iter_mut().enumerate().zip(self.places(entry, voxel)?) {
            if let (Some(sdfs), Some(weights)) = (self.blocks.sdf(slot), self.blocks.weight(slot))
                && let (Some(value), Some(weight)) = (sdfs.get(voxel), weights.get(voxel))
                && *weight >= self.min_weight
            {
                *sdf = f32::from(*value);
                corners.seen |= 1 << corner;
            }
        }
        Some(corners)
    }

    /// Turns a crossing into what the images keep.
    #[inline]
    fn hit(&self, crossing: &Crossing) -> Hit {
        let gradient = crossing.field.gradient(crossing.place);
        let [right, down, forward] = self.eye.rotation.map(|row| row[0] * gradient[0] + row[1] * gradient[1] + row[2] * gradient[2]);
        let length = libm::sqrtf(right * right + down * down + forward * forward);
        let scale = if length > 0.0 { 1.0 / length } else { 0.0 };
        let (colour, weight) = self.colour(crossing);
        Hit {
            depth_m: crossing.depth_m,
            normal: [right * scale, down * scale, forward * scale],
            colour,
            weight,
        }
    }

    /// The mean of the coloured corners, by nearness, and the weight of the nearest.
    #[inline]
    fn colour(&self, crossing: &Crossing) -> ([u8; 3], u8) {
        let Some(places) = self.places(crossing.entry, crossing.voxel) else { return ([0; 3], 0) };
        let mut sum = [0.0f32; 3];
        let (mut total, mut most, mut weight) = (0.0, 0.0, 0);
        for ((slot, voxel), share) in places.into_iter().zip(shares(crossing.place)) {
            let Some(&seen) = self.blocks.weight(slot).and_then(|weights| weights.get(voxel)) else { continue };
            if seen >= self.min_weight && share > most {
                (most, weight) = (share, seen);
            }
            if let Some([red, green, blue]) = self.blocks.colour(slot)
                && let (Some(&red), Some(&green), Some(&blue)) = (red.get(voxel), green.get(voxel), blue.get(voxel))
                && (red | green | blue) != 0
            {
                for (sum, channel) in sum.iter_mut().zip([red, green, blue]) {
                    *sum += share * f32::from(channel);
                }
                total += share;
            }
        }
        let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
        (sum.map(|sum| (sum * scale + 0.5) as u8), weight)
    }
}
