//! What stands where an earlier frame saw through: surfaces of what moves, of any shape.
//!
//! A person is no rigid body, and matches on arms and legs agree on no motion. But who walks stands
//! where there was nothing. Every [`KEPT_EVERY`] frames the nearest disparity of each cell of 8 x 8
//! px is kept, two frames of them. A cell of the present frame has come if its point, seen from one
//! of these, is clearly nearer than all that was seen there and in the cells beside. Cells that lie
//! together and show enough of a surface are kept out of the static map, with what is joined to
//! them within half a metre and clear of the ground: of a person, the half that covers where the
//! other one was. So are the pixels beside them that are as far away, for the matcher widens what
//! is near.
//!
//! Unknown is never free: where a kept frame saw nothing, or not that place, it says nothing. What
//! walks away from the camera comes out of its own shadow and is not found.
//!
//! Memory: 2 bytes for each cell. Time: two projections a cell, and the pixels of one frame of
//! [`KEPT_EVERY`].

use super::lattice::CLEARANCE_M;
use crate::{
    geometry::{
        GroundPlane, StereoRig, Transform,
        scalar::{floor_i32, max_f64},
    },
    image::{DISPARITY_ONE_PX, View, ViewMut, disparity_px},
    memory::{Capacity, Carver, region_bytes},
    slices::{clipped, clipped_mut},
    state::Visitor,
};
use bytemuck::{Pod, Zeroable};

/// Side of a cell, px.
const CELL_PX: usize = 8;
/// Pixels of a cell that are read along each axis, from the first on.
const READ_EVERY: usize = 2;
/// Frames from one that is kept to the next.
const KEPT_EVERY: u64 = 8;
/// Frames kept.
const KEPT: usize = 2;
/// Least excess of a disparity over all that was seen there, px and as a share of it.
const EXCESS_PX: f64 = 0.5;
const EXCESS_SHARE: f64 = 0.06;
/// Fewest cells that lie together, and the least surface that they show, m².
const CELLS_MIN: usize = 6;
const SURFACE_MIN_M2: f64 = 0.03;
/// Largest difference of the disparities of neighbouring cells, px and as a share.
const STEP_PX: f64 = 0.5;
const STEP_SHARE: f64 = 0.06;
/// Distance beyond the cells that have come within which others belong to them, m: to the side,
/// above and below, along the depth.
const JOINED_M: [f64; 3] = [0.5, 0.5, 0.3];
/// Shares of a cell's disparity between which pixels in and beside it belong to it.
const OWN: [f64; 2] = [0.85, 1.3];

/// Cells of an image along an axis.
const fn cells(pixels: usize) -> usize {
    pixels.div_ceil(CELL_PX)
}

/// The present frame.
#[derive(Clone, Copy)]
pub(crate) struct Present<'a> {
    /// The cameras.
    pub rig: &'a StereoRig,
    /// The camera's pose.
    pub t_world_camera: &'a Transform,
    /// Disparity of the left image, 1/256 px, 0 none.
    pub disparity_q8: View<'a, u16>,
    /// The ground plane of the disparity image; `None` where it shows too little ground.
    pub ground: Option<&'a GroundPlane>,
    /// Farthest depth that is fused, m.
    pub far_m: f64,
}

/// Memory for a frame's cells, of any content.
pub(crate) struct Scratch<'m> {
    pub marks: &'m mut [u8],
    pub queue: &'m mut [u32],
}

/// A frame that is kept.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct Kept {
    /// Pose of the camera.
    t_world_camera: Transform,
    /// Frames taken since, and one; 0 without a frame.
    age: u64,
}

/// Frames that are kept. In the slab but for two slices: a mapper is moved about on the stack.
#[derive(Debug)]
pub(crate) struct SeenThrough<'s> {
    /// Nearest disparities of the frames that are kept, by cell, in whole px, rounded up; 0
    /// unknown.
    nearest_px: &'s mut [u8],
    kept: &'s mut [Kept],
}

/// Marks of cells: where what was free is filled, and of those what shows enough surface.
const FILLED: u8 = 1;
const COME: u8 = 2;

/// Cells of the largest image.
const fn most_cells(capacity: &Capacity) -> usize {
    cells(capacity.image_width) * cells(capacity.image_height)
}

