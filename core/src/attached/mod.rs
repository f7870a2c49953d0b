//! Parts of the image that are attached to the camera: the car's own bonnet, a reflection in the
//! windscreen, dirt on the lens.
//!
//! The image is divided into cells. A match counts where the camera moved so far that a static
//! point would have moved by [`MOVED_PX`]: for its cell where it stays in place at one disparity,
//! against it where it moves; what stays must be near. From four frames on the cell's matches that
//! stay again have no part in the camera's motion. A cell that gathers 20 frames is attached, if
//! its neighbours stay as well, and no stage uses its pixels any more. A hole between attached
//! cells that no match speaks against belongs to them. A camera that stands counts nothing.
//!
//! Nothing is matched in an attached cell, so that its pixels decide whether it stays one: they
//! must be the same in two images, compared with their own texture.
//!
//! **Memory.** 12 bytes a cell. **Time.** A projection a match, three reads of every fourth pixel
//! of attached cells.
//!
//! **What can go wrong.** A vehicle that is near (`Match::is_near`) and keeps its distance to half
//! a pixel of disparity for so many frames, and that no detector names, is taken for a part of the
//! camera: it is unknown space then, not free. Parts without texture give no match, and are no hole
//! if they reach far.

mod cell;
#[cfg(test)]
mod tests;

use crate::{
    Capacity,
    geometry::{StereoRig, Transform},
    image::View,
    memory::{Carver, region_bytes},
    scene_flow::Match,
    state::Visitor,
};
use cell::{Cell, MatchCounts};

/// Side of a cell, px.
pub(crate) const CELL_PX: usize = 16;
/// Least way that a static point would have gone in the image and in disparity, px.
const MOVED_PX: f32 = 2.0;
/// Least way of a match that does not stay, px.
const LEFT_PX: f32 = 1.0;
/// Fewest matches that move as the camera says, so that the cells' own pixels are asked.
const MOVING_MIN: u32 = 40;
/// Neighbours that must stay as well.
const NEIGHBOURS_MIN: usize = 2;
/// Attached neighbours from which on a cell without matches is a hole between them.
const AROUND_HOLE: usize = 5;
/// Passes over holes.
const HOLE_PASSES: usize = 2;

/// A frame in which the camera's motion is known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AttachedInput<'a> {
    pub rig: &'a StereoRig,
    /// The camera's motion.
    pub t_current_previous: &'a Transform,
    /// Previous and current left image, of one brightness.
    pub left: [View<'a, u8>; 2],
}

/// The cells, with what they gathered so far.
#[derive(Debug)]
pub(crate) struct AttachedCells<'s> {
    cells: &'s mut [Cell],
    counts: &'s mut [MatchCounts],
    columns: usize,
    rows: usize,
    /// Attached cells.
    count: u32,
}

const fn cells(capacity: &Capacity) -> usize {
    capacity.image_width.div_ceil(CELL_PX) * capacity.image_height.div_ceil(CELL_PX)
}

