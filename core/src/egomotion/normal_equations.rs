//! The normal equations of a reprojection error, and their solution.
//!
//! The motion is moved by a small rotation vector and translation on its left: T <-
//! T.retract(step). Per point three different rows: u in the left image, u in the right one, and v,
//! which both images share and which therefore counts twice.

use super::points::Point;
use crate::geometry::{StereoObservation, StereoRig, Transform};

const N: usize = 6;
/// With a pivot below this share of its diagonal the motion is not determined.
const PIVOT_MIN: f64 = 1e-12;

/// Sums of weighted J'J (lower half) and J'r over points, in the order of the points.
pub(super) struct NormalEquations {
    matrix: [[f64; N]; N],
    vector: [f64; N],
    /// Sum of weighted squared errors, px².
    pub error: f64,
    /// Sum of weights.
    pub weight: f64,
}

/// A motion with its rotation as a matrix.
pub(super) struct RotationMatrix {
    rows: [[f64; 3]; 3],
    translation_m: [f64; 3],
}

impl RotationMatrix {
    pub(super) fn new(motion: &Transform) -> Self {
        Self { rows: motion.rotation_matrix(), translation_m: motion.translation_m }
    }

    /// Transforms a point into the current camera.
    fn transform(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let ([a, b, c], [tx, ty, tz]) = (self.rows, self.translation_m);
        let row = |r: [f64; 3], t: f64| r[0] * x + r[1] * y + r[2] * z + t;
        [row(a, tx), row(b, ty), row(c, tz)]
    }
}

/// Derivatives of a point's projection by the step, and the errors it leaves.
pub(super) struct PointRows {
    u_left: [f64; N],
    u_right: [f64; N],
    /// Row of either image: both cameras see a point in the same one, so it serves twice.
    v: [f64; N],
    /// Predicted minus seen, px: column in the left and in the right image, both rows together.
    pub residuals: [f64; 3],
    /// Sum of the squares of all four errors, px².
    pub squared: f64,
}

impl PointRows {
    /// Rows of a point; `None` for one behind the camera.
    #[inline]
    pub(super) fn new(point: &Point, motion: &RotationMatrix, rig: &StereoRig) -> Option<Self> {
        let p = motion.transform(point.xyz);
        let StereoObservation { u_left_px, v_px, u_right_px } = rig.project(p)?;
        let (left, right) = (u_left_px - point.left[0], u_right_px - point.right[0]);
        let (up_left, up_right) = (v_px - point.left[1], v_px - point.right[1]);
        let squared = left * left + right * right + up_left * up_left + up_right * up_right;
        let [x, y, z] = p;
        // Derivatives of the projection by the carried point, times those of the carried point by
        // the step: a cross product and itself.
        let [u_left, [_, b, c], u_right] = rig.project_jacobian(p);
        // Columns do not depend on y, nor the row on x: those derivatives are zero and left out.
        let row = |[a, _, c]: [f64; 3]| [c * y, a * z - c * x, -a * y, a, 0.0, c];
        Some(Self {
            u_left: row(u_left),
            u_right: row(u_right),
            v: [c * y - b * z, -c * x, b * x, 0.0, b, c],
            residuals: [left, right, up_left + up_right],
            squared,
        })
    }

    /// Slope of half the squared error by the step, were these the errors.
    #[inline]
    pub(super) fn slope(&self, [left, right, both]: [f64; 3]) -> [f64; N] {
        let mut columns = self.u_left.iter().zip(&self.u_right).zip(&self.v);
        core::array::from_fn(|_| {
            columns.next().map_or(0.0, |((l, r), v)| l * left + r * right + v * both)
        })
    }
}

impl NormalEquations {
    pub(super) const ZERO: Self =
        Self { matrix: [[0.0; N]; N], vector: [0.0; N], error: 0.0, weight: 0.0 };

