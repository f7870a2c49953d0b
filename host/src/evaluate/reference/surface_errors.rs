//! Errors of the static map by place: distances of the reference's points from the surface, cell by
//! cell.
//!
//! Memory: 28 bytes or so for each cell of the surface that was compared.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Side of a cell, m.
const CELL_M: f64 = 0.2;

/// The comparisons in one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceError {
    /// The middle of the cell, m, in world coordinates.
    pub center_m: [f64; 3],
    /// Points compared.
    pub points: u32,
    /// Mean of their distances from the surface that the map shows, m.
    pub mean_m: f64,
}

/// Collects distances.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SurfaceErrors {
    /// Sum of distances, m, and their number.
    cells: BTreeMap<[i32; 3], (f64, u32)>,
}

impl SurfaceErrors {
    /// Takes in a point of the map's surface, and the distance from it to what the reference has at
    /// the same pixel.
    pub fn add(&mut self, position_m: [f64; 3], distance_m: f64) {
        let (sum, count) = self
            .cells
            .entry(position_m.map(|metres| (metres / CELL_M).floor() as i32))
            .or_default();
        *sum += distance_m;
        *count += 1;
    }

    /// The cells, by coordinates.
    pub fn cells(&self) -> impl Iterator<Item = SurfaceError> {
        self.cells.iter().map(|(cell, &(sum, points))| SurfaceError {
            center_m: cell.map(|at| (f64::from(at) + 0.5) * CELL_M),
            points,
            mean_m: sum / f64::from(points),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_one_cell_are_averaged() {
        let mut errors = SurfaceErrors::default();
        // Two points of one cell of 0.2 m, and one of the cell beside it.
        for (at, distance_m) in
            [([0.05, 0.0, 0.1], 0.1), ([-0.05, 0.0, 0.1], 0.5), ([0.15, 0.19, 0.0], 0.3)]
        {
            errors.add(at, distance_m);
        }
        let cells: Vec<SurfaceError> = errors.cells().collect();
        assert_eq!(cells.len(), 2);
        assert_eq!((cells[0].points, cells[0].mean_m), (1, 0.5));
        assert!(
            cells[1].points == 2
                && (cells[1].mean_m - 0.2).abs() < 1e-12
                && (cells[1].center_m[0] - 0.1).abs() < 1e-12
        );
    }
}
