//! All that OpenCV's `calibrateCamera` and its `omnidir` module fit: the unified model of Mei and
//! Rives, *Single view point omnidirectional camera calibration from planar grids* (ICRA 2007),
//! with radial, tangential and thin prism distortion, and a tilted sensor after Louhichi, Fournel,
//! Lavest and Aissia, *Self-calibration of Scheimpflug cameras* (2007).
//!
//! A ray of length 1 is seen from a point `xi` behind the sphere's middle: `x / (z + xi)`. Then
//! comes [`super::radial_tangential`]'s plane with prism terms `s1 r^2 + s2 r^4` along x and
//! `s3 r^2 + s4 r^4` along y, then the sensor turned by `tx` and `ty`.

use super::radial_tangential::Plane;
use super::{LensKind, LensModel};

/// Row of the table of models.
pub(super) const KIND: LensKind = LensKind {
    name: "general",
    typical: LensModel::General {
        xi: 0.8,
        radial: [-0.34, 0.17, 0.0, 0.0, 0.0, 0.0],
        tangential: [-7e-4, 7e-4],
        prism: [1e-3, -4e-4, 5e-4, 2e-4],
        tilt: [0.01, -0.02],
    },
};

/// Projects a ray into the image, in units of the focal length.
pub(super) fn distort(
    plane: &Plane<'_>,
    xi: f64,
    tilt: &[f64; 2],
    limit: f64,
    [x, y, z]: [f64; 3],
) -> Option<[f64; 2]> {
    let length = libm::sqrt(x * x + y * y + z * z);
    // Beyond this the sphere's far side lies behind its near one.
    let widest = if xi > 1.0 { 1.0 / xi } else { xi };
    let below = z + xi * length;
    let seen = z > -widest * length && below > 0.0;
    if !seen {
        return None;
    }
    let at = [x / below, y / below];
    let within = at[0] * at[0] + at[1] * at[1] <= limit * limit;
    let [u, v] = within.then(|| plane.distort(at))?;
    let [[a, b, c], [d, e, f], [g, h, i]] = sensor(tilt);
    let depth = g * u + h * v + i;
    (depth > 0.0)
        .then(|| [i * (a * u + b * v + c) / depth - c, i * (d * u + e * v + f) / depth - f])
}

/// The ray that meets the image there.
pub(super) fn undistort(
    plane: &Plane<'_>,
    xi: f64,
    tilt: &[f64; 2],
    limit: f64,
    [u, v]: [f64; 2],
) -> Option<[f64; 3]> {
    let [[a, b, c], [d, e, f], [g, h, i]] = sensor(tilt);
    let [p, q] = [(u + c) / i, (v + f) / i];
    let depth = c * p + f * q + i;
    let in_front = depth > 0.0;
    if !in_front {
        return None;
    }
    let [x, y] =
        plane.undistort(limit, [(a * p + d * q + g) / depth, (b * p + e * q + h) / depth])?;
    let r2 = x * x + y * y;
    let square = 1.0 + (1.0 - xi * xi) * r2;
    let scale = (xi + libm::sqrt(square)) / (1.0 + r2);
    (square >= 0.0).then_some([scale * x, scale * y, scale - xi])
}

/// Rows of the rotation of a sensor tilted about x, then y.
fn sensor([about_x, about_y]: &[f64; 2]) -> [[f64; 3]; 3] {
    let (sin_x, cos_x) = (libm::sin(*about_x), libm::cos(*about_x));
    let (sin_y, cos_y) = (libm::sin(*about_y), libm::cos(*about_y));
    [
        [cos_y, sin_y * sin_x, -sin_y * cos_x],
        [0.0, cos_x, sin_x],
        [sin_y, -cos_y * sin_x, cos_y * cos_x],
    ]
}