impl<'s> AttachedCells<'s> {
    /// Bytes of the slab.
    pub const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<Cell>(cells(capacity)) + region_bytes::<MatchCounts>(cells(capacity))
    }

    /// Allocates the cells. None is attached.
    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self {
            cells: carver.alloc("attached.cell", cells(capacity)),
            counts: carver.alloc("attached.counts", cells(capacity)),
            columns: 0,
            rows: 0,
            count: 0,
        }
    }

    /// Visits what lives from frame to frame.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self {
            cells,
            // Belong to one frame.
            counts: _,
            columns,
            rows,
            count,
        } = self;
        let most = cells.len();
        visitor.count(columns, most);
        visitor.count(rows, most);
        visitor.u32(count);
        let used = columns.saturating_mul(*rows);
        cells.iter_mut().take(used).for_each(|cell| cell.visit(visitor));
    }

    /// Tells that no cell is attached.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Attached cells: columns and rows of each, in the order of the image.
    pub fn attached(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let columns = self.columns.max(1);
        let all = self.cells.iter().take(self.columns * self.rows).enumerate();
        let count = if self.count > 0 { usize::MAX } else { 0 };
        all.take(count)
            .filter(|(_, cell)| cell.is_attached())
            .map(move |(at, _)| [at.checked_rem(columns), at.checked_div(columns)])
            .map(|[column, row]| [column.unwrap_or_default(), row.unwrap_or_default()])
    }

    /// Tells that a match stays in place in a cell that has stayed for some frames. Most matches of
    /// a frame may be such: a bonnet has more than a world that turns by.
    #[inline(never)]
    pub fn doubts(&self, m: &Match) -> bool {
        let is_doubted = |at| self.cells.get(at).is_some_and(Cell::is_doubted);
        m.is_still() && self.cell_at(m.current_left).is_some_and(is_doubted)
    }

    /// Counts the matches of a frame. `matches` are with the frame before, without those on objects
    /// that a detector named.
    #[inline(never)]
    pub fn observe<'m>(
        &mut self,
        input: &AttachedInput<'_>,
        matches: impl Iterator<Item = &'m Match>,
    ) {
        let [_, current] = &input.left;
        self.columns = current.width().div_ceil(CELL_PX);
        self.rows = current.height().div_ceil(CELL_PX);
        let used = self.columns * self.rows;
        self.counts.iter_mut().take(used).for_each(|counts| *counts = MatchCounts::default());
        let mut moving = 0;
        for m in matches {
            moving += u32::from(self.count_match(input, m) == Some(false));
        }
        // Cells without matches are asked only where much else moves.
        let others_move = moving >= MOVING_MIN;
        let (columns, all) = (self.columns.max(1), self.cells.iter_mut().zip(&*self.counts));
        for (at, (cell, counts)) in all.take(used).enumerate() {
            cell.count(counts);
            if cell.is_attached() && others_move && counts.is_empty() {
                cell.count_change(is_changed(&input.left, [at % columns, at / columns]));
            }
        }
        self.attach();
    }

    /// Counts a match: true for a cell that stays, false against it, `None` if it does not know.
    fn count_match(&mut self, input: &AttachedInput<'_>, m: &Match) -> Option<bool> {
        let rig = input.rig;
        let before = rig.observation(m.previous_left, m.previous_right);
        let expected =
            rig.project(input.t_current_previous.transform_point(rig.triangulate(&before)?))?;
        let way = |a: f64, b: f64| (a - b).abs() as f32;
        let expected_px = [
            way(expected.u_left_px, before.u_left_px),
            way(expected.v_px, before.v_px),
            way(expected.u_right_px, before.u_right_px),
        ];
        if expected_px.iter().all(|&px| px < MOVED_PX) {
            return None;
        }
        let ([du, dv], is_still) = (m.flow_px(), m.is_still());
        // What hardly moves may be either, and what stays and is far may drive: neither counts.
        let has_moved = du.abs() + dv.abs() > LEFT_PX;
        let at = self.cell_at(m.current_left)?;
        let counts = self.counts.get_mut(at)?;
        if is_still && m.is_near(rig.focal_px) {
            counts.add_still(m.current_disparity_px());
        } else if has_moved {
            counts.add_moved();
        }
        (is_still || has_moved).then_some(is_still)
    }

    /// Index of the cell that a pixel lies in.
    fn cell_at(&self, [u, v]: [f32; 2]) -> Option<usize> {
        if !(u >= 0.0 && v >= 0.0) {
            return None;
        }
        let [column, row] = [u, v].map(|at| at as usize / CELL_PX);
        (column < self.columns && row < self.rows).then(|| row * self.columns + column)
    }

    /// Neighbours of a cell for which `is_so` holds, and how many it has.
    fn neighbours(&self, at: usize, is_so: impl Fn(&Cell) -> bool) -> [usize; 2] {
        let (column, row) = (at % self.columns.max(1), at / self.columns.max(1));
        let (mut found, mut all) = (0, 0);
        for near_row in row.saturating_sub(1)..=(row + 1).min(self.rows.saturating_sub(1)) {
            let last = (column + 1).min(self.columns.saturating_sub(1));
            for near_column in column.saturating_sub(1)..=last {
                let near = near_row * self.columns + near_column;
                if near != at {
                    all += 1;
                    found += usize::from(self.cells.get(near).is_some_and(&is_so));
                }
            }
        }
        [found, all]
    }

    /// Decides which cells are attached.
    fn attach(&mut self) {
        let used = self.columns * self.rows;
        for at in 0..used {
            let [staying, _] = self.neighbours(at, Cell::stays);
            if let Some(cell) = self.cells.get_mut(at) {
                cell.decide(staying >= NEIGHBOURS_MIN);
            }
        }
        for _ in 0..HOLE_PASSES {
            for at in 0..used {
                let [attached, all] = self.neighbours(at, Cell::is_attached);
                let is_hole = 8 * attached >= AROUND_HOLE * all;
                if let Some(cell) = self.cells.get_mut(at).filter(|_| is_hole) {
                    cell.fill_hole();
                }
            }
        }
        let attached = self.cells.iter().take(used).filter(|cell| cell.is_attached()).count();
        self.count = attached as u32;
    }
}

/// Tells whether the pixels of a cell differ between two images by more than half of what their own
/// texture has over three pixels. Even cells tell nothing.
fn is_changed(images: &[View<'_, u8>; 2], [column, row]: [usize; 2]) -> bool {
    let [previous, current] = images;
    let (mut change, mut texture) = (0u32, 0u32);
    for v in (row * CELL_PX..(row + 1) * CELL_PX).step_by(2) {
        for u in (column * CELL_PX..(column + 1) * CELL_PX).step_by(2) {
            let grey = |image: &View<'_, u8>, u: usize| image.get(u, v);
            // Differences within an image: its brightness may change as a whole.
            let slope = |image| Some(i32::from(grey(image, u)?) - i32::from(grey(image, u + 3)?));
            if let (Some(before), Some(now)) = (slope(previous), slope(current)) {
                change += now.abs_diff(before);
                texture += now.unsigned_abs();
            }
        }
    }
    2 * change > texture && texture > 0
}
