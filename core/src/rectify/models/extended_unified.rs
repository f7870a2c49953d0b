//! Extended unified camera model: Khomutenko, Garcia and Martinet, *An enhanced unified camera
//! model* (RA-L 2016); beta 1 is the unified model of Geyer and Daniilidis, Barreto and Mei.

use super::{LensKind, LensModel};

/// Row of the table of models.
pub(super) const KIND: LensKind = LensKind {
    name: "extended_unified",
    typical: LensModel::ExtendedUnified { alpha: 0.6, beta: 1.1 },
};

/// Projects a ray into the image, in units of the focal length.
pub(super) fn distort(alpha: f64, beta: f64, [x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
    let distance = libm::sqrt(beta * (x * x + y * y) + z * z);
    let below = alpha * distance + (1.0 - alpha) * z;
    let widest = if alpha <= 0.5 { alpha / (1.0 - alpha) } else { (1.0 - alpha) / alpha };
    (z > -widest * distance && below > 0.0).then(|| [x / below, y / below])
}

/// The ray that meets the image there.
pub(super) fn undistort(alpha: f64, beta: f64, [u, v]: [f64; 2]) -> Option<[f64; 3]> {
    let r2 = u * u + v * v;
    let inside = 1.0 - (2.0 * alpha - 1.0) * beta * r2;
    if inside.is_nan() || inside < 0.0 {
        return None;
    }
    let z = (1.0 - beta * alpha * alpha * r2) / (alpha * libm::sqrt(inside) + 1.0 - alpha);
    Some([u, v, z])
}
