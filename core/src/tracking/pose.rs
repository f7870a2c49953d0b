//! Rigid motions as the slab's tables keep them: [x, y, z, w of the rotation, x, y, z of the translation].

use crate::geometry::Transform;

/// A motion as numbers.
pub(crate) fn numbers(transform: &Transform) -> [f64; 7] {
    let ([i, j, k, w], [x, y, z]) = (transform.rotation, transform.translation_m);
    [i, j, k, w, x, y, z]
}

/// Numbers as a motion.
pub(crate) fn transform(&[i, j, k, w, x, y, z]: &[f64; 7]) -> Transform {
    Transform { rotation: [i, j, k, w], translation_m: [x, y, z] }
}
