//! One ray's way to the surface.

use super::{
    cell::{Corners, Field, NO_AXIS, RaySegment, mean, within},
    cell_index::{CellFace, CellIndex, FACES},
    colour::{self, Colour},
    ray_camera::{Depth, Ray, RayCamera, depth_from_m, depth_in_m},
    surface::{NONE, Surface},
};
use crate::volume::{BLOCK_SIDE, BLOCK_VOXELS, Blocks, Slot};

/// Most blocks one ray visits.
const MAX_BLOCKS: usize = 6 * super::ray_camera::MAX_REACH_BLOCKS as usize;
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

/// Sends rays through one map.
pub(super) struct Marcher<'a, 's> {
    pub surface: &'a Surface<'s>,
    pub blocks: &'a Blocks<'s>,
    pub ray_camera: &'a RayCamera,
    pub min_weight: u8,
}

/// A block that a ray is in.
struct BlockContext<'a> {
    ray: &'a Ray,
    /// The slots of the block (0) and of those after it.
    slots: &'a [Slot; 8],
    /// Distances of the block.
    sdf: &'a [i16; BLOCK_VOXELS],
    /// Where the ray would be at depth 0, from the block's first cell.
    offset: [f32; 3],
}

impl BlockContext<'_> {
    /// Where the ray would be at depth 0, from a cell's first corner.
    #[inline(always)]
    fn offset(&self, cell: CellIndex) -> [f32; 3] {
        let [x, y, z] = self.offset;
        [x - cell.coordinate(0) as f32, y - cell.coordinate(1) as f32, z - cell.coordinate(2) as f32]
    }
}

/// A ray's way through one crossed cell.
#[derive(Clone, Copy)]
struct Step {
    cell: CellIndex,
    /// Whether all corners were seen.
    fully_observed: bool,
    from: Depth,
    to: Depth,
    /// The axes across which the ray enters, or [`NO_AXIS`], and leaves.
    axes: [usize; 2],
}

/// The field where a ray left the last crossed cell, and the depth of that point.
#[derive(Clone, Copy, Default)]
struct PreviousSample {
    value: f32,
    depth: Depth,
}

/// The cell in which a ray met the surface last: those of the pixels beside it often meet it in the same.
pub(super) struct SeenCell {
    /// The block's.
    slot: Slot,
    cell: CellIndex,
    field: Field,
    colours: [Colour; 8],
}

impl SeenCell {
    /// None yet.
    pub fn none() -> Self {
        Self {
            slot: NONE,
            cell: CellIndex::new([0; 3]),
            field: Field::new(&[0.0; 8]),
            colours: Default::default(),
        }
    }
}

/// Where the surface was met.
struct Crossing<'a> {
    slots: &'a [Slot; 8],
    cell: CellIndex,
    /// The field's gradient there.
    gradient: [f32; 3],
    /// The point within the cell.
    point: [f32; 3],
    depth_m: f32,
}

impl Marcher<'_, '_> {
    /// The first point between two depths at which the ray comes from seen free space through the surface.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "a layer is below 8, axes are below 3")]
    pub fn cast(&self, u: usize, v: usize, [from_m, to_m]: [f32; 2], seen: &mut SeenCell) -> Option<Hit> {
        let ray = &self.ray_camera.ray(u, v);
        let (mut from, last) = (depth_from_m(from_m), depth_from_m(to_m));
        let [delta_x, delta_y, delta_z] =
            [CellIndex::delta(0, ray.ahead[0]), CellIndex::delta(1, ray.ahead[1]), CellIndex::delta(2, ray.ahead[2])];
        let [stride_x, stride_y, stride_z] = [ray.stride(0), ray.stride(1), ray.stride(2)];
        let (mut block, mut cell, [mut next_x, mut next_y, mut next_z]) = begin(ray, from);
        let mut entered = NO_AXIS;
        let mut previous = PreviousSample::default();
        for _ in 0..MAX_BLOCKS {
            let Some(entry) = self.surface.entry(block) else {
                (from, entered) = ray.leaves(block);
                if from > last {
                    return None;
                }
                (block, cell, [next_x, next_y, next_z]) = begin(ray, from);
                continue;
            };
            let (cells, slots) = self.surface.block(entry)?;
            let block_context = BlockContext { ray, slots, sdf: self.blocks.sdf(slots[0])?, offset: ray.offset(block) };
            for _ in 0..MAX_CELLS {
                // Ties go to the first axis; the cells of no depth between them stop no ray.
                let (to, axis) = if next_x <= next_y {
                    if next_x <= next_z { (next_x, 0) } else { (next_z, 2) }
                } else if next_y <= next_z {
                    (next_y, 1)
                } else {
                    (next_z, 2)
                };
                let (layer, bit) = cell.bit();
                let layer = &cells[layer];
                if layer.crossed >> bit & 1 == 1 && to > from {
                    let fully_observed = layer.fully_observed >> bit & 1 == 1;
                    let step = Step { cell, fully_observed, from, to, axes: [entered, axis] };
                    if let Some(crossing) = self.through(&block_context, step, &mut previous, seen) {
                        return (crossing.depth_m <= to_m).then(|| self.hit(&crossing, seen));
                    }
                }
                match axis {
                    0 => (next_x, cell) = (next_x + stride_x, cell.plus(delta_x)),
                    1 => (next_y, cell) = (next_y + stride_y, cell.plus(delta_y)),
                    _ => (next_z, cell) = (next_z + stride_z, cell.plus(delta_z)),
                }
                (from, entered) = (to, axis);
                if cell.is_outside() {
                    break;
                }
            }
            if from > last {
                return None;
            }
            let (moved, arrived) = cell.arrived();
            block = [block[0] + moved[0], block[1] + moved[1], block[2] + moved[2]];
            cell = arrived;
        }
        None
    }