impl<'s> SeenThrough<'s> {
    /// Bytes of the slab.
    pub const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<u8>(KEPT * most_cells(capacity)) + region_bytes::<Kept>(KEPT)
    }

    /// Allocates its regions.
    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self {
            nearest_px: carver.alloc("segmentation.nearest", KEPT * most_cells(capacity)),
            kept: carver.alloc("segmentation.kept", KEPT),
        }
    }

    /// Visits what outlives a frame.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { nearest_px, kept } = self;
        visitor.bytes(nearest_px);
        for Kept { t_world_camera, age } in kept.iter_mut() {
            visitor.transform(t_world_camera);
            visitor.u64(age);
        }
    }

    /// Forgets all frames, whose poses lie in a frame of reference that the camera has left.
    pub fn forget(&mut self) {
        self.kept.iter_mut().for_each(|kept| kept.age = 0);
    }

    /// Sets the depth of what has come since the frames that are kept to 0. Returns how many pixels
    /// that are.
    // Never inlined: its locals must not stay in a step's frame.
    #[inline(never)]
    pub fn remove(
        &mut self,
        present: &Present<'_>,
        scratch: Scratch<'_>,
        depth_m: &mut ViewMut<'_, f32>,
    ) -> u32 {
        let size = [present.disparity_q8.width(), present.disparity_q8.height()].map(cells);
        let Scratch { marks: come, queue } = scratch;
        let mut marks = Marks { come, queue, size };
        let removed = if self.mark(present, &mut marks) {
            marks.keep_large(present);
            marks.clear(present, depth_m)
        } else {
            0
        };
        self.keep(present, size);
        removed
    }

    /// Marks the cells that have come. Whether there are any.
    fn mark(&self, present: &Present<'_>, marks: &mut Marks<'_>) -> bool {
        let Self { nearest_px, kept } = self;
        let (come, [columns, rows]) = (&mut *marks.come, marks.size);
        // Each frame has its half of the memory.
        let half = (nearest_px.len() / KEPT).max(1);
        let mut any = false;
        clipped_mut(come, ..columns * rows).fill(0);
        let frames = nearest_px.chunks_exact(half).zip(kept.iter());
        for (nearest_px, kept) in frames.filter(|(_, kept)| kept.age > 0) {
            let t_kept_camera = kept.t_world_camera.inverse() * *present.t_world_camera;
            for (row, marks) in (0..rows).zip(come.chunks_exact_mut(columns.max(1))) {
                for (column, mark) in marks.iter_mut().enumerate() {
                    let has_come = present.point([column, row]).is_some_and(|point| {
                        let seen = t_kept_camera.transform_point(point);
                        is_free(present.rig, nearest_px, [columns, rows], seen)
                    });
                    *mark |= if has_come { FILLED } else { 0 };
                    any |= has_come;
                }
            }
        }
        any
    }

    /// Keeps the frame, if it is its turn.
    fn keep(&mut self, present: &Present<'_>, [columns, rows]: [usize; 2]) {
        let aged = self.kept.iter_mut().filter(|kept| kept.age > 0);
        aged.for_each(|kept| kept.age = kept.age.saturating_add(1));
        if self.kept.iter().any(|kept| kept.age > 0 && kept.age <= KEPT_EVERY) {
            return;
        }
        // The older one makes room, or there is room yet.
        let half = (self.nearest_px.len() / KEPT).max(1);
        let frames = self.kept.iter_mut().zip(self.nearest_px.chunks_exact_mut(half));
        let oldest = frames.max_by_key(|(kept, _)| kept.age.wrapping_sub(1));
        let Some((kept, nearest_px)) = oldest else { return };
        *kept = Kept { t_world_camera: *present.t_world_camera, age: 1 };
        let cells = clipped_mut(nearest_px, ..columns * rows);
        for (row, cells) in (0..rows).zip(cells.chunks_exact_mut(columns.max(1))) {
            for (column, cell) in cells.iter_mut().enumerate() {
                *cell = present.nearest_px([column, row]);
            }
        }
    }
}

/// Marks of a frame's cells, [`FILLED`], [`COME`] or 0, and a queue for those that are taken up.
struct Marks<'m> {
    come: &'m mut [u8],
    queue: &'m mut [u32],
    size: [usize; 2],
}

