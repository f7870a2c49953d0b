//! Equidistant fisheye: Kannala and Brandt, *A generic camera model and calibration method for
//! conventional, wide-angle and fish-eye lenses* (2006), with the four coefficients that
//! calibration tools keep.
//!
//! With a the angle from the optical axis: `a' = a (1 + k1 a^2 + k2 a^4 + k3 a^6 + k4 a^8)` is the
//! distance from the middle.

use super::{LensKind, LensModel};
use crate::rectify::monotonic;

/// Row of the table of models.
pub(super) const KIND: LensKind = LensKind {
    name: "equidistant",
    typical: LensModel::Equidistant { radial: [-0.013, 0.02, -0.012, 0.002] },
};

/// Distorted angle and its derivative.
fn polynomial([k1, k2, k3, k4]: &[f64; 4], angle: f64) -> [f64; 2] {
    let a2 = angle * angle;
    let value = angle * (1.0 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))));
    let slope = 1.0 + a2 * (3.0 * k1 + a2 * (5.0 * k2 + a2 * (7.0 * k3 + a2 * 9.0 * k4)));
    [value, slope]
}

/// The angle up to which the distorted one grows with it, rad.
pub(super) fn limit(k: &[f64; 4]) -> f64 {
    monotonic::growing_until(core::f64::consts::PI, |angle| angle, |angle| polynomial(k, angle)[0])
}

/// Projects a ray into the image, in units of the focal length.
pub(super) fn distort(k: &[f64; 4], limit: f64, [x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
    let aside = libm::sqrt(x * x + y * y);
    // On the axis the direction in the image is not determined, and the point is its middle.
    if aside < 1e-300 {
        return (z > 0.0).then_some([0.0, 0.0]);
    }
    let angle = libm::atan2(aside, z);
    let within = angle <= limit;
    // Radius of the image by the angle, and along the ray's direction from the axis.
    within.then(|| {
        let scale = polynomial(k, angle)[0] / aside;
        [x * scale, y * scale]
    })
}

/// The ray that meets the image there.
pub(super) fn undistort(k: &[f64; 4], limit: f64, [u, v]: [f64; 2]) -> Option<[f64; 3]> {
    let distorted = libm::sqrt(u * u + v * v);
    let angle = monotonic::inverse(distorted, limit, |angle| polynomial(k, angle))?;
    if distorted < 1e-300 {
        return Some([0.0, 0.0, 1.0]);
    }
    let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
    Some([sine * u / distorted, sine * v / distorted, cosine])
}
