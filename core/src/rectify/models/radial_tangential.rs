//! Radial and tangential distortion: Brown, *Decentering distortion of lenses* (1971), with the
//! denominator of the rational model (Claus and Fitzgibbon 2005).
//!
//! With x, y over z and r its length:
//! `g = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)`,
//! `x' = x g + 2 p1 x y + p2 (r^2 + 2 x^2)`, `y' = y g + p1 (r^2 + 2 y^2) + 2 p2 x y`.

use super::{LensKind, LensModel};
use crate::rectify::monotonic;

/// Row of the table of models.
pub(super) const KIND: LensKind = LensKind {
    name: "radial_tangential",
    typical: LensModel::RadialTangential {
        radial: [-0.28, 0.07, 0.0, 0.0, 0.0, 0.0],
        tangential: [2e-4, -3e-4],
    },
};

/// Most of Newton's steps in the plane: each doubles the right digits, and the radial part is exact
/// before the first.
pub const MAX_STEPS: usize = 12;
/// A step or a residual below this counts as none, in units of the focal length.
const SMALL: f64 = 1e-14;
/// Largest residual that is an answer when no step got smaller: 1e-7 px at 1,000 px of focal
/// length.
const ACCEPTED: f64 = 1e-10;
/// Angle from the optical axis at which a pinhole ends, rad: 85 degrees.
const WIDEST_RAD: f64 = 1.483_529_864;

/// The factor `g` and its derivative by r^2.
fn factor(k: &[f64; 6], r2: f64) -> [f64; 2] {
    let [k1, k2, k3, k4, k5, k6] = *k;
    let above = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    let below = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
    let above_slope = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);
    let below_slope = k4 + r2 * (2.0 * k5 + r2 * 3.0 * k6);
    [above / below, (above_slope * below - above * below_slope) / (below * below)]
}

/// The radius up to which distorted radii grow with true ones.
pub(super) fn limit(k: &[f64; 6]) -> f64 {
    monotonic::growing_until(WIDEST_RAD, libm::tan, |r| r * factor(k, r * r)[0])
}

fn distort_plane(k: &[f64; 6], [p1, p2]: &[f64; 2], [x, y]: [f64; 2]) -> [f64; 2] {
    let r2 = x * x + y * y;
    let [g, _] = factor(k, r2);
    [
        x * g + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * g + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    ]
}

/// Projects a ray onto the plane at distance 1 behind the lens.
pub(super) fn distort(
    k: &[f64; 6],
    p: &[f64; 2],
    limit: f64,
    [x, y, z]: [f64; 3],
) -> Option<[f64; 2]> {
    if z.is_nan() || z <= 0.0 {
        return None;
    }
    let at = [x / z, y / z];
    let within = at[0] * at[0] + at[1] * at[1] <= limit * limit;
    within.then(|| distort_plane(k, p, at))
}

/// The ray that meets the plane there: the radial part by itself, then Newton's steps for the
/// whole.
pub(super) fn undistort(
    k: &[f64; 6],
    p: &[f64; 2],
    limit: f64,
    [u, v]: [f64; 2],
) -> Option<[f64; 3]> {
    let distorted = libm::sqrt(u * u + v * v);
    // In the middle nothing is distorted, and no direction is defined.
    if distorted < 1e-300 {
        return Some([u, v, 1.0]);
    }
    let end = limit * factor(k, limit * limit)[0];
    // The tangential part may carry a ray at the rim past the largest radial value: begin there.
    let sought = if distorted < end { distorted } else { end };
    let radius = monotonic::inverse(sought, limit, |r| {
        let [g, slope] = factor(k, r * r);
        [r * g, g + 2.0 * r * r * slope]
    })?;
    // Newton's steps from the radial solution: the tangential part is small.
    let (mut x, mut y) = (u / distorted * radius, v / distorted * radius);
    let [p1, p2] = *p;
    for _ in 0..MAX_STEPS {
        let [at_x, at_y] = distort_plane(k, p, [x, y]);
        let [error_x, error_y] = [at_x - u, at_y - v];
        let [g, slope] = factor(k, x * x + y * y);
        // The Jacobian is symmetric.
        let xx = g + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x;
        let xy = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
        let yy = g + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x;
        let determinant = xx * yy - xy * xy;
        let step_x = (yy * error_x - xy * error_y) / determinant;
        let step_y = (xx * error_y - xy * error_x) / determinant;
        if !(step_x.is_finite() && step_y.is_finite()) {
            return None;
        }
        (x, y) = (x - step_x, y - step_y);
        if libm::fabs(step_x) + libm::fabs(step_y) < SMALL {
            break;
        }
    }
    // Accepted only if it maps back to the pixel.
    let [at_x, at_y] = distort_plane(k, p, [x, y]);
    let reached = libm::fabs(at_x - u) + libm::fabs(at_y - v) < ACCEPTED;
    (reached && x * x + y * y <= limit * limit).then_some([x, y, 1.0])
}
