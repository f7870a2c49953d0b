//! `surface_errors.csv` as a viewer shows it: how far the static map is off, where it was compared.

use super::{neighbourhood, tables::read_rows};
use crate::formats::FormatError;
use hashbrown::HashMap;
use serde::Deserialize;
use std::path::Path;

/// Side of the cells that comparisons are looked up in, m.
const CELL_M: f32 = 0.3;

/// A row of `surface_errors.csv`.
#[derive(Debug, Deserialize)]
struct SurfaceErrorColumns {
    x_m: f32,
    y_m: f32,
    z_m: f32,
    error_m: f32,
}

/// Errors of the static map's surface.
#[derive(Clone, Debug, Default)]
pub struct SurfaceErrorMap {
    /// Positions and errors, m, by cell.
    cells: HashMap<[i32; 3], Vec<([f32; 3], f32)>>,
}

impl SurfaceErrorMap {
    /// Reads it from a run folder; an empty one of a run that was compared with nothing.
    ///
    /// # Errors
    /// The file is damaged.
    pub fn read(folder: &Path) -> Result<Self, FormatError> {
        let mut map = Self::default();
        let path = folder.join("surface_errors.csv");
        if path.is_file() {
            read_rows(&path, |SurfaceErrorColumns { x_m, y_m, z_m, error_m }| {
                map.cells
                    .entry(cell([x_m, y_m, z_m]))
                    .or_default()
                    .push(([x_m, y_m, z_m], error_m));
            })?;
        }
        Ok(map)
    }

    /// The error of the comparison nearest to a place; `None` where none is within a cell's side.
    pub fn error_m(&self, position_m: [f32; 3]) -> Option<f32> {
        let near =
            neighbourhood(cell(position_m)).filter_map(|cell| self.cells.get(&cell)).flatten();
        let square =
            |at: &[f32; 3]| (0..3).map(|axis| (at[axis] - position_m[axis]).powi(2)).sum::<f32>();
        let nearest =
            near.map(|(at, error_m)| (square(at), *error_m)).min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.filter(|(square, _)| *square <= CELL_M * CELL_M).map(|(_, error_m)| error_m)
    }

    /// The error that four of five comparisons are below, m; `None` without any.
    pub fn max_m(&self) -> Option<f32> {
        let mut errors_m: Vec<f32> =
            self.cells.values().flatten().map(|(_, error_m)| *error_m).collect();
        errors_m.sort_unstable_by(f32::total_cmp);
        errors_m.get(errors_m.len() * 4 / 5).copied()
    }
}

fn cell(position_m: [f32; 3]) -> [i32; 3] {
    position_m.map(|metres| (metres / CELL_M).floor() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_comparison_within_reach_counts() {
        let folder = tempfile::TempDir::new().unwrap();
        assert_eq!(SurfaceErrorMap::read(folder.path()).unwrap().max_m(), None);
        let rows = "x_m,y_m,z_m,points,error_m\n0.1,0.1,0.1,3,0.02\n0.5,0.1,0.1,1,0.4\n";
        std::fs::write(folder.path().join("surface_errors.csv"), rows).unwrap();
        let errors = SurfaceErrorMap::read(folder.path()).unwrap();
        assert_eq!(errors.max_m(), Some(0.4));
        assert_eq!(
            [0.2, 0.35, 0.75, 0.9].map(|x| errors.error_m([x, 0.1, 0.1])),
            [Some(0.02), Some(0.4), Some(0.4), None]
        );
    }
}
