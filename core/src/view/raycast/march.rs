//! One ray's way to the surface.

use super::{
    cell::{Corners, NO_AXIS, mean, position, within},
    cell_index::{CellIndex, Point, stride},
    colour::{self, Colours},
    hits::{Hits, RaySegment},
    ray_camera::{Depth, Ray, RayCamera, depth_from_m, depth_in_m},
    signs::Cells,
    surface::Surface,
    traversal::Traversal,
};
use crate::volume::{BLOCK_SIDE, BLOCK_VOXELS, Blocks, Slot};

/// Most blocks one ray visits.
const MAX_BLOCKS: usize = 6 * super::ray_camera::MAX_REACH_BLOCKS as usize;
/// Most cells a ray passes in one block.
const MAX_CELLS: usize = 3 * BLOCK_SIDE;

/// Sends rays through one map.
pub(super) struct Marcher<'a, 's> {
    pub surface: &'a Surface<'s>,
    pub blocks: &'a Blocks<'s>,
    pub ray_camera: &'a RayCamera,
    pub min_weight: u8,
}

/// A block that a ray is in.
struct BlockContext<'r, 'a> {
    ray: &'r Ray,
    cells: &'a Cells,
    /// The slots of the block (0) and of those after it.
    slots: &'a [Slot; 8],
    /// Distances of the block.
    sdf: &'a [i16; BLOCK_VOXELS],
    /// Where the ray would be at depth 0, from the block's first cell.
    offset: [f32; 3],
}

/// A cell of it.
#[derive(Clone, Copy)]
struct Cell {
    at: CellIndex,
    /// Whether all corners were seen.
    fully_observed: bool,
}

/// The field where a ray left the last crossed cell, and the depth of that point.
#[derive(Clone, Copy, Default)]
struct PreviousSample {
    value: f32,
    depth: Depth,
}

/// What comes of a cell.
enum Outcome {
    /// The ray meets the surface.
    Meets,
    /// It goes on to the next block.
    Leaves,
    /// It goes on in this block.
    Stays,
}

impl BlockContext<'_, '_> {
    /// Where the ray would be at depth 0, along one axis from a cell's first corner.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    fn offset(&self, cell: CellIndex, axis: usize) -> f32 {
        self.offset[axis] - cell.coordinate(axis) as f32
    }

    /// The corners of a face, lower (0) or upper (1) on an axis, of a cell whose corners all lie in the block.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3, voxels below 512")]
    fn face_corners<const AXIS: usize>(&self, cell: CellIndex, upper: u32) -> [f32; 4] {
        let [stride_u, stride_v] = beside(AXIS).map(|axis| stride(axis) as usize);
        let voxel = cell.voxel() + (upper * stride(AXIS)) as usize;
        let value = |steps: usize| f32::from(self.sdf[(voxel + steps) & (BLOCK_VOXELS - 1)]);
        [value(0), value(stride_u), value(stride_v), value(stride_u + stride_v)]
    }

    /// The mean of a face's corners where the ray passes it at a depth.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    fn mean<const AXIS: usize>(&self, cell: CellIndex, [a, b, c, d]: [f32; 4], depth: Depth) -> f32 {
        let depth_m = depth_in_m(depth);
        let [at_u, at_v] = beside(AXIS).map(|axis| within(self.offset(cell, axis), self.ray.slope[axis], depth_m));
        let (low, high) = (a + (b - a) * at_u, c + (d - c) * at_u);
        low + (high - low) * at_v
    }

    /// Where the ray is at a depth, in a cell's coordinates: on a face across an axis, lower (0) or upper (1), or within.
    #[inline(always)]
    fn position(&self, cell: CellIndex, depth: Depth, axis: usize, upper: u32) -> [f32; 3] {
        position(self.ray, [self.offset(cell, 0), self.offset(cell, 1), self.offset(cell, 2)], depth_in_m(depth), axis, upper)
    }
}

/// The other axes.
#[inline(always)]
const fn beside(axis: usize) -> [usize; 2] {
    [if axis == 0 { 1 } else { 0 }, if axis == 2 { 1 } else { 2 }]
}

