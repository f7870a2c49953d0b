//! Columns of the window at the vehicle's height.

use crate::sector::Band;
use crate::vehicle::OnGrid;
use dynvox_core::planning::{CellState, Planning};

/// State of a column between two heights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColumnState {
    /// Every cell was seen free; the frames since the longest ago of these looks.
    Free { age: u32 },
    /// A cell is occupied: the first one from below.
    Occupied { z: i32 },
    /// Every cell was seen, and one is too close to a surface behind it to be called free: depth
    /// errs by that much.
    InDoubt,
    /// A cell was never seen, or too long ago.
    Unknown,
}

/// Levels of cells that the vehicle passes through: the first and the one after the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Levels {
    /// The first level.
    pub from: i32,
    /// The level after the last.
    pub to: i32,
}

impl Levels {
    /// The levels of a band about the vehicle: all cells that reach into it.
    pub fn new(vehicle: &OnGrid, band: &Band) -> Self {
        let [_, _, z] = vehicle.center;
        let at = |height_m: f32| z + f64::from(height_m) / vehicle.cell_m;
        let from = libm::floor(at(-band.down_m)) as i32;
        let to = libm::ceil(at(band.up_m)) as i32;
        // At least the level the vehicle is in.
        Self { from, to: if to > from { to } else { from + 1 } }
    }
}

/// The state of a column.
pub fn state(
    planning: &Planning<'_>,
    [x, y]: [i32; 2],
    levels: Levels,
    stale_frames: u32,
) -> ColumnState {
    let mut oldest = 0;
    let (mut is_seen, mut is_free) = (true, true);
    for z in levels.from..levels.to {
        match planning.cell([x, y, z]) {
            // What stands there, however long ago it was seen, is in the way.
            (CellState::Occupied, _) => return ColumnState::Occupied { z },
            (CellState::Free, Some(age)) if age <= stale_frames => {
                oldest = if age > oldest { age } else { oldest };
            }
            (_, Some(age)) if age <= stale_frames => is_free = false,
            _ => is_seen = false,
        }
    }
    match (is_seen, is_free) {
        (true, true) => ColumnState::Free { age: oldest },
        (true, false) => ColumnState::InDoubt,
        (false, _) => ColumnState::Unknown,
    }
}