    /// Adds a point; one behind the camera adds nothing.
    #[inline]
    pub(super) fn add(
        &mut self,
        point: &Point,
        motion: &RotationMatrix,
        rig: &StereoRig,
        weight: impl Fn(f64) -> f64,
    ) {
        let Some(rows) = PointRows::new(point, motion, rig) else { return };
        self.add_rows(&rows, weight(rows.squared));
    }

    /// Adds the rows of a point.
    #[inline]
    #[expect(
        clippy::indexing_slicing,
        reason = "both indices run below N, the length of every row"
    )]
    pub(super) fn add_rows(&mut self, rows: &PointRows, weight: f64) {
        let PointRows { u_left, u_right, v, .. } = rows;
        for (sum, slope) in self.vector.iter_mut().zip(rows.slope(rows.residuals)) {
            *sum += weight * slope;
        }
        for i in 0..N {
            // The matrix is symmetric: only its lower triangle is summed.
            for j in 0..=i {
                self.matrix[i][j] +=
                    weight * (u_left[i] * u_left[j] + u_right[i] * u_right[j] + 2.0 * v[i] * v[j]);
            }
        }
        self.error += weight * rows.squared;
        self.weight += weight;
    }

    /// Adds one row: how a residual changes with the step, the residual, its weight.
    #[inline]
    #[expect(
        clippy::indexing_slicing,
        reason = "both indices run below N, the length of every row"
    )]
    pub(super) fn add_row(&mut self, row: [f64; N], residual: f64, weight: f64) {
        for i in 0..N {
            self.vector[i] += weight * row[i] * residual;
            // The lower triangle alone: the matrix is symmetric.
            for j in 0..=i {
                self.matrix[i][j] += weight * row[i] * row[j];
            }
        }
        self.error += weight * residual * residual;
        self.weight += weight;
    }

    /// Returns a lower bound of the information on the translation's least determined direction, as
    /// a share of what rows that all point that way would give, from the trace of the translation's
    /// covariance. 0 if the rows do not determine a motion.
    pub(super) fn min_eigen_share(&self) -> f64 {
        // A column of the inverse: the equations solved for a unit vector.
        let variance = |axis: usize| {
            let unit = core::array::from_fn(|at| if at == axis { 1.0 } else { 0.0 });
            self.solve_for(unit).and_then(|solution| solution.get(axis).copied())
        };
        // The sum of the variances is at least the largest one, so that the bound is on the safe
        // side.
        match (variance(3), variance(4), variance(5)) {
            (Some(x), Some(y), Some(z)) if self.weight > 0.0 => 1.0 / ((x + y + z) * self.weight),
            _ => 0.0,
        }
    }

    /// The step (rotation vector, translation) to the minimum, by LDL'; `None` where the points do
    /// not determine one.
    pub(super) fn solve(&self) -> Option<[f64; N]> {
        self.solve_for(self.vector.map(|x| -x))
    }

    /// The covariance of the step to the minimum, from that of the slope (symmetric): both sides
    /// multiplied by the inverse of the sums' matrix. `None` where it has none.
    pub(super) fn sandwich(&self, slope: &[[f64; N]; N]) -> Option<[[f64; N]; N]> {
        let mut half = [[0.0; N]; N];
        for (row, from) in half.iter_mut().zip(slope) {
            *row = self.solve_for(*from)?;
        }
        // Rows of the half are solutions; its columns are what remains to be solved for.
        let mut whole = [[0.0; N]; N];
        for (at, row) in whole.iter_mut().enumerate() {
            *row = self.solve_for(half.map(|row| row.get(at).copied().unwrap_or_default()))?;
        }
        Some(whole)
    }

    /// Solves the sums' matrix for `right`.
    #[expect(clippy::indexing_slicing, reason = "all indices run below N, the length of every row")]
    fn solve_for(&self, right: [f64; N]) -> Option<[f64; N]> {
        let mut lower = self.matrix;
        let mut pivot = [0.0; N];
        // Cholesky's factors without square roots: L D L'.
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
        // Forward substitution, then division by D and backward substitution.
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

#[cfg(test)]
mod tests;
