//! One ray's way to the surface.

use super::{
    cell::{Corners, Field, Passage, mean, shares, within},
    eye::{AXES, Depth, Eye, Ray, depth_from_m, depth_in_m},
    signs::{Cells, Layers},
    surface::{NONE, Surface},
};
use crate::volume::{BLOCK_SIDE, BLOCK_VOXELS, Blocks};

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
    spot: Spot,
    corners: [f32; 8],
    place: [f32; 3],
    depth_m: f32,
}

/// A cell of a block in view.
#[derive(Clone, Copy)]
struct Spot {
    entry: usize,
    /// Its place in the block, `x + 32 y + 1024 z` with 8 added to each, so that a step out of the block clears the bit of 8.
    at: u32,
}

/// The bits of [`Spot::at`] that are set within the block.
const INSIDE: u32 = 8 | 8 << 5 | 8 << 10;
/// Bits per coordinate in [`Spot::at`].
const FIELD: u32 = 5;

impl Spot {
    #[inline(always)]
    fn new(entry: usize, cell: [i32; 3]) -> Self {
        let [x, y, z] = cell.map(|c| c as u32 & 7 | 8);
        Self { entry, at: x | y << FIELD | z << (2 * FIELD) }
    }

    /// The coordinate along an axis, from -1 to 8.
    #[inline(always)]
    fn coordinate(self, axis: usize) -> i32 {
        (self.at >> (FIELD * axis as u32) & 0x1F) as i32 - 8
    }

    #[inline(always)]
    fn voxel(self) -> [usize; 3] {
        [self.at & 7, self.at >> FIELD & 7, self.at >> (2 * FIELD) & 7].map(|c| c as usize)
    }

    /// Whether the cell's bit is set.
    #[inline(always)]
    fn is_in(self, layers: &Layers) -> bool {
        let layer = layers.get((self.at >> (2 * FIELD) & 7) as usize).copied().unwrap_or(0);
        layer >> ((self.at & 7) | (self.at >> (FIELD - 3) & 0x38)) & 1 == 1
    }
}

/// Sends rays through one map.
pub(super) struct Marcher<'a, 's> {
    pub surface: &'a Surface<'s>,
    pub blocks: &'a Blocks<'s>,
    pub eye: &'a Eye,
    pub min_weight: u8,
}

/// What a ray knows of the surface as it goes from cell to cell: the field where it left the last crossed cell, and the depth of that.
#[derive(Clone, Copy, Default)]
struct Trail {
    value: f32,
    depth: Depth,
}

/// How far a ray has come.
struct Progress {
    cell: [i32; 3],
    depth: Depth,
    trail: Trail,
}

/// A ray's way through one cell.
#[derive(Clone, Copy)]
struct Step {
    spot: Spot,
    cell: [i32; 3],
    from: Depth,
    to: Depth,
    /// The axis across which it leaves.
    axis: usize,
}

impl Marcher<'_, '_> {
    /// The first place between two depths at which the ray comes from seen free space through the surface.
    #[inline]
    pub fn cast(&self, u: usize, v: usize, [from_m, to_m]: [f32; 2]) -> Option<Hit> {
        let ray = self.eye.ray(u, v);
        let (from, to) = (depth_from_m(from_m), depth_from_m(to_m));
        let mut progress = Progress { cell: ray.cell_at(from), depth: from, trail: Trail::default() };
        for _ in 0..MAX_BLOCKS {
            let block = progress.cell.map(|c| c >> 3);
            if let Some(entry) = self.surface.entry(block) {
                if let Some(crossing) = self.through_block(&ray, entry, &mut progress) {
                    return (crossing.depth_m <= to_m).then(|| self.hit(&crossing));
                }
            } else {
                progress.depth = ray.leaves(block);
                progress.cell = ray.cell_at(progress.depth);
            }
            if progress.depth > to {
                return None;
            }
        }
        None
    }