impl Marks<'_> {
    /// Marks what lies together and shows enough of a surface, and what is joined to it.
    fn keep_large(&mut self, present: &Present<'_>) {
        let [columns, rows] = self.size;
        for first in 0..columns * rows {
            if self.come.get(first) != Some(&FILLED) {
                continue;
            }
            // A cell is taken up once: while it waits in the queue its mark is 0.
            let (mut len, mut next, mut surface_m2) = (0, 0, 0.0);
            let mut extent = Extent::NOTHING;
            self.enqueue(first, 0, &mut len);
            while let Some(cell) = self.queued(len, next) {
                next += 1;
                let Some(point) = present.point(cell) else { continue };
                let side_m = CELL_PX as f64 * point[2] / present.rig.focal_px;
                surface_m2 += side_m * side_m;
                extent.add(point);
                for beside in present.joined(cell, [columns, rows]) {
                    let at = beside[1] * columns + beside[0];
                    if self.come.get(at) == Some(&FILLED) {
                        self.enqueue(at, 0, &mut len);
                    }
                }
            }
            // A few cells may be an error of the matcher, which fusion averages away.
            if len >= CELLS_MIN && surface_m2 >= SURFACE_MIN_M2 {
                self.spread(present, &extent, len);
            }
        }
    }

    /// Marks the first `len` cells of the queue, and what is joined to them.
    fn spread(&mut self, present: &Present<'_>, extent: &Extent, mut len: usize) {
        let [columns, rows] = self.size;
        for at in clipped(self.queue, ..len) {
            self.come.get_mut(*at as usize).into_iter().for_each(|mark| *mark = COME);
        }
        // Feet stand on the ground, which is no part of who walks on it.
        let is_own = |point: [f64; 3]| {
            extent.reaches(point)
                && present.ground.is_none_or(|ground| ground.above_m(point) > CLEARANCE_M)
        };
        let mut next = 0;
        while let Some(cell) = self.queued(len, next) {
            next += 1;
            for beside in present.joined(cell, [columns, rows]) {
                let at = beside[1] * columns + beside[0];
                let is_new = self.come.get(at).is_some_and(|mark| *mark != COME);
                if is_new && present.point(beside).is_some_and(is_own) {
                    self.enqueue(at, COME, &mut len);
                }
            }
        }
    }

    /// The cell at a position of a queue of that length.
    fn queued(&self, len: usize, position: usize) -> Option<[usize; 2]> {
        let [columns, _] = self.size;
        let at = *clipped(self.queue, ..len).get(position)? as usize;
        Some([at % columns.max(1), at / columns.max(1)])
    }

    /// Takes a cell up, with a mark.
    fn enqueue(&mut self, at: usize, with: u8, len: &mut usize) {
        if let (Some(mark), Some(slot)) = (self.come.get_mut(at), self.queue.get_mut(*len)) {
            (*mark, *slot) = (with, at as u32);
            *len += 1;
        }
    }

    /// Sets the depth of pixels in and beside the cells to 0. Returns how many they are.
    fn clear(&self, present: &Present<'_>, depth_m: &mut ViewMut<'_, f32>) -> u32 {
        let width = depth_m.width();
        let mut cleared = 0;
        for (v, pixels) in depth_m.pixels_mut().chunks_exact_mut(width.max(1)).enumerate() {
            for (column, pixels) in pixels.chunks_mut(CELL_PX).enumerate() {
                let cell = [column, v / CELL_PX];
                let Some([least_px, most_px]) = self.own_px(present, cell) else {
                    continue;
                };
                for (pixel, depth_m) in pixels.iter_mut().enumerate() {
                    // A pixel of the wall behind in the same cell stays.
                    let px = disparity_px(present.disparity_q8, [column * CELL_PX + pixel, v]);
                    let px = px.unwrap_or(0.0);
                    if px >= least_px && px <= most_px && *depth_m > 0.0 {
                        *depth_m = 0.0;
                        cleared += 1;
                    }
                }
            }
        }
        cleared
    }

    /// Disparities of what has come in a cell and those beside it, px; `None` where nothing has.
    fn own_px(&self, present: &Present<'_>, cell: [usize; 2]) -> Option<[f64; 2]> {
        let size = self.size;
        let has_come =
            |[column, row]: &[usize; 2]| self.come.get(row * size[0] + column) == Some(&COME);
        let here = core::iter::once(cell).chain(beside(cell, size));
        here.filter(has_come).filter_map(|cell| present.disparity_px(cell)).fold(None, |own, px| {
            let [least, most] = OWN.map(|share| share * px);
            let [least_px, most_px]: [f64; 2] = own.unwrap_or([least, most]);
            Some([if least < least_px { least } else { least_px }, max_f64(most, most_px)])
        })
    }
}

/// Box in the camera's axes about cells, m.
struct Extent {
    low_m: [f64; 3],
    high_m: [f64; 3],
}

impl Extent {
    const NOTHING: Self = Self { low_m: [f64::MAX; 3], high_m: [f64::MIN; 3] };

    fn add(&mut self, point: [f64; 3]) {
        for (at, (low, high)) in point.iter().zip(self.low_m.iter_mut().zip(&mut self.high_m)) {
            (*low, *high) = (if at < low { *at } else { *low }, max_f64(*at, *high));
        }
    }

