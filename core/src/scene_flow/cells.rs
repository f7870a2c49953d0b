//! Matches sorted into square cells of the previous left image, for the stages that ask who is
//! near.
//!
//! Memory: 4 bytes per match and per cell of [`CELL_MIN_PX`].

use super::matches::Match;
use crate::memory::{Capacity, Carver, region_bytes};

/// Side of the smallest cells, px.
pub(super) const CELL_MIN_PX: usize = 16;

/// The index. Within a cell matches keep their order.
#[derive(Debug)]
pub(super) struct Cells<'s> {
    start: &'s mut [u32],
    order: &'s mut [u32],
}

/// The shape of one use of the index.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub cell_px: usize,
    pub columns: usize,
    pub rows: usize,
}

impl Shape {
    pub(super) const fn new(width: usize, height: usize, cell_px: usize) -> Self {
        let cell_px = if cell_px > 0 { cell_px } else { 1 };
        Self { cell_px, columns: width.div_ceil(cell_px), rows: height.div_ceil(cell_px) }
    }

    /// Returns the number of cells.
    pub(super) const fn cells(self) -> usize {
        self.columns * self.rows
    }

    /// Column and row of the cell a match lies in.
    pub(super) fn cell(&self, m: &Match) -> [usize; 2] {
        // Previous left positions are inside the image, so the cast is exact.
        let [column, row] =
            m.previous_left.map(|x| (x as usize).checked_div(self.cell_px).unwrap_or(0));
        [column.min(self.columns.saturating_sub(1)), row.min(self.rows.saturating_sub(1))]
    }
}

const fn table(capacity: &Capacity) -> usize {
    Shape::new(capacity.image_width, capacity.image_height, CELL_MIN_PX).cells() + 1
}

impl<'s> Cells<'s> {
    pub(super) const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<u32>(table(capacity)) + region_bytes::<u32>(capacity.matches)
    }

    pub(super) fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self {
            start: carver.alloc("scene_flow.match_cell", table(capacity)),
            order: carver.alloc("scene_flow.match_order", capacity.matches),
        }
    }

    /// Sorts. Returns the cells' starts (one more than cells) and the matches' positions, cell by
    /// cell.
    pub(super) fn sort(&mut self, matches: &[Match], shape: Shape) -> (&[u32], &mut [u32]) {
        let cells = shape.cells();
        let (Some(start), Some(order)) =
            (self.start.get_mut(..=cells), self.order.get_mut(..matches.len()))
        else {
            return (&[], &mut []);
        };
        let key = |m: &Match| {
            let [column, row] = shape.cell(m);
            row * shape.columns + column
        };
        // A counting sort: its time depends on no order of the matches.
        start.fill(0);
        for m in matches {
            if let Some(count) = start.get_mut(key(m) + 1) {
                *count += 1;
            }
        }
        // Counts become the first index of each cell.
        let mut sum = 0;
        for entry in start.iter_mut() {
            sum += *entry;
            *entry = sum;
        }
        // Each cell's cursor ends where the next cell begins.
        for (index, m) in (0..).zip(matches) {
            if let Some(cursor) = start.get_mut(key(m)) {
                if let Some(slot) = order.get_mut(*cursor as usize) {
                    *slot = index;
                }
                *cursor += 1;
            }
        }
        // Undo the cursors' advance: each cell's end becomes the next one's start.
        start.copy_within(..cells, 1);
        if let Some(first) = start.first_mut() {
            *first = 0;
        }
        (start, order)
    }
}
