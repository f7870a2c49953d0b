//! `surface_errors.csv`: how far the static map is off, cell by cell of the surface that was
//! compared with the reference.

use super::write_rows;
use crate::evaluate::reference::SurfaceErrors;
use crate::observe::tables::rounded;
use serde::Serialize;
use std::io::{self, Write};

#[derive(Serialize)]
struct SurfaceErrorColumns {
    x_m: f64,
    y_m: f64,
    z_m: f64,
    points: u32,
    error_m: f64,
}

/// Writes the table.
///
/// # Errors
/// The disk refuses.
pub fn write_surface_errors(out: &mut impl Write, errors: &SurfaceErrors) -> io::Result<()> {
    write_rows(
        out,
        errors.cells().map(|cell| {
            // Centimetres suffice for cells of 20 cm.
            let [x_m, y_m, z_m] = cell.center_m.map(|metres| rounded(metres, 2));
            SurfaceErrorColumns {
                x_m,
                y_m,
                z_m,
                points: cell.points,
                error_m: rounded(cell.mean_m, 4),
            }
        }),
    )
}
