//! One ray's way to the surface.

use super::{
    cell::{Corners, Field, Passage, mean, shares, within},
    eye::{AXES, Depth, Eye, Ray, depth_from_m, depth_in_m},
    signs::Cells,
    spot::{Spot, WALLS},
    surface::Surface,
};
use crate::volume::{BLOCK_SIDE, BLOCK_VOXELS, Blocks};

/// Most blocks one ray visits.
const MAX_BLOCKS: usize = 6 * super::eye::MAX_REACH_BLOCKS as usize;
/// Most cells a ray passes in one block.
const MAX_CELLS: usize = 3 * BLOCK_SIDE;
/// In place of an axis: within a cell, not on a wall.
const NO_AXIS: usize = 3;

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

/// Sends rays through one map.
pub(super) struct Marcher<'a, 's> {
    pub surface: &'a Surface<'s>,
    pub blocks: &'a Blocks<'s>,
    pub eye: &'a Eye,
    pub min_weight: u8,
}

/// A block that a ray is in.
#[derive(Clone, Copy)]
struct Here<'a> {
    ray: &'a Ray,
    cells: &'a Cells,
    /// The slots of the block (0) and of those after it.
    slots: &'a [u32; 8],
    /// Distances of the block.
    sdf: &'a [i16; BLOCK_VOXELS],
    /// Its first cell.
    base: [i32; 3],
}

/// A ray's way through one cell.
#[derive(Clone, Copy)]
struct Step {
    spot: Spot,
    from: Depth,
    to: Depth,
}

/// Where the surface was met.
struct Crossing<'a> {
    slots: &'a [u32; 8],
    spot: Spot,
    /// The field's gradient there.
    gradient: [f32; 3],
    /// The place in the cell.
    place: [f32; 3],
    depth_m: f32,
}

/// How far a ray has come.
struct Progress {
    cell: [i32; 3],
    depth: Depth,
    /// The axis across which the ray entered the cell, or [`NO_AXIS`].
    axis: usize,
    /// The field where the ray left the last crossed cell, and the depth of that place.
    last_value: f32,
    last_depth: Depth,
}

