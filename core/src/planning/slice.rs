//! Columns of cells as one picture: what a robot on the ground can run into between two heights.

use super::{
    PlanningConfig,
    cells::{CellState, Cells, is_lost},
    height_map::{Column, HeightMap},
};

/// Reduces the window to one state per column, x fastest: `states` is as long as there are columns.
///
/// A column is occupied where a cell between the limits is, or where the ground steps by more than
/// `climb_m` or is steeper than `slope_max`. It is free where none is and at least one of these
/// cells was seen free, or where its ground was seen and the cells were not looked into. Else it is
/// unknown, as it is where a block that left the map may have held an obstacle.
pub(super) fn reduce(
    config: &PlanningConfig,
    cell_m: f32,
    cells: &Cells<'_>,
    ground: &HeightMap<'_>,
    states: &mut [u8],
) {
    let [width, length, height] = cells.size;
    let floor_m = cells.origin[2] as f32 * cell_m;
    for y in 0..length {
        for x in 0..width {
            let column = ground.get(x, y);
            // A level robot keeps its height; others follow the ground.
            let level_m = if config.level { ground.level_m() } else { column.reference_m };
            // The first cell that lies above the lower limit as a whole, and the last that begins
            // below the upper one.
            let from = ceil_cell(level_m + config.low_m - floor_m, cell_m);
            let to = ceil_cell(level_m + config.high_m - floor_m, cell_m);
            let [from, to] = [from, to].map(|at| usize::try_from(at).unwrap_or(0).min(height));
            let first = cells.column(x, y);
            // Every cell of the robot's height counts: one occupied cell blocks the column.
            let bits_above = (from..to)
                .map(|z| cells.bits.get(first + cells.level(z)).copied().unwrap_or_default());
            let (mut free, mut occupied, mut lost) = (false, false, false);
            for bits in bits_above {
                let state = CellState::from_bits(bits);
                free |= state == CellState::Free;
                occupied |= state == CellState::Occupied;
                lost |= is_lost(bits);
            }
            // A column is blocked by what stands in it, or by its own slope or step.
            let is_steep = column.slope().is_some_and(|slope| slope > config.slope_max);
            let state = if occupied || is_steep || column.step_m > config.climb_m {
                CellState::Occupied
            } else if !lost && (free || column.has(Column::GROUND)) {
                CellState::Free
            } else {
                CellState::Unknown
            };
            if let Some(entry) = states.get_mut(y * width + x) {
                *entry = state as u8;
            }
        }
    }
}

/// The first cell boundary at or above a height.
fn ceil_cell(above_m: f32, cell_m: f32) -> i32 {
    libm::ceilf(above_m / cell_m) as i32
}
