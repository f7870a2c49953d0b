//! Double sphere: Usenko, Demmel and Cremers, *The double sphere camera model* (3DV 2018),
//! equations 40 to 52.

use super::{LensKind, LensModel};

/// Row of the table of models.
pub(super) const KIND: LensKind = LensKind {
    name: "double_sphere",
    typical: LensModel::DoubleSphere { xi: -0.18, alpha: 0.59 },
};

/// Projects a ray into the image, in units of the focal length.
pub(super) fn distort(xi: f64, alpha: f64, [x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
    let first = libm::sqrt(x * x + y * y + z * z);
    let shifted = xi * first + z;
    let second = libm::sqrt(x * x + y * y + shifted * shifted);
    let w1 = if alpha <= 0.5 { alpha / (1.0 - alpha) } else { (1.0 - alpha) / alpha };
    let w2 = (w1 + xi) / libm::sqrt(2.0 * w1 * xi + xi * xi + 1.0);
    let below = alpha * second + (1.0 - alpha) * shifted;
    (z > -w2 * first && below > 0.0).then(|| [x / below, y / below])
}

/// The ray that meets the image there.
pub(super) fn undistort(xi: f64, alpha: f64, [u, v]: [f64; 2]) -> Option<[f64; 3]> {
    let r2 = u * u + v * v;
    // Below 0 the image has no ray there: the model ends at a circle.
    let inside = 1.0 - (2.0 * alpha - 1.0) * r2;
    if inside.is_nan() || inside < 0.0 {
        return None;
    }
    let z = (1.0 - alpha * alpha * r2) / (alpha * libm::sqrt(inside) + 1.0 - alpha);
    let square = z * z + (1.0 - xi * xi) * r2;
    let scale = (z * xi + libm::sqrt(square)) / (z * z + r2);
    (square >= 0.0).then_some([scale * u, scale * v, scale * z - xi])
}
