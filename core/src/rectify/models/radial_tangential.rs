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

/// Distortion within the plane at distance 1.
pub(super) struct Plane<'m> {
    /// k1 to k6.
    pub radial: &'m [f64; 6],
    /// p1, p2.
    pub tangential: &'m [f64; 2],
    /// s1 to s4: multiples of r^2 and r^4 along x, then along y.
    pub prism: &'m [f64; 4],
}

impl Plane<'_> {
    /// Moves a point as the lens does.
    // One copy serves two models: a firmware's code is bounded.
    #[inline(never)]
    pub fn distort(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ([p1, p2], [s1, s2, s3, s4]) = (*self.tangential, *self.prism);
        let r2 = x * x + y * y;
        let [g, _] = factor(self.radial, r2);
        [
            x * g + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + r2 * (s1 + r2 * s2),
            y * g + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + r2 * (s3 + r2 * s4),
        ]
    }

    /// Moves a point back: the radial part by itself, then Newton's steps for the whole. `None`
    /// where no point within `limit` of the middle leads there.
    #[inline(never)]
    pub fn undistort(&self, limit: f64, [u, v]: [f64; 2]) -> Option<[f64; 2]> {
        let k = self.radial;
        let distorted = libm::sqrt(u * u + v * v);
        if distorted < 1e-300 {
            return Some([u, v]);
        }
        let end = limit * factor(k, limit * limit)[0];
        // The other parts may carry a ray at the rim past the largest radial value: begin there.
        let sought = if distorted < end { distorted } else { end };
        let radius = monotonic::inverse(sought, limit, |r| {
            let [g, slope] = factor(k, r * r);
            [r * g, g + 2.0 * r * r * slope]
        })?;
        // Newton's steps from the radial solution: the other parts are small.
        let (mut x, mut y) = (u / distorted * radius, v / distorted * radius);
        for _ in 0..MAX_STEPS {
            let [step_x, step_y] = self.newton_step([x, y], [u, v]);
            if !(step_x.is_finite() && step_y.is_finite()) {
                return None;
            }
            (x, y) = (x - step_x, y - step_y);
            if libm::fabs(step_x) + libm::fabs(step_y) < SMALL {
                break;
            }
        }
        // Accepted only if it maps back to the point.
        let [at_x, at_y] = self.distort([x, y]);
        let reached = libm::fabs(at_x - u) + libm::fabs(at_y - v) < ACCEPTED;
        (reached && x * x + y * y <= limit * limit).then_some([x, y])
    }

    /// Step by which a point overshoots the one that leads to `sought`.
    fn newton_step(&self, [x, y]: [f64; 2], sought: [f64; 2]) -> [f64; 2] {
        let ([p1, p2], [s1, s2, s3, s4]) = (*self.tangential, *self.prism);
        let [at_x, at_y] = self.distort([x, y]);
        let [error_x, error_y] = [at_x - sought[0], at_y - sought[1]];
        let r2 = x * x + y * y;
        let [g, slope] = factor(self.radial, r2);
        // The derivatives of x and y by each other, and by themselves.
        let mixed = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
        let (along_x, along_y) = (s1 + 2.0 * s2 * r2, s3 + 2.0 * s4 * r2);
        let xx = g + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x + 2.0 * x * along_x;
        let xy = mixed + 2.0 * y * along_x;
        let yx = mixed + 2.0 * x * along_y;
        let yy = g + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x + 2.0 * y * along_y;
        let determinant = xx * yy - xy * yx;
        // Cramer's rule.
        [(yy * error_x - xy * error_y) / determinant, (xx * error_y - yx * error_x) / determinant]
    }
}

/// Projects a ray onto the plane at distance 1 behind the lens.
pub(super) fn distort(plane: &Plane<'_>, limit: f64, [x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
    if z.is_nan() || z <= 0.0 {
        return None;
    }
    let at = [x / z, y / z];
    let within = at[0] * at[0] + at[1] * at[1] <= limit * limit;
    within.then(|| plane.distort(at))
}

/// The ray that meets the plane there.
pub(super) fn undistort(plane: &Plane<'_>, limit: f64, at: [f64; 2]) -> Option<[f64; 3]> {
    plane.undistort(limit, at).map(|[x, y]| [x, y, 1.0])
}