    /// Returns true if a point may belong to the cells.
    fn reaches(&self, point: [f64; 3]) -> bool {
        let sides = self.low_m.iter().zip(&self.high_m).zip(JOINED_M);
        point
            .iter()
            .zip(sides)
            .all(|(at, ((low, high), joined_m))| (low - joined_m..=high + joined_m).contains(at))
    }
}

/// Returns true if a kept frame saw clearly farther than a point of its camera, there and beside.
fn is_free(
    rig: &StereoRig,
    nearest_px: &[u8],
    [columns, rows]: [usize; 2],
    [x, y, z]: [f64; 3],
) -> bool {
    if z <= 0.0 {
        return false;
    }
    let cell = |side: f64, center_px: f64| {
        floor_i32(((rig.focal_px * side / z + center_px) / CELL_PX as f64) as f32)
    };
    let (column, row) = (cell(x, rig.center_u_px), cell(y, rig.center_v_px));
    // Cells beside it are asked as well, so that those of the border are left out.
    let is_inside =
        column > 0 && row > 0 && (column as usize) + 1 < columns && (row as usize) + 1 < rows;
    if !is_inside {
        return false;
    }
    // Disparities in that frame: of the point, and the most that leaves the space before it free.
    let expected_px = rig.focal_px * rig.baseline_m / z;
    let most_px = expected_px * (1.0 - EXCESS_SHARE) - EXCESS_PX;
    (row as usize - 1..row as usize + 2).all(|row| {
        let first = row * columns + column as usize - 1;
        // 0 is unknown, and unknown is never free.
        clipped(nearest_px, first..first + 3).iter().all(|&px| px > 0 && f64::from(px) < most_px)
    })
}

/// The cells beside a cell.
fn beside(
    [column, row]: [usize; 2],
    [columns, rows]: [usize; 2],
) -> impl Iterator<Item = [usize; 2]> {
    let left = column.checked_sub(1).map(|column| [column, row]);
    let above = row.checked_sub(1).map(|row| [column, row]);
    let right = (column + 1 < columns).then_some([column + 1, row]);
    let below = (row + 1 < rows).then_some([column, row + 1]);
    [left, above, right, below].into_iter().flatten()
}

impl Present<'_> {
    /// The pixel in the middle of a cell, within the image.
    fn middle(&self, [column, row]: [usize; 2]) -> [usize; 2] {
        let size = [self.disparity_q8.width(), self.disparity_q8.height()];
        let [[column, width], [row, height]] = [[column, size[0]], [row, size[1]]];
        [(column, width), (row, height)]
            .map(|(cell, size)| (cell * CELL_PX + CELL_PX / 2).min(size.saturating_sub(1)))
    }

    /// Disparity in the middle of a cell, px.
    fn disparity_px(&self, cell: [usize; 2]) -> Option<f64> {
        disparity_px(self.disparity_q8, self.middle(cell))
    }

    /// The cells beside one that show the same surface.
    fn joined(
        &self,
        cell: [usize; 2],
        size: [usize; 2],
    ) -> impl Iterator<Item = [usize; 2]> + use<'_> {
        let px = self.disparity_px(cell).unwrap_or(0.0);
        beside(cell, size).filter(move |beside| {
            let step_px = STEP_PX + STEP_SHARE * px;
            self.disparity_px(*beside).is_some_and(|other| libm::fabs(other - px) < step_px)
        })
    }

    /// The point in the middle of a cell, in the camera, m, if it is near enough to be fused.
    fn point(&self, cell: [usize; 2]) -> Option<[f64; 3]> {
        let point = self.rig.pixel_point(self.middle(cell), self.disparity_px(cell)?);
        (point[2] <= self.far_m).then_some(point)
    }

    /// The nearest disparity of a cell, whole px, rounded up; 0 where half of it has none.
    fn nearest_px(&self, [column, row]: [usize; 2]) -> u8 {
        let (mut nearest_q8, mut known, mut read) = (0, 0, 0);
        for v in (row * CELL_PX..(row + 1) * CELL_PX).step_by(READ_EVERY) {
            for u in (column * CELL_PX..(column + 1) * CELL_PX).step_by(READ_EVERY) {
                let Some(q8) = self.disparity_q8.get(u, v) else { continue };
                // The outermost cells may reach beyond the image.
                read += 1;
                known += u32::from(q8 > 0);
                nearest_q8 = if q8 > nearest_q8 { q8 } else { nearest_q8 };
            }
        }
        if 2 * known < read { 0 } else { nearest_q8.div_ceil(DISPARITY_ONE_PX).min(255) as u8 }
    }
}

#[cfg(test)]
mod tests;
