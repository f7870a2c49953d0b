//! Poses: matrices of numpy, or the quaternions of a report.

use super::error::refuse;
use dynvox_core::geometry::Transform;
use numpy::{PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

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
    Ok(Transform::from_rotation_matrix(
        &[row(0), row(1), row(2)],
        [0, 1, 2].map(|v| matrix[[v, 3]]),
    ))
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
