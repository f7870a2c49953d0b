//! Rigid motions as the slab's tables keep them: [x, y, z, w of the rotation, x, y, z of the translation].

use crate::geometry::Transform;
use nalgebra::{Quaternion, Translation3, UnitQuaternion};

/// A motion as numbers.
pub(crate) fn numbers(transform: &Transform) -> [f64; 7] {
    let (q, t) = (transform.rotation.coords, transform.translation.vector);
    [q.x, q.y, q.z, q.w, t.x, t.y, t.z]
}

/// Numbers as a motion.
pub(crate) fn transform(&[i, j, k, w, x, y, z]: &[f64; 7]) -> Transform {
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
    Transform::from_parts(Translation3::new(x, y, z), rotation)
}
