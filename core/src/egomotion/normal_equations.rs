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

/// Errors of one point: predicted minus seen, as u left, u right, v left, v right.
fn residual(predicted: &StereoObservation, point: &Point) -> [f64; 4] {
    let StereoObservation { u_left_px, v_px, u_right_px } = *predicted;
    [
        u_left_px - point.left[0],
        u_right_px - point.right[0],
        v_px - point.left[1],
        v_px - point.right[1],
    ]
}

impl NormalEquations {
    pub(super) const ZERO: Self =
        Self { matrix: [[0.0; N]; N], vector: [0.0; N], error: 0.0, weight: 0.0 };

    /// Adds a point; one behind the camera adds nothing.
    #[inline]
    #[expect(
        clippy::indexing_slicing,
        reason = "both indices run below N, the length of every row"
    )]
    pub(super) fn add(
        &mut self,
        point: &Point,
        motion: &RotationMatrix,
        rig: &StereoRig,
        weight: impl Fn(f64) -> f64,
    ) {
        let p = motion.transform(point.xyz);
        let Some(predicted) = rig.project(p) else { return };
        let [x, y, z] = p;
        let [left, right, up_left, up_right] = residual(&predicted, point);
        let squared = left * left + right * right + up_left * up_left + up_right * up_right;
        let weight = weight(squared);
        // Derivatives of the projection by the carried point, times those of the carried point by
        // the step: a cross product and itself.
        let [u_left, v, u_right] = rig.project_jacobian(p);
        // Columns do not depend on y, nor the row on x: those derivatives are zero and left out.
        let row = |[a, _, c]: [f64; 3]| [c * y, a * z - c * x, -a * y, a, 0.0, c];
        let (u_left, u_right, [_, b, c]) = (row(u_left), row(u_right), v);
        let v = [c * y - b * z, -c * x, b * x, 0.0, b, c];
        // Both cameras see a point in the same row, so its derivatives serve twice.
        let both = up_left + up_right;
        for i in 0..N {
            self.vector[i] += weight * (u_left[i] * left + u_right[i] * right + v[i] * both);
            // The matrix is symmetric: only its lower triangle is summed.
            for j in 0..=i {
                self.matrix[i][j] +=
                    weight * (u_left[i] * u_left[j] + u_right[i] * u_right[j] + 2.0 * v[i] * v[j]);
            }
        }
        self.error += weight * squared;
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

    /// Slope of the error: J'r.
    pub(super) fn vector(&self) -> [f64; N] {
        self.vector
    }

    /// Adds the sums of other points.
    pub(super) fn merge(&mut self, other: &Self) {
        for (row, from) in self.matrix.iter_mut().zip(&other.matrix) {
            row.iter_mut().zip(from).for_each(|(sum, one)| *sum += one);
        }
        self.vector.iter_mut().zip(other.vector).for_each(|(sum, one)| *sum += one);
        self.error += other.error;
        self.weight += other.weight;
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