    /// Walks the cells of a block, to the surface or to where the ray leaves it.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    fn through_block(&self, ray: &Ray, entry: usize, progress: &mut Progress) -> Option<Crossing> {
        let cells = self.surface.cells(entry)?;
        let base = progress.cell.map(|c| c & !7);
        let mut spot = Spot::new(entry, progress.cell);
        let next = AXES.map(|axis| ray.crossing(axis, progress.cell[axis] + ray.ahead(axis)));
        let turn = |axis: usize| ((2 * ray.ahead(axis) - 1) as u32) << (FIELD * axis as u32);
        let [turn_x, turn_y, turn_z] = [turn(0), turn(1), turn(2)];
        let [stride_x, stride_y, stride_z] = [ray.stride(0), ray.stride(1), ray.stride(2)];
        let [mut next_x, mut next_y, mut next_z] = next;
        let mut from = progress.depth;
        for _ in 0..MAX_CELLS {
            let to = next_x.min(next_y).min(next_z);
            let by_x = next_x == to;
            let by_y = next_y == to;
            if spot.is_in(&cells.crossed) && to > from {
                let cell = AXES.map(|axis| base[axis] + spot.coordinate(axis));
                let axis = if by_x { 0 } else { 2 - usize::from(by_y) };
                let step = Step { spot, cell, from, to, axis };
                if let Some(crossing) = self.through_cell(ray, step, cells, &mut progress.trail) {
                    return Some(crossing);
                }
            }
            let (add_x, add_y, add_z, turn) = if by_x {
                (stride_x, 0, 0, turn_x)
            } else if by_y {
                (0, stride_y, 0, turn_y)
            } else {
                (0, 0, stride_z, turn_z)
            };
            next_x += add_x;
            next_y += add_y;
            next_z += add_z;
            spot.at = spot.at.wrapping_add(turn);
            from = to;
            if spot.at & INSIDE != INSIDE {
                break;
            }
        }
        progress.cell = AXES.map(|axis| base[axis] + spot.coordinate(axis));
        progress.depth = from;
        None
    }

    /// Looks for the surface in a crossed cell: the field must fall from above 0 to 0 or below on the ray's way through.
    #[inline(always)]
    fn through_cell(&self, ray: &Ray, step: Step, cells: &Cells, trail: &mut Trail) -> Option<Crossing> {
        let whole = step.spot.is_in(&cells.whole);
        let last = if whole { self.wall_value(ray, step)? } else { self.guessed(ray, step)?.1 };
        // The value at a wall is taken over from the cell before: where the two disagree about it, be it by a rounding, be it about a
        // corner that one of them had to guess, no ray slips through between them.
        let first = if trail.depth == step.from { trail.value } else { self.first_value(ray, step, whole)? };
        *trail = Trail { value: last, depth: step.to };
        if first > 0.0 && last <= 0.0 { self.crossing(ray, step, whole, first, last) } else { None }
    }

    /// The field where the ray enters a cell.
    fn first_value(&self, ray: &Ray, step: Step, whole: bool) -> Option<f32> {
        let corners = if whole { self.whole_corners(step.spot)? } else { self.guessed(ray, step)?.0 };
        Some(mean(&corners, Passage::new(ray, step.cell, [step.from, step.to]).from()))
    }

    /// The corners of a cell that was not wholly seen, and the field where the ray leaves it.
    #[inline(never)]
    fn guessed(&self, ray: &Ray, step: Step) -> Option<([f32; 8], f32)> {
        let corners = self.some_corners(step.spot)?.complete()?.sdf;
        Some((corners, mean(&corners, Passage::new(ray, step.cell, [step.from, step.to]).to())))
    }

    /// The field on the wall by which the ray leaves a wholly seen cell: the mean of four corners.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3; voxels within a block lie below 512, and 74 follow where it is asked")]
    fn wall_value(&self, ray: &Ray, step: Step) -> Option<f32> {
        /// The other two axes.
        const ACROSS: [[usize; 2]; 3] = [[1, 2], [0, 2], [0, 1]];
        const STRIDE: [usize; 3] = [1, 8, 64];
        let [u, v] = ACROSS[step.axis];
        let depth_m = depth_in_m(step.to);
        let (at_u, at_v) = (within(ray, u, step.cell, depth_m), within(ray, v, step.cell, depth_m));
        let ahead = ray.ahead(step.axis) as usize;
        let [x, y, z] = step.spot.voxel();
        let [a, b, c, d] = if x < 7 && y < 7 && z < 7 {
            let slot = self.surface.slots(step.spot.entry)?[0];
            let near: &[i16; 74] = self.blocks.sdf(slot)?.get(x + 8 * y + 64 * z..)?.first_chunk()?;
            let base = ahead * STRIDE[step.axis];
            let (u, v) = (STRIDE[u], STRIDE[v]);
            [near[base], near[base + u], near[base + v], near[base + u + v]].map(f32::from)
        } else {
            let corners = self.whole_corners(step.spot)?;
            let base = ahead << step.axis;
            let (u, v) = (1 << u, 1 << v);
            [corners[base & 7], corners[(base + u) & 7], corners[(base + v) & 7], corners[(base + u + v) & 7]]
        };
        let (low, high) = (a + (b - a) * at_u, c + (d - c) * at_u);
        Some(low + (high - low) * at_v)
    }

    /// The place in a cell at which the field falls to 0.
    fn crossing(&self, ray: &Ray, step: Step, whole: bool, first: f32, last: f32) -> Option<Crossing> {
        let corners = if whole { self.whole_corners(step.spot)? } else { self.guessed(ray, step)?.0 };
        let passage = Passage::new(ray, step.cell, [step.from, step.to]);
        let share = passage.root(&Field::new(&corners), first, last);
        let [from_m, to_m] = [step.from, step.to].map(depth_in_m);
        Some(Crossing { spot: step.spot, corners, place: passage.at(share), depth_m: from_m + (to_m - from_m) * share })
    }

    /// Distances at the corners of a cell all of which were seen.
    #[inline]
    fn whole_corners(&self, spot: Spot) -> Option<[f32; 8]> {
        let [x, y, z] = spot.voxel();
        let slots = self.surface.slots(spot.entry)?;
        if x < 7 && y < 7 && z < 7 {
            let near = self.blocks.sdf(slots[0])?.get(x + 8 * y + 64 * z..)?.first_chunk::<74>()?;
            return Some([near[0], near[1], near[8], near[9], near[64], near[65], near[72], near[73]].map(f32::from));
        }
        let mut sdf = [0.0; 8];
        for (sdf, (slot, voxel)) in sdf.iter_mut().zip(places(slots, spot)) {
            *sdf = f32::from(*self.blocks.sdf(slot)?.get(voxel)?);
        }
        Some(sdf)
    }

    /// Distances at the corners of a cell that were seen.
    #[inline(never)]
    fn some_corners(&self, spot: Spot) -> Option<Corners> {
        let mut corners = Corners::default();
        for ((corner, sdf), (slot, voxel)) in corners.sdf.iter_mut().enumerate().zip(places(self.surface.slots(spot.entry)?, spot)) {
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
        let gradient = Field::new(&crossing.corners).gradient(crossing.place);
        let [right, down, forward] = self.eye.rotation.map(|row| row[0] * gradient[0] + row[1] * gradient[1] + row[2] * gradient[2]);
        let length = libm::sqrtf(right * right + down * down + forward * forward);
        let scale = if length > 0.0 { 1.0 / length } else { 0.0 };
        let (colour, weight) = self.colour(crossing);
        Hit { depth_m: crossing.depth_m, normal: [right * scale, down * scale, forward * scale], colour, weight }
    }

    /// The mean of the coloured corners, by nearness, and the weight of the nearest.
    #[inline]
    fn colour(&self, crossing: &Crossing) -> ([u8; 3], u8) {
        let Some(slots) = self.surface.slots(crossing.spot.entry) else { return ([0; 3], 0) };
        let places = places(slots, crossing.spot);
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

/// Slot and voxel of a cell's corners, given the slots around its block.
#[inline]
#[expect(clippy::indexing_slicing, reason = "the block is made of three bits")]
fn places(slots: &[u32; 8], spot: Spot) -> [(u32, usize); 8] {
    let [x, y, z] = spot.voxel();
    let mut places = [(NONE, 0); 8];
    for (corner, place) in places.iter_mut().enumerate() {
        let (x, y, z) = (x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2));
        let block = (x >> 3) | (y >> 3) << 1 | (z >> 3) << 2;
        *place = (slots[block & 7], ((x & 7) | (y & 7) << 3 | (z & 7) << 6) % BLOCK_VOXELS);
    }
    places
}
