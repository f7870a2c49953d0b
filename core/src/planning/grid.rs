//! Grid of cells: integer coordinates with z up, turned from the world's.
//!
//! A grid point is a world point turned by a rotation of 14 fractional bits. Cell (x, y, z) holds
//! the grid points from `cell * (x, y, z)` up to but without the next cell's: x to the right of the
//! first camera's view, y ahead, z up.

use super::PlanningConfig;
use crate::geometry::Transform;

/// Fractional bits of the rotation.
pub(super) const TURN_BITS: u32 = 14;
const TURN_ONE: f64 = (1 << TURN_BITS) as f64;

/// A cell of the window, in coordinates that stay as the camera moves: x right, y ahead, z up.
pub type Cell = [i32; 3];

/// From the world's axes to the grid's.
///
/// ```
/// use dynvox_core::planning::{Grid, PlanningConfig};
///
/// let grid = Grid::new(&PlanningConfig { cell_voxels: 4, ..Default::default() }, 0.05);
/// assert!((grid.cell_m() - 0.2).abs() < 1e-6);
/// // KITTI's axes: z ahead and y down become y ahead and z up.
/// let [_, ahead, up] = grid.of_world([0.0, -1.0, 2.0]).map(|cells| cells * grid.cell_m());
/// assert!((ahead - 2.0).abs() < 1e-3 && (up - 1.0).abs() < 1e-3);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Rows: the grid's axes in the world, times 2^14.
    pub(super) turn_q14: [[i32; 3]; 3],
    /// Rotation as floats.
    turn: [[f64; 3]; 3],
    /// Voxels along a cell's side.
    pub(super) cell_voxels: i32,
    voxel_size_m: f64,
}

impl Grid {
    /// The grid of a map with voxels of that size.
    pub fn new(config: &PlanningConfig, voxel_size_m: f32) -> Self {
        let normalized = |v: [f64; 3]| {
            let length = libm::sqrt(dot(v, v));
            v.map(|c| c / length)
        };
        let up = normalized([config.up_x, config.up_y, config.up_z].map(f64::from));
        // Ahead is the world's z, or its y where up is along z, without the part that is up.
        let ahead = if up[2] * up[2] < 0.9 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] };
        // Gram and Schmidt: ahead loses its part along up.
        let part = dot(ahead, up);
        let ahead =
            normalized([ahead[0] - part * up[0], ahead[1] - part * up[1], ahead[2] - part * up[2]]);
        let right = [
            ahead[1] * up[2] - ahead[2] * up[1],
            ahead[2] * up[0] - ahead[0] * up[2],
            ahead[0] * up[1] - ahead[1] * up[0],
        ];
        // Rounded once to integers: cells of a point are then found in integers, the same
        // everywhere.
        let turn_q14 =
            [right, ahead, up].map(|axis| axis.map(|c| libm::round(c * TURN_ONE) as i32));
        Self {
            turn_q14,
            turn: turn_q14.map(|axis| axis.map(|c| f64::from(c) / TURN_ONE)),
            cell_voxels: i32::from(config.cell_voxels),
            voxel_size_m: f64::from(voxel_size_m),
        }
    }

    /// Length of a cell's side, m.
    pub fn cell_m(&self) -> f64 {
        self.voxel_size_m * f64::from(self.cell_voxels)
    }

    /// A point of the world in the grid, in cells; the cell that holds it is its floor.
    pub fn of_world(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        self.turn.map(|[a, b, c]| (a * x + b * y + c * z) / self.cell_m())
    }

    /// The middle of a cube of the map in the grid, and how far the cube reaches from there along
    /// each axis, in cells. Its middle and side are given in voxels.
    pub(super) fn of_cube(&self, middle: [f64; 3], side: f64) -> ([f64; 3], [f64; 3]) {
        let cell = f64::from(self.cell_voxels);
        let half = self.turn.map(|row| {
            let reach = row.iter().fold(0.0, |sum, along| sum + libm::fabs(*along));
            0.5 * side * reach / cell
        });
        (self.turn.map(|row| dot(row, middle) / cell), half)
    }

    /// A point of the grid, in cells, in the world, m.
    ///
    /// ```
    /// use dynvox_core::planning::{Grid, PlanningConfig};
    ///
    /// let grid = Grid::new(&PlanningConfig::default(), 0.05);
    /// let [x, y, z] = grid.to_world(grid.of_world([1.0, 2.0, 3.0]));
    /// assert!((x - 1.0).abs() < 1e-3 && (y - 2.0).abs() < 1e-3 && (z - 3.0).abs() < 1e-3);
    /// ```
    pub fn to_world(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [right, ahead, up] = self.turn;
        let along = |axis: usize| {
            let [a, b, c] =
                [right, ahead, up].map(|row| row.get(axis).copied().unwrap_or_default());
            (a * x + b * y + c * z) * self.cell_m()
        };
        [along(0), along(1), along(2)]
    }

    /// The rotation and position of a camera in the grid: the camera's axes (columns) in grid axes,
    /// and where it is, in cells.
    pub fn of_camera(&self, t_world_camera: &Transform) -> ([[f64; 3]; 3], [f64; 3]) {
        let world = t_world_camera.rotation_matrix();
        let turned = self.turn.map(|row| {
            [0, 1, 2].map(|column| {
                dot(row, world.map(|axis| axis.get(column).copied().unwrap_or_default()))
            })
        });
        (turned, self.of_world(t_world_camera.translation_m))
    }

    /// The cell that holds a point given in cells; `None` beyond 2^24 cells.
    ///
    /// ```
    /// use dynvox_core::planning::{Grid, PlanningConfig};
    ///
    /// let grid = Grid::new(&PlanningConfig::default(), 0.05);
    /// assert_eq!(grid.cell_at([1.5, -0.5, 0.0]), Some([1, -1, 0]));
    /// assert_eq!(grid.cell_at([f64::NAN; 3]), None);
    /// ```
    pub fn cell_at(&self, point: [f64; 3]) -> Option<Cell> {
        let limit = f64::from(1 << 24);
        let within = point.iter().all(|c| c.is_finite() && (-limit..limit).contains(c));
        within.then(|| point.map(|c| libm::floor(c) as i32))
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
