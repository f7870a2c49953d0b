//! Poses: matrices of numpy, or the quaternions of a report.

use super::error::refuse;
use dynvox_core::geometry::Transform;
use numpy::{PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Largest deviation from the identity of a rotation times its transpose: more than three printed
/// digits lose, less than a scale of 1.005 makes.
const TOLERANCE: f64 = 5e-3;

/// A pose as a matrix of 4 x 4 or 3 x 4, or as reports have it: a dictionary with `rotation`
/// (quaternion, x y z w) and `translation_m`.
pub fn given(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Transform> {
    let refused = || {
        refuse(format!(
            "{name} cannot be read as a pose. Pass a matrix of 4 x 4 or 3 x 4 numbers, or a \
             dictionary with rotation and translation_m"
        ))
    };
    if let Ok(parts) = value.cast::<PyDict>() {
        let part = |key: &str| parts.get_item(key)?.ok_or_else(refused);
        let rotation = part("rotation")?.extract().map_err(|_| refused())?;
        return Ok(Transform {
            rotation,
            translation_m: part("translation_m")?.extract().map_err(|_| refused())?,
        });
    }
    let float64 = value
        .py()
        .import("numpy")?
        .call_method1("asarray", (value, "float64"))
        .map_err(|_| refused())?;
    let matrix: PyReadonlyArray2<'_, f64> = float64.extract().map_err(|_| refused())?;
    let matrix = matrix.as_array();
    if !matches!(matrix.shape(), [3 | 4, 4]) {
        return Err(refused());
    }
    let row = |v: usize| [0, 1, 2].map(|u| matrix[[v, u]]);
    let (rotation, translation_m) = ([row(0), row(1), row(2)], [0, 1, 2].map(|v| matrix[[v, 3]]));
    if !matrix.iter().all(|number| number.is_finite()) {
        return Err(refuse(format!(
            "{name} is not finite. Leave the pose out where it is unknown"
        )));
    }
    let last = (matrix.shape()[0] == 4).then(|| [0, 1, 2, 3].map(|u| matrix[[3, u]]));
    if last.is_some_and(|last| last != [0.0, 0.0, 0.0, 1.0]) {
        return Err(refuse(format!(
            "{name} has a last row other than 0, 0, 0, 1: it may be transposed. Pass the matrix \
             that maps camera to world, with the translation in its last column"
        )));
    }
    check_rotation(name, &rotation)?;
    Ok(Transform::from_rotation_matrix(&rotation, translation_m))
}

/// Refuses what is no rotation: scaled, sheared, mirrored.
fn check_rotation(name: &str, rows: &[[f64; 3]; 3]) -> PyResult<()> {
    let product = |a: usize, b: usize| (0..3).map(|at| rows[a][at] * rows[b][at]).sum::<f64>();
    let off = |a: usize, b: usize| (product(a, b) - f64::from(u8::from(a == b))).abs();
    let worst = (0..9).map(|at| off(at / 3, at % 3)).fold(0.0, f64::max);
    let [x, y, z] = rows;
    let cross = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
    let mirrored = (0..3).map(|at| cross[at] * z[at]).sum::<f64>() < 0.0;
    let reason = match (worst > TOLERANCE, mirrored) {
        (false, false) => return Ok(()),
        (false, true) => "it is mirrored",
        (true, _) => "it is scaled or sheared",
    };
    Err(refuse(format!(
        "{name} is no rigid motion: {reason}. Pass a rotation and a translation, camera to world"
    )))
}

/// A matrix of 4 x 4.
pub fn matrix<'py>(py: Python<'py>, pose: &Transform) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let [x, y, z] = pose.matrix_3x4();
    let rows = [x, y, z, [0.0, 0.0, 0.0, 1.0]].map(|row| row.to_vec());
    Ok(PyArray2::from_vec2(py, &rows)?)
}

/// A dictionary, as in a report.
pub fn dictionary<'py>(py: Python<'py>, pose: &Transform) -> PyResult<Bound<'py, PyDict>> {
    let parts = PyDict::new(py);
    parts.set_item("rotation", pose.rotation)?;
    parts.set_item("translation_m", pose.translation_m)?;
    Ok(parts)
}
