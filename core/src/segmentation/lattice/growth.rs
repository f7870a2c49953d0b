//! Growth of an object's cells: from seeds to neighbours that can be its own.

use super::{Bounds, Extent, GROWN, Lattice, step_px};

/// Cells that an object may grow to.
pub(super) struct Growth<'g, 'a> {
    pub lattice: &'g Lattice<'a>,
    pub bounds: &'g Bounds,
    /// Marks of the cells that belong to something else, row by row of the lattice.
    pub blocked: &'g [u8],
}

impl Growth<'_, '_> {
    /// Returns true if a cell's point lies within an extent, above the ground and on nothing else.
    pub fn can_be_own(&self, column: usize, row: usize, within: &Extent) -> bool {
        let lattice = self.lattice;
        if self.blocked.get(row * lattice.columns + column).is_some_and(|blocked| *blocked > 0) {
            return false;
        }
        let point = lattice.point(column, row).filter(|point| within.contains(&(*point).into()));
        point.is_some_and(|point| lattice.is_above_ground(point) && !lattice.is_known(point))
    }

    /// Marks and queues all cells within an extent that can be the object's. Returns how many;
    /// `None` if the queue is full.
    pub fn seed(&self, within: &Extent, cells: &mut [u8], queue: &mut [u32]) -> Option<usize> {
        let columns = self.lattice.columns;
        let mut queued = 0;
        for (column, row) in self.bounds.cells() {
            if self.can_be_own(column, row, within) {
                // A full queue ends the growth: the mask would be torn.
                let (cell, slot) = (cells.get_mut(row * columns + column)?, queue.get_mut(queued)?);
                (*cell, *slot) = (GROWN, (row * columns + column) as u32);
                queued += 1;
            }
        }
        Some(queued)
    }

    /// Marks what is connected with the first `queued` cells of the queue through cells within an
    /// extent: breadth first from all of them at once. The queue holds each cell at most once;
    /// `None` if it is full.
    pub fn spread(
        &self,
        within: &Extent,
        cells: &mut [u8],
        queue: &mut [u32],
        mut queued: usize,
    ) -> Option<()> {
        let lattice = self.lattice;
        let mut next = 0;
        while next < queued {
            let at = *queue.get(next)? as usize;
            next += 1;
            let (column, row) = (at % lattice.columns, at / lattice.columns);
            let disparity_px = lattice.disparity_px(lattice.pixel(column, row))?;
            // Neighbours of one surface have similar disparities.
            let step_px = step_px(disparity_px);
            let is_next = |column: usize, row: usize| {
                lattice
                    .disparity_px(lattice.pixel(column, row))
                    .is_some_and(|other_px| libm::fabs(other_px - disparity_px) < step_px)
            };
            let around = [
                (column.wrapping_sub(1), row),
                (column + 1, row),
                (column, row.wrapping_sub(1)),
                (column, row + 1),
            ];
            for (column, row) in
                around.into_iter().filter(|&(column, row)| self.bounds.contains(column, row))
            {
                let cell = cells.get_mut(row * lattice.columns + column)?;
                if *cell == 0 && is_next(column, row) && self.can_be_own(column, row, within) {
                    *cell = GROWN;
                    *queue.get_mut(queued)? = (row * lattice.columns + column) as u32;
                    queued += 1;
                }
            }
        }
        Some(())
    }
}
