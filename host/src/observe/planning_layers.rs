//! The planner's window as arrays, one value a column of cells: what a recording and Python hand
//! on.

use dynvox_core::geometry::Transform;
use dynvox_core::planning::{CellState, Planning};

/// Values of `nav_msgs/OccupancyGrid`.
const FREE: i8 = 0;
const OCCUPIED: i8 = 100;
const UNKNOWN: i8 = -1;

/// The window from above, after [`dynvox_core::Mapper::update_planning_maps`]: rows from the
/// nearest to the farthest ahead, columns from left to right.
#[derive(Clone, Debug)]
pub struct PlanningLayers {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Side of a cell, m.
    pub cell_m: f64,
    /// The corner of the first cell at the height of the lowest ground, in the world; its axes are
    /// right, ahead and up.
    pub t_world_corner: Transform,
    /// 0 free, 100 occupied, -1 never seen, between the limits of the slice: as in
    /// `nav_msgs/OccupancyGrid`.
    pub occupancy: Vec<i8>,
    /// To the nearest obstacle of the slice, m; negative within one, NaN without any.
    pub distance_m: Vec<f32>,
    /// Heights of the ground above the corner, m; NaN without ground.
    pub height_m: Vec<f32>,
}

impl PlanningLayers {
    /// Reads the window; `None` without cells.
    pub fn from_planning(planning: &Planning<'_>) -> Option<Self> {
        let ([width, length, _], [x, y, z], grid) =
            (planning.size(), planning.origin(), planning.grid());
        if width * length == 0 {
            return None;
        }
        let cells = || {
            (0..length as i32)
                .flat_map(|row| (0..width as i32).map(move |column| [x + column, y + row, z]))
        };
        let height = |cell| planning.column(cell).and_then(|column| column.ground_m());
        // Heights relative to the lowest ground, where viewers draw the grid.
        let lowest_m = cells().filter_map(height).fold(f32::INFINITY, f32::min);
        let lowest_m = if lowest_m.is_finite() { lowest_m } else { 0.0 };
        let cell_m = grid.cell_m();
        let [right, ahead, up] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
            .map(|axis| grid.to_world(axis.map(|c| c / cell_m)));
        let rows = [0, 1, 2].map(|row| [right[row], ahead[row], up[row]]);
        let corner = grid.to_world([f64::from(x), f64::from(y), f64::from(lowest_m) / cell_m]);
        // The three states as the numbers of ROS's occupancy grids.
        let state = |cell| match planning.slice_state(cell) {
            CellState::Free => FREE,
            CellState::Occupied => OCCUPIED,
            CellState::Unknown => UNKNOWN,
        };
        let distance =
            |cell| planning.slice_distance(cell).map_or(f32::NAN, |distance| distance.distance_m);
        Some(Self {
            size: [width, length],
            cell_m,
            t_world_corner: Transform::from_rotation_matrix(&rows, corner),
            occupancy: cells().map(state).collect(),
            distance_m: cells().map(distance).collect(),
            height_m: cells()
                .map(|cell| height(cell).map_or(f32::NAN, |height_m| height_m - lowest_m))
                .collect(),
        })
    }
}
