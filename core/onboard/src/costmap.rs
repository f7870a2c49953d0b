//! Costs and heights of columns, as costmaps of Nav2 and height maps hold them.

use crate::columns::{ColumnState, Levels, state};
use crate::sector::Band;
use crate::vehicle::Vehicle;
use dynvox_core::planning::Planning;

/// Cost of a free column (`FREE_SPACE`).
pub const COST_FREE: u8 = 0;
/// Cost of a column that is in the way (`LETHAL_OBSTACLE`).
pub const COST_LETHAL: u8 = 254;
/// Cost of a column that is not known (`NO_INFORMATION`).
pub const COST_UNKNOWN: u8 = 255;

/// Size and place of a map of columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Costmap {
    /// Columns from left to right.
    pub width: usize,
    /// Columns from behind to ahead.
    pub length: usize,
    /// Side of a column, m.
    pub resolution_m: f64,
    /// Place of the first column's corner from the world's origin: to the right and ahead, m.
    pub origin_m: [f64; 2],
}

/// Writes the cost of every column of the window, x fastest, and returns the map's size and place.
/// `None` where `into` has fewer entries than there are columns; then nothing is written.
///
/// Around a vehicle whose pose is a guess all is unknown.
pub fn costs(
    planning: &Planning<'_>,
    vehicle: &Vehicle,
    band: &Band,
    into: &mut [u8],
) -> Option<Costmap> {
    let here = vehicle.on_grid(planning);
    fill(planning, into, |at| {
        let seen =
            here.map(|here| state(planning, at, Levels::new(&here, band), band.stale_frames));
        match seen {
            Some(ColumnState::Free { .. }) => COST_FREE,
            Some(ColumnState::Occupied { .. }) => COST_LETHAL,
            Some(ColumnState::InDoubt | ColumnState::Unknown) | None => COST_UNKNOWN,
        }
    })
}

/// Writes the height of the ground of every column of the window, x fastest, in metres above the
/// vehicle's centre, and returns the map's size and place. NaN marks a column whose ground is not
/// known. `None` where `into` has fewer entries than there are columns; then nothing is written.
///
/// Ground is what [`Planning::column`] finds: a surface that continues what lies before it without
/// a step that is too high. Around a vehicle whose pose is a guess all is unknown.
pub fn heights(planning: &Planning<'_>, vehicle: &Vehicle, into: &mut [f32]) -> Option<Costmap> {
    let here = vehicle.on_grid(planning);
    fill(planning, into, |[x, y]| {
        let column = planning.column([x, y, 0]);
        let ground_m = column.and_then(|column| column.ground_m());
        match (here, ground_m) {
            (Some(here), Some(ground_m)) => {
                (f64::from(ground_m) - here.center[2] * here.cell_m) as f32
            }
            _ => f32::NAN,
        }
    })
}

/// Writes what `value` says of every column, x fastest. `None` where `into` is too short.
fn fill<T>(
    planning: &Planning<'_>,
    into: &mut [T],
    value: impl Fn([i32; 2]) -> T,
) -> Option<Costmap> {
    let ([width, length, _], [x0, y0, _]) = (planning.size(), planning.origin());
    let cell_m = planning.grid().cell_m();
    let columns = into.get_mut(..width.checked_mul(length)?)?;
    for (y, row) in columns.chunks_mut(width.max(1)).enumerate() {
        for (x, entry) in row.iter_mut().enumerate() {
            *entry = value([x0 + x as i32, y0 + y as i32]);
        }
    }
    Some(Costmap {
        width,
        length,
        resolution_m: cell_m,
        origin_m: [f64::from(x0) * cell_m, f64::from(y0) * cell_m],
    })
}