impl<'a> Marcher<'a, '_> {
    /// Adds the first cell between two depths in which a pixel's ray comes from seen free space through the surface, if there is one.
    #[inline]
    pub fn cast(&self, u: usize, v: usize, [from_m, to_m]: [f32; 2], hits: &mut Hits<'a>) {
        let ray = self.ray_camera.ray(u, v);
        let mut traversal = Traversal::new(&ray, depth_from_m(from_m));
        let last = depth_from_m(to_m);
        let mut previous = PreviousSample::default();
        for _ in 0..MAX_BLOCKS {
            match self.block(&traversal) {
                Some(block) => {
                    if self.through_block(&block, &mut traversal, &mut previous, hits) {
                        return hits.confirm(u, to_m);
                    }
                }
                None => traversal.leave_block(),
            }
            if traversal.entry > last {
                return;
            }
        }
    }

    /// The block that a ray is in, if cells of it are crossed.
    #[inline(always)]
    fn block<'r>(&self, traversal: &Traversal<'r>) -> Option<BlockContext<'r, 'a>> {
        let (cells, slots) = self.surface.block(self.surface.entry(traversal.block)?)?;
        let ray = traversal.ray;
        Some(BlockContext {
            ray,
            cells,
            slots,
            sdf: self.blocks.sdf(slots[0])?,
            offset: ray.offset(traversal.block),
        })
    }

    /// Follows a ray through a block, to the next one or to the surface; whether it meets it.
    #[inline(always)]
    fn through_block(
        &self,
        block: &BlockContext<'_, 'a>,
        traversal: &mut Traversal<'_>,
        previous: &mut PreviousSample,
        hits: &mut Hits<'a>,
    ) -> bool {
        for _ in 0..MAX_CELLS {
            let outcome = match traversal.axis() {
                0 => self.through_cell::<0>(block, traversal, previous, hits),
                1 => self.through_cell::<1>(block, traversal, previous, hits),
                _ => self.through_cell::<2>(block, traversal, previous, hits),
            };
            match outcome {
                Outcome::Meets => return true,
                Outcome::Leaves => return false,
                Outcome::Stays => {}
            }
        }
        false
    }

    /// Follows a ray through a cell, which it leaves across an axis.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "a layer is below 8")]
    fn through_cell<const AXIS: usize>(
        &self,
        block: &BlockContext<'_, 'a>,
        traversal: &mut Traversal<'_>,
        previous: &mut PreviousSample,
        hits: &mut Hits<'a>,
    ) -> Outcome {
        let (layer, bit) = traversal.cell.bit();
        let layer = &block.cells[layer];
        let exit = traversal.exit::<AXIS>();
        if layer.crossed >> bit & 1 == 1 && exit > traversal.entry {
            let cell = Cell { at: traversal.cell, fully_observed: layer.fully_observed >> bit & 1 == 1 };
            let upper = u32::from(block.ray.is_ahead(AXIS));
            let last = if cell.fully_observed && cell.at.is_inner() {
                let corners = block.face_corners::<AXIS>(cell.at, upper);
                block.mean::<AXIS>(cell.at, corners, exit)
            } else {
                self.face_value::<AXIS>(block, cell, exit, upper)
            };
            let before = core::mem::replace(previous, PreviousSample { value: last, depth: exit });
            if last <= 0.0 && self.meets(block, cell, [(traversal.entry, traversal.entered), (exit, AXIS)], before, last, hits) {
                return Outcome::Meets;
            }
        }
        if traversal.step::<AXIS>() { Outcome::Leaves } else { Outcome::Stays }
    }

    /// Adds a cell that the ray enters and leaves at depths across axes, if the field falls from above 0 to `last`; whether it does.
    #[inline(never)]
    fn meets(
        &self,
        block: &BlockContext<'_, 'a>,
        cell: Cell,
        [(from, entered), (to, left)]: [(Depth, usize); 2],
        before: PreviousSample,
        last: f32,
        hits: &mut Hits<'a>,
    ) -> bool {
        let upper = |axis: usize, leaves: bool| u32::from(block.ray.is_ahead(axis) == leaves);
        let first = match entered {
            // Taken over from the cell before: should the two have guessed differently at a corner never seen, no ray slips through.
            _ if before.depth == from => before.value,
            0 => self.face_value::<0>(block, cell, from, upper(0, false)),
            1 => self.face_value::<1>(block, cell, from, upper(1, false)),
            2 => self.face_value::<2>(block, cell, from, upper(2, false)),
            // It begins within the cell, on no axis' face.
            _ => self.guessed_value(block, cell, from, NO_AXIS, 0),
        };
        if first <= 0.0 {
            return false;
        }
        if !hits.repeat_cell(block.slots, cell.at) {
            let Some(corners) = self.corners(block, cell) else { return false };
            hits.set_cell(block.slots, cell.at, &corners, &self.corner_colours(block.slots, cell.at));
        }
        let ends = [block.position(cell.at, from, entered, upper(entered, false)), block.position(cell.at, to, left, upper(left, true))];
        hits.set_segment(&RaySegment { ends, depths_m: [depth_in_m(from), depth_in_m(to)], values: [first, last] });
        true
    }

    /// The field on a face of a cell, lower (0) or upper (1) on an axis, where the ray passes it at `depth`: the mean of its four corners. One
    /// that was not seen completes the parallelogram of the others; with fewer, the cell has to tell.
    #[inline(never)]
    fn face_value<const AXIS: usize>(&self, block: &BlockContext<'_, '_>, cell: Cell, depth: Depth, upper: u32) -> f32 {
        let [edge_u, edge_v] = beside(AXIS).map(|axis| cell.at.edge(axis));
        let first = if upper == 1 { cell.at.first().plus(cell.at.edge(AXIS)) } else { cell.at.first() };
        let points = [first, first.plus(edge_u), first.plus(edge_v), first.plus(edge_u).plus(edge_v)];
        let [a, b, c, d] = points.map(|point| self.sdf(block, point));
        let corners = if cell.fully_observed {
            [a, b, c, d]
        } else {
            let seen = |point, sdf| self.is_seen(block, point).then_some(sdf);
            let known = [seen(points[0], a), seen(points[1], b), seen(points[2], c), seen(points[3], d)];
            match completed(known) {
                Some(corners) => corners,
                None => return self.guessed_value(block, cell, depth, AXIS, upper),
            }
        };
        block.mean::<AXIS>(cell.at, corners, depth)
    }

    /// The distance at a point; 0 where there is no block.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "blocks are below 8 and voxels below 512")]
    fn sdf(&self, block: &BlockContext<'_, '_>, point: Point) -> f32 {
        self.blocks.sdf(block.slots[point.block()]).map_or(0.0, |sdf| f32::from(sdf[point.voxel()]))
    }

    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "blocks are below 8 and voxels below 512")]
    fn is_seen(&self, block: &BlockContext<'_, '_>, point: Point) -> bool {
        let weights = self.blocks.weight(block.slots[point.block()]);
        weights.is_some_and(|weights| weights[point.voxel()] >= self.min_weight)
    }

    /// The field where the ray enters or leaves a cell, corners guessed where they were not seen; 0, which stops no ray, where nothing tells it.
    #[inline(never)]
    fn guessed_value(&self, block: &BlockContext<'_, '_>, cell: Cell, depth: Depth, axis: usize, upper: u32) -> f32 {
        self.corners(block, cell).map_or(0.0, |corners| mean(&corners, block.position(cell.at, depth, axis, upper)))
    }

    /// Distances at the corners of a cell, guessed where they were not seen.
    #[inline]
    fn corners(&self, block: &BlockContext<'_, '_>, cell: Cell) -> Option<[f32; 8]> {
        if cell.fully_observed && cell.at.is_inner() {
            return Some(cell.at.corner_values(block.sdf)?.map(f32::from));
        }
        let mut corners = Corners::default();
        if cell.at.is_inner() {
            let weights = cell.at.corner_values(self.blocks.weight(block.slots[0])?)?;
            corners.sdf = cell.at.corner_values(block.sdf)?.map(f32::from);
            (0..).zip(weights).for_each(|(corner, weight)| corners.observed |= u8::from(weight >= self.min_weight) << corner);
        } else {
            for (corner, (sdf, point)) in corners.sdf.iter_mut().zip(cell.at.corners()).enumerate() {
                *sdf = self.sdf(block, point);
                corners.observed |= u8::from(cell.fully_observed || self.is_seen(block, point)) << corner;
            }
        }
        if cell.fully_observed { Some(corners.sdf) } else { corners.complete() }
    }

    /// The colours at the corners of a cell.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "blocks are below 8 and voxels below 512")]
    fn corner_colours(&self, slots: &[Slot; 8], cell: CellIndex) -> Colours {
        let mut colours = Colours::default();
        for (words, point) in colours.as_chunks_mut::<2>().0.iter_mut().zip(cell.corners()) {
            if let Some([red, green, blue]) = self.blocks.colour(slots[point.block()]) {
                *words = colour::words([red[point.voxel()], green[point.voxel()], blue[point.voxel()]]);
            }
        }
        colours
    }
}

/// The corners a, b, c, d of a face (a and d face each other), one may follow from the others.
#[inline]
pub(super) fn completed(corners: [Option<f32>; 4]) -> Option<[f32; 4]> {
    match corners {
        [Some(a), Some(b), Some(c), Some(d)] => Some([a, b, c, d]),
        [None, Some(b), Some(c), Some(d)] => Some([b + c - d, b, c, d]),
        [Some(a), None, Some(c), Some(d)] => Some([a, a + d - c, c, d]),
        [Some(a), Some(b), None, Some(d)] => Some([a, b, a + d - b, d]),
        [Some(a), Some(b), Some(c), None] => Some([a, b, c, b + c - a]),
        _ => None,
    }
}