impl<'a> Marcher<'a, '_> {
    /// The first place between two depths at which the ray comes from seen free space through the surface.
    #[inline]
    pub fn cast(&self, u: usize, v: usize, [from_m, to_m]: [f32; 2]) -> Option<Hit> {
        let ray = self.eye.ray(u, v);
        let (from, to) = (depth_from_m(from_m), depth_from_m(to_m));
        let mut progress = Progress { cell: ray.cell_at(from), depth: from, axis: NO_AXIS, last_value: 0.0, last_depth: 0 };
        for _ in 0..MAX_BLOCKS {
            let block = progress.cell.map(|c| c >> 3);
            if let Some(entry) = self.surface.entry(block) {
                let (cells, slots) = self.surface.block(entry)?;
                let here = Here { ray: &ray, cells, slots, sdf: self.blocks.sdf(slots[0])?, base: progress.cell.map(|c| c & !7) };
                if let Some(crossing) = self.through_block(&here, &mut progress) {
                    return (crossing.depth_m <= to_m).then(|| self.hit(&crossing));
                }
            } else {
                (progress.depth, progress.axis) = ray.leaves(block);
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
    #[expect(clippy::indexing_slicing, reason = "axes are below 3; a layer is below 8")]
    fn through_block<'h>(&self, here: &Here<'h>, progress: &mut Progress) -> Option<Crossing<'h>> {
        let ray = here.ray;
        let mut spot = Spot::new(progress.cell);
        let [turn_x, turn_y, turn_z] = AXES.map(|axis| Spot::turn(axis, ray.ahead(axis)));
        let [stride_x, stride_y, stride_z] = AXES.map(|axis| ray.stride(axis));
        let [mut next_x, mut next_y, mut next_z] = AXES.map(|axis| ray.crossing(axis, progress.cell[axis] + ray.ahead(axis)));
        let (mut from, mut entered) = (progress.depth, progress.axis);
        for _ in 0..MAX_CELLS {
            let to = next_x.min(next_y).min(next_z);
            let (by_x, by_y) = (next_x == to, next_y == to);
            let axis = if by_x { 0 } else { 2 - usize::from(by_y) };
            let (layer, bit) = spot.bit();
            if here.cells[layer].crossed >> bit & 1 == 1 && to > from {
                let step = Step { spot, from, to };
                let last = self.wall_value(here, step, axis, to, ray.ahead(axis) as u32);
                if last <= 0.0 {
                    let first = self.first_value(here, step, entered, progress);
                    if first > 0.0
                        && let Some(crossing) = self.crossing(here, step, first, last)
                    {
                        return Some(crossing);
                    }
                }
                (progress.last_value, progress.last_depth) = (last, to);
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
            spot = spot.turned(turn);
            (from, entered) = (to, axis);
            if spot.is_outside() {
                break;
            }
        }
        progress.cell = AXES.map(|axis| here.base[axis] + spot.coordinate(axis));
        (progress.depth, progress.axis) = (from, entered);
        None
    }

    /// The field on a wall of a cell, lower (0) or upper (1) on an axis, where the ray passes it at `depth`: the mean of its four corners if
    /// all were seen, else that of the cell with its corners guessed.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3, the masks keep blocks below 8 and voxels below 512")]
    fn wall_value(&self, here: &Here<'_>, step: Step, axis: usize, depth: Depth, upper: u32) -> f32 {
        let wall = &WALLS[axis];
        let corner = step.spot.turned(upper * wall.turn);
        let (layer, bit) = step.spot.bit();
        let whole = here.cells[layer].whole >> bit & 1 == 1;
        let [a, b, c, d] = if whole && corner.shares_block(wall.far) {
            let slot_sdf = if corner.is_in_own_block() { Some(here.sdf) } else { self.blocks.sdf(here.slots[corner.block() & 7]) };
            let Some(sdf) = slot_sdf else { return 0.0 };
            let voxel = corner.voxel();
            [0, wall.stride_u, wall.stride_v, wall.stride_u + wall.stride_v].map(|stride| f32::from(sdf[(voxel + stride) & 511]))
        } else {
            match self.wall_corners(here, corner, axis, whole) {
                Some(corners) => corners,
                None => return self.guessed_value(here, step, depth),
            }
        };
        let depth_m = depth_in_m(depth);
        let at = |axis: usize| within(here.ray, axis, here.base[axis] + step.spot.coordinate(axis), depth_m);
        let (at_u, at_v) = (at(wall.u), at(wall.v));
        let (low, high) = (a + (b - a) * at_u, c + (d - c) * at_u);
        low + (high - low) * at_v
    }

    /// The corners of a wall that lies in several blocks or may not wholly be seen; `None` when it is not.
    #[inline(never)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3, the mask keeps blocks below 8")]
    fn wall_corners(&self, here: &Here<'_>, corner: Spot, axis: usize, whole: bool) -> Option<[f32; 4]> {
        let wall = &WALLS[axis];
        let mut corners = [0.0; 4];
        for (value, turn) in corners.iter_mut().zip([0, wall.far - wall.turn_v(), wall.turn_v(), wall.far]) {
            let point = corner.turned(turn);
            let slot = here.slots[point.block() & 7];
            if !whole && !self.is_seen(slot, point.voxel()) {
                return None;
            }
            *value = f32::from(*self.blocks.sdf(slot)?.get(point.voxel())?);
        }
        Some(corners)
    }

    /// The field where the ray enters a cell.
    #[inline(never)]
    fn first_value(&self, here: &Here<'_>, step: Step, entered: usize, progress: &Progress) -> f32 {
        if progress.last_depth == step.from {
            // Taken over from the cell before: should the two have guessed differently at a corner never seen, no ray slips through.
            progress.last_value
        } else if entered == NO_AXIS {
            self.guessed_value(here, step, step.from)
        } else {
            self.wall_value(here, step, entered, step.from, 1 - here.ray.ahead(entered) as u32)
        }
    }

    /// The field where the ray enters or leaves a cell, corners guessed where they were not seen; 0, which stops no ray, where nothing tells it.
    #[inline(never)]
    fn guessed_value(&self, here: &Here<'_>, step: Step, depth: Depth) -> f32 {
        let Some(corners) = self.corners(here, step.spot) else { return 0.0 };
        mean(&corners, self.passage(here, step).end(depth == step.to))
    }

    #[inline]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    fn passage(&self, here: &Here<'_>, step: Step) -> Passage {
        Passage::new(here.ray, AXES.map(|axis| here.base[axis] + step.spot.coordinate(axis)), [step.from, step.to])
    }

    /// The place in a cell at which the field falls to 0.
    #[inline(never)]
    fn crossing<'h>(&self, here: &Here<'h>, step: Step, first: f32, last: f32) -> Option<Crossing<'h>> {
        let field = Field::new(&self.corners(here, step.spot)?);
        let passage = self.passage(here, step);
        let share = passage.root(&field, first, last);
        let place = passage.at(share);
        let [from_m, to_m] = [step.from, step.to].map(depth_in_m);
        let depth_m = from_m + (to_m - from_m) * share;
        Some(Crossing { slots: here.slots, spot: step.spot, gradient: field.gradient(place), place, depth_m })
    }

    #[inline]
    fn is_seen(&self, slot: u32, voxel: usize) -> bool {
        self.blocks.weight(slot).and_then(|weights| weights.get(voxel)).is_some_and(|&weight| weight >= self.min_weight)
    }

    /// Distances at the corners of a cell, guessed where they were not seen.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "the masks keep layers and blocks below 8 and voxels below 512")]
    fn corners(&self, here: &Here<'_>, spot: Spot) -> Option<[f32; 8]> {
        let (layer, bit) = spot.bit();
        let whole = here.cells[layer].whole >> bit & 1 == 1;
        if whole && spot.shares_block(Spot::FAR) {
            return Some(spot.corner_voxels().map(|voxel| f32::from(here.sdf[voxel & 511])));
        }
        let mut sdf = [0.0; 8];
        let mut seen = 0;
        for (corner, (sdf, point)) in sdf.iter_mut().zip(spot.corners()).enumerate() {
            let slot = here.slots[point.block() & 7];
            if let Some(value) = self.blocks.sdf(slot).and_then(|sdfs| sdfs.get(point.voxel())) {
                *sdf = f32::from(*value);
                seen |= u8::from(whole || self.is_seen(slot, point.voxel())) << corner;
            }
        }
        if seen == u8::MAX { Some(sdf) } else { Some(Corners { sdf, seen }.complete()?.sdf) }
    }

    /// Turns a crossing into what the images keep.
    #[inline]
    fn hit(&self, crossing: &Crossing<'_>) -> Hit {
        let gradient = crossing.gradient;
        let [right, down, forward] = self.eye.rotation.map(|row| row[0] * gradient[0] + row[1] * gradient[1] + row[2] * gradient[2]);
        let length = libm::sqrtf(right * right + down * down + forward * forward);
        let scale = if length > 0.0 { 1.0 / length } else { 0.0 };
        let (colour, weight) = self.colour(crossing);
        Hit { depth_m: crossing.depth_m, normal: [right * scale, down * scale, forward * scale], colour, weight }
    }

    /// The mean of the coloured corners, by nearness in 256ths, and the weight of the nearest.
    #[inline(never)]
    #[expect(clippy::indexing_slicing, reason = "the masks keep blocks below 8 and voxels below 512")]
    fn colour(&self, crossing: &Crossing<'_>) -> ([u8; 3], u8) {
        let mut colours = Colours::default();
        let shares = shares(crossing.place).map(|share| (share * 256.0 + 0.5) as i32 as u32);
        let (spot, slots) = (crossing.spot, crossing.slots);
        let nearest = crossing.place.map(|c| u32::from(c >= 0.5));
        let nearest = spot.turned(Spot::steps(nearest));
        let weight = self.blocks.weight(slots[nearest.block() & 7]).map_or(0, |weights| weights[nearest.voxel() & 511]);
        if spot.shares_block(Spot::FAR) {
            let Some(planes) = self.blocks.colour(slots[0]) else { return ([0; 3], weight) };
            spot.corner_voxels().into_iter().zip(shares).for_each(|(voxel, share)| colours.add(planes, voxel, share));
        } else {
            for (point, share) in spot.corners().into_iter().zip(shares) {
                if let Some(planes) = self.blocks.colour(slots[point.block() & 7]) {
                    colours.add(planes, point.voxel(), share);
                }
            }
        }
        (colours.mean(), weight)
    }
}

/// Red, green and blue summed at once, 20 bits each: eight shares of 256 make sums below 2^16.
#[derive(Default)]
struct Colours {
    sum: u64,
    total: u32,
}

impl Colours {
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "the mask keeps voxels below 512")]
    fn add(&mut self, planes: &[[u8; BLOCK_VOXELS]; 3], voxel: usize, share: u32) {
        let [red, green, blue] = planes;
        let voxel = voxel & 511;
        let colour = u64::from(red[voxel]) | u64::from(green[voxel]) << 20 | u64::from(blue[voxel]) << 40;
        self.sum += colour * u64::from(share);
        // All 0 is no colour.
        self.total += if colour == 0 { 0 } else { share };
    }

    #[inline(always)]
    fn mean(&self) -> [u8; 3] {
        let half = self.total / 2;
        [0, 20, 40].map(|shift| ((self.sum >> shift) as u32 & 0xF_FFFF) + half).map(|sum| sum.checked_div(self.total).unwrap_or(0) as u8)
    }
}
