//! The normal equations of a reprojection error, and their solution.
//!
//! The motion is moved by a small rotation vector and translation on its left: T <- retract(step) T. Per point three different rows: u in
//! the left image, u in the right one, and v, which both images share and which therefore counts twice.

use super::points::{DEPTH_MIN_M, Point};
use crate::geometry::{StereoRig, Transform};
use nalgebra::Vector3;

const N: usize = 6;
/// A pivot below this share of its diagonal is none: the motion is not determined.
const PIVOT_MIN: f64 = 1e-12;

/// Sums of weighted J'J (lower half) and J'r over points, in the order of the points.
pub(super) struct Normal {
    matrix: [[f64; N]; N],
    vector: [f64; N],
    /// Sum of weighted squared errors, px².
    pub error: f64,
    /// Sum of weights.
    pub weight: f64,
}

/// A motion with its rotation as a matrix.
pub(super) struct Posed {
    rotation: nalgebra::Matrix3<f64>,
    translation: Vector3<f64>,
}

impl Posed {
    pub(super) fn new(motion: &Transform) -> Self {
        Self {
            rotation: motion.quaternion().to_rotation_matrix().into_inner(),
            translation: motion.translation(),
        }
    }

    /// Where a point is in the current camera; `None` behind it.
    fn carry(&self, point: &Point) -> Option<[f64; 3]> {
        let (r, t, [x, y, z]) = (&self.rotation, &self.translation, point.xyz);
        let depth = r.m31 * x + r.m32 * y + r.m33 * z + t.z;
        (depth > DEPTH_MIN_M).then(|| [r.m11 * x + r.m12 * y + r.m13 * z + t.x, r.m21 * x + r.m22 * y + r.m23 * z + t.y, depth])
    }
}

/// Errors of one point: predicted minus seen, as u left, u right, v left, v right.
fn residual([x, y, z]: [f64; 3], point: &Point, rig: &StereoRig) -> [f64; 4] {
    let u = rig.focal_px * x / z;
    let v = rig.focal_px * y / z;
    [u - point.left[0], u - rig.focal_baseline_px_m() / z - point.right[0], v - point.left[1], v - point.right[1]]
}

impl Normal {
    pub(super) const ZERO: Self = Self { matrix: [[0.0; N]; N], vector: [0.0; N], error: 0.0, weight: 0.0 };

    /// Adds a point; one behind the camera adds nothing.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "both indices run below N, the length of every row")]
    pub(super) fn add(&mut self, point: &Point, posed: &Posed, rig: &StereoRig, weight: impl Fn(f64) -> f64) {
        let Some(p) = posed.carry(point) else { return };
        let [x, y, z] = p;
        let [left, right, up_left, up_right] = residual(p, point, rig);
        let squared = left * left + right * right + up_left * up_left + up_right * up_right;
        let weight = weight(squared);
        let per_m = rig.focal_px / z;
        // Derivatives of the projection by the carried point, times those of the carried point by the step: a cross product and itself.
        let row = |slope: f64| {
            let (a, c) = (per_m, -per_m * slope);
            [c * y, a * z - c * x, -a * y, a, 0.0, c]
        };
        let (u_left, u_right) = (row(x / z), row((x - rig.baseline_m) / z));
        let (b, c) = (per_m, -per_m * y / z);
        let v = [c * y - b * z, -c * x, b * x, 0.0, b, c];
        let both = up_left + up_right;
        for i in 0..N {
            self.vector[i] += weight * (u_left[i] * left + u_right[i] * right + v[i] * both);
            for j in 0..=i {
                self.matrix[i][j] += weight * (u_left[i] * u_left[j] + u_right[i] * u_right[j] + 2.0 * v[i] * v[j]);
            }
        }
        self.error += weight * squared;
        self.weight += weight;
    }

    /// Adds one row: how a residual changes with the step, the residual, its weight.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "both indices run below N, the length of every row")]
    pub(super) fn add_row(&mut self, row: [f64; N], residual: f64, weight: f64) {
        for i in 0..N {
            self.vector[i] += weight * row[i] * residual;
            for j in 0..=i {
                self.matrix[i][j] += weight * row[i] * row[j];
            }
        }
        self.error += weight * residual * residual;
        self.weight += weight;
    }

    /// How well the translation held worst is held, as a share of what rows that all point its way would do; a bound from below, from the
    /// trace of the translation's covariance. 0 where the rows do not determine a motion.
    pub(super) fn held_share(&self) -> f64 {
        let variance = |axis: usize| {
            let unit = core::array::from_fn(|at| if at == axis { 1.0 } else { 0.0 });
            self.solve_for(unit).and_then(|solution| solution.get(axis).copied())
        };
        match (variance(3), variance(4), variance(5)) {
            (Some(x), Some(y), Some(z)) if self.weight > 0.0 => 1.0 / ((x + y + z) * self.weight),
            _ => 0.0,
        }
    }

    /// The step (rotation vector, translation) to the minimum, by LDL'; `None` where the points do not determine one.
    pub(super) fn solve(&self) -> Option<[f64; N]> {
        self.solve_for(self.vector.map(|x| -x))
    }

    /// What the sums' matrix turns into `right`.
    #[expect(clippy::indexing_slicing, reason = "all indices run below N, the length of every row")]
    fn solve_for(&self, right: [f64; N]) -> Option<[f64; N]> {
        let mut lower = self.matrix;
        let mut pivot = [0.0; N];
        for j in 0..N {
            let mut d = lower[j][j];
            for k in 0..j {
                d -= lower[j][k] * lower[j][k] * pivot[k];
            }
            // False for NaN as well.
            if !(d > PIVOT_MIN * self.matrix[j][j] && d < f64::INFINITY) {
                return None;
            }
            pivot[j] = d;
            for i in j + 1..N {
                let mut sum = lower[i][j];
                for k in 0..j {
                    sum -= lower[i][k] * lower[j][k] * pivot[k];
                }
                lower[i][j] = sum / d;
            }
        }
        let mut step = right;
        for i in 0..N {
            for k in 0..i {
                step[i] -= lower[i][k] * step[k];
            }
        }
        for i in (0..N).rev() {
            step[i] /= pivot[i];
            for k in i + 1..N {
                step[i] -= lower[k][i] * step[k];
            }
        }
        step.iter().all(|x| x.is_finite()).then_some(step)
    }
}