    /// Looks for the surface in a crossed cell: the field must fall from above 0 to 0 or below.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    fn through<'h>(
        &self,
        block_context: &BlockContext<'h>,
        step: Step,
        previous: &mut PreviousSample,
        seen: &mut SeenCell,
    ) -> Option<Crossing<'h>> {
        let axis = step.axes[1];
        let last = self.face_value(block_context, step, axis, step.to, block_context.ray.ahead[axis] as u32);
        let before = core::mem::replace(previous, PreviousSample { value: last, depth: step.to });
        if last > 0.0 {
            return None;
        }
        let first = self.first_value(block_context, step, before);
        if first > 0.0 { self.crossing(block_context, step, [first, last], seen) } else { None }
    }

    /// The field where the ray enters a cell.
    #[inline(never)]
    fn first_value(&self, block_context: &BlockContext<'_>, step: Step, before: PreviousSample) -> f32 {
        let axis = step.axes[0];
        if before.depth == step.from {
            // Taken over from the cell before: should the two have guessed differently at a corner never seen, no ray slips through.
            before.value
        } else if let Some(&ahead) = block_context.ray.ahead.get(axis) {
            self.face_value(block_context, step, axis, step.from, 1 - ahead as u32)
        } else {
            // It begins within the cell, on no axis' face.
            self.guessed_value(block_context, step, step.from)
        }
    }

    /// The field on a face of a cell, lower (0) or upper (1) on an axis, where the ray passes it at `depth`: the mean of its four corners. One
    /// that was not seen completes the parallelogram of the others; with fewer, the cell has to tell.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3, the masks keep blocks below 8 and voxels below 512")]
    fn face_value(&self, block_context: &BlockContext<'_>, step: Step, axis: usize, depth: Depth, upper: u32) -> f32 {
        let face = &FACES[axis];
        let corner = step.cell.plus(upper * face.delta);
        let [a, b, c, d] = if corner.shares_block(face.far) && step.fully_observed {
            let slot_sdf =
                if corner.is_in_own_block() { Some(block_context.sdf) } else { self.blocks.sdf(block_context.slots[corner.block() & 7]) };
            let Some(sdf) = slot_sdf else { return 0.0 };
            let voxel = corner.voxel();
            let value = |stride: usize| f32::from(sdf[(voxel + stride) & 511]);
            [value(0), value(face.stride_u), value(face.stride_v), value(face.stride_u + face.stride_v)]
        } else {
            match self.face_corners(block_context, corner, face, step.fully_observed) {
                Some(corners) => corners,
                None => return self.guessed_value(block_context, step, depth),
            }
        };
        let depth_m = depth_in_m(depth);
        let at =
            |axis: usize| within(block_context.offset[axis] - step.cell.coordinate(axis) as f32, block_context.ray.slope[axis], depth_m);
        let (at_u, at_v) = (at(face.u), at(face.v));
        let (low, high) = (a + (b - a) * at_u, c + (d - c) * at_u);
        low + (high - low) * at_v
    }

    /// The corners of a face that lies in several blocks or may not wholly be seen; `None` when two or more are unseen.
    #[inline(never)]
    fn face_corners(&self, block_context: &BlockContext<'_>, corner: CellIndex, face: &CellFace, fully_observed: bool) -> Option<[f32; 4]> {
        let points = [corner, corner.plus(face.far - face.delta_v), corner.plus(face.delta_v), corner.plus(face.far)];
        let [a, b, c, d] = points;
        let [a, b, c, d] = [
            self.point(block_context, a, fully_observed),
            self.point(block_context, b, fully_observed),
            self.point(block_context, c, fully_observed),
            self.point(block_context, d, fully_observed),
        ];
        completed([a, b, c, d])
    }

    /// The distance at a point, if it was seen.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "the masks keep blocks below 8 and voxels below 512")]
    fn point(&self, block_context: &BlockContext<'_>, point: CellIndex, fully_observed: bool) -> Option<f32> {
        let slot = block_context.slots[point.block() & 7];
        let voxel = point.voxel() & 511;
        let sdf = f32::from(self.blocks.sdf(slot)?[voxel]);
        (fully_observed || self.blocks.weight(slot)?[voxel] >= self.min_weight).then_some(sdf)
    }

    /// The field where the ray enters or leaves a cell, corners guessed where they were not seen; 0, which stops no ray, where nothing tells it.
    #[inline(never)]
    fn guessed_value(&self, block_context: &BlockContext<'_>, step: Step, depth: Depth) -> f32 {
        let Some(corners) = self.corners(block_context, step) else { return 0.0 };
        mean(&corners, segment(block_context, step).end(depth == step.to))
    }

    /// The point in a cell at which the field falls to 0.
    #[inline(never)]
    fn crossing<'h>(
        &self,
        block_context: &BlockContext<'h>,
        step: Step,
        [first, last]: [f32; 2],
        seen: &mut SeenCell,
    ) -> Option<Crossing<'h>> {
        let (slots, cell) = (block_context.slots, step.cell);
        if seen.slot != slots[0] || seen.cell != cell {
            let field = Field::new(&self.corners(block_context, step)?);
            *seen = SeenCell { slot: slots[0], cell, field, colours: self.corner_colours(slots, cell) };
        }
        let field = &seen.field;
        let segment = segment(block_context, step);
        let share = segment.root(field, first, last);
        let point = segment.at(share);
        let (from_m, to_m) = (depth_in_m(step.from), depth_in_m(step.to));
        let depth_m = from_m + (to_m - from_m) * share;
        Some(Crossing { slots, cell, gradient: field.gradient(point), point, depth_m })
    }

    #[inline]
    fn is_seen(&self, slot: Slot, voxel: usize) -> bool {
        self.blocks.weight(slot).and_then(|weights| weights.get(voxel)).is_some_and(|&weight| weight >= self.min_weight)
    }

    /// Distances at the corners of a cell, guessed where they were not seen.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "the mask keeps blocks below 8")]
    fn corners(&self, block_context: &BlockContext<'_>, step: Step) -> Option<[f32; 8]> {
        let in_one_block = step.cell.shares_block(CellIndex::FAR);
        if in_one_block && step.fully_observed {
            return Some(step.cell.corner_values(block_context.sdf)?.map(f32::from));
        }
        let mut corners = Corners::default();
        if in_one_block {
            let weights = step.cell.corner_values(self.blocks.weight(block_context.slots[0])?)?;
            corners.sdf = step.cell.corner_values(block_context.sdf)?.map(f32::from);
            (0..).zip(weights).for_each(|(corner, weight)| corners.observed |= u8::from(weight >= self.min_weight) << corner);
        } else {
            for (corner, (sdf, point)) in corners.sdf.iter_mut().zip(step.cell.corners()).enumerate() {
                let slot = block_context.slots[point.block() & 7];
                if let Some(value) = self.blocks.sdf(slot).and_then(|sdfs| sdfs.get(point.voxel())) {
                    *sdf = f32::from(*value);
                    corners.observed |= u8::from(step.fully_observed || self.is_seen(slot, point.voxel())) << corner;
                }
            }
        }
        if step.fully_observed { Some(corners.sdf) } else { corners.complete() }
    }

    /// Turns a crossing into what the images keep.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "the masks keep blocks below 8 and voxels below 512")]
    fn hit(&self, crossing: &Crossing<'_>, seen: &SeenCell) -> Hit {
        let gradient = crossing.gradient;
        let [right, down, forward] = self.ray_camera.rotation.map(|row| row[0] * gradient[0] + row[1] * gradient[1] + row[2] * gradient[2]);
        let length = libm::sqrtf(right * right + down * down + forward * forward);
        let scale = if length > 0.0 { 1.0 / length } else { 0.0 };
        let nearest = crossing.cell.plus(CellIndex::steps(crossing.point.map(|c| u32::from(c >= 0.5))));
        let weight = self.blocks.weight(crossing.slots[nearest.block() & 7]).map_or(0, |weights| weights[nearest.voxel() & 511]);
        Hit {
            depth_m: crossing.depth_m,
            normal: [right * scale, down * scale, forward * scale],
            colour: colour::mean(&seen.colours, crossing.point),
            weight,
        }
    }

    /// The colours at the corners of a cell.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "the masks keep blocks below 8 and voxels below 512")]
    fn corner_colours(&self, slots: &[Slot; 8], cell: CellIndex) -> [Colour; 8] {
        let mut colours = [Colour::default(); 8];
        for (colour, point) in colours.iter_mut().zip(cell.corners()) {
            if let Some([red, green, blue]) = self.blocks.colour(slots[point.block() & 7]) {
                let voxel = point.voxel() & 511;
                *colour = Colour::new([red[voxel], green[voxel], blue[voxel]]);
            }
        }
        colours
    }
}

/// The block, the cell in it, and the depths at which the cell is left, for a ray just after a depth.
#[inline]
fn begin(ray: &Ray, depth: Depth) -> ([i32; 3], CellIndex, [Depth; 3]) {
    let cell = ray.cell_at(depth);
    ([cell[0] >> 3, cell[1] >> 3, cell[2] >> 3], CellIndex::new(cell), ray.exits(cell))
}

#[inline(always)]
fn segment(block_context: &BlockContext<'_>, step: Step) -> RaySegment {
    RaySegment::new(block_context.ray, block_context.offset(step.cell), [depth_in_m(step.from), depth_in_m(step.to)], step.axes)
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
