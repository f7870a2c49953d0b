//! Covariance of a motion, from the inliers' errors as measured and from their geometry.
//!
//! Each inlier pulls at the motion by its own error; at rest the pulls cancel, and their spread is
//! what the motion may be off by (Huber's sandwich estimator). No noise is assumed: rain or blurred
//! images make errors larger, and far points alone make their effect larger. Errors that all
//! matches share cancel in no sum and show in no residual, so that they are added by name.

use super::{
    normal_equations::{NormalEquations, PointRows, RotationMatrix},
    points::Point,
};
use crate::{
    geometry::{StereoRig, Transform},
    state::Visitor,
};
use bytemuck::{Pod, Zeroable};

const N: usize = 6;
/// Entries of the lower half of a matrix of six rows.
const ENTRIES: usize = N * (N + 1) / 2;
/// Factor on the spread: neighbouring matches, and both images of one, err alike.
const SPREAD: f64 = 1.5;
/// Standard deviations of what all matches share, px, as the errors it makes of a point (column in
/// the left and in the right image, both rows together): columns of both images, rows of both,
/// columns of the left image only.
const SHARED_PX: [[f64; 3]; 3] = [[0.03, 0.03, 0.0], [0.0, 0.0, 0.06], [0.02, 0.0, 0.0]];
/// Error along the flow that all matches share, as a share of the flow, and at most, px: refinement
/// lags behind flow of less than a pixel, or runs ahead of it.
const FLOW_SHARE: f64 = 0.2;
const FLOW_PX: f64 = 0.02;
/// Standard deviation of the rig's scale: baseline and focal length.
const SCALE_SHARE: f64 = 0.005;

/// Weights of a point in a covariance.
pub(super) struct PointWeights {
    /// Weight of its error: what the point pulls at the motion with.
    pub(super) pull: f64,
    /// Weight of a further error: how much more it then pulls.
    pub(super) growth: f64,
}

/// Covariance of a rotation (rad) and a translation (m), in the current camera's frame: x to the
/// right, y down, z ahead.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotionCovariance {
    /// Lower half, row by row: three rows of the rotation vector, three of the translation.
    lower: [f64; ENTRIES],
}

impl MotionCovariance {
    /// Covariance of a motion that is known.
    pub const ZERO: Self = Self { lower: [0.0; ENTRIES] };

    /// Derives the covariance of `motion` from the points it explains, each weighted by itself and
    /// by its squared error (px²). `None` if they do not determine one.
    #[inline(never)]
    pub(super) fn from_points(
        motion: &Transform,
        rig: &StereoRig,
        points: impl Iterator<Item = Point>,
        weights: impl Fn(&Point, f64) -> PointWeights,
    ) -> Option<Self> {
        let matrix = RotationMatrix::new(motion);
        let mut sums = NormalEquations::ZERO;
        let mut spread = [[0.0; N]; N];
        let mut shared = [[0.0; N]; SHARED_PX.len()];
        let mut along_flow = [0.0; N];
        for point in points {
            let Some(rows) = PointRows::new(&point, &matrix, rig) else { continue };
            let PointWeights { pull, growth } = weights(&point, rows.squared);
            sums.add_rows(&rows, growth);
            let pull = rows.slope(rows.residuals).map(|slope| pull * slope);
            // Two matches of one corner err together; the factor stands for that.
            add_outer(&mut spread, pull, SPREAD * SPREAD);
            // A shared error adds to the pulls of all points.
            for (sum, error) in shared.iter_mut().zip(SHARED_PX) {
                sum.iter_mut().zip(rows.slope(error)).for_each(|(s, slope)| *s += growth * slope);
            }
            let slope = rows.slope(flow_error(&point, rig));
            along_flow.iter_mut().zip(slope).for_each(|(s, slope)| *s += growth * slope);
        }
        add_outer(&mut spread, along_flow, 1.0);
        for pull in shared {
            add_outer(&mut spread, pull, 1.0);
        }
        let mut covariance = sums.sandwich(&spread)?;
        // A wrong scale lengthens the way that was driven.
        let [x, y, z] = motion.translation_m;
        add_outer(&mut covariance, [0.0, 0.0, 0.0, x, y, z], SCALE_SHARE * SCALE_SHARE);
        Some(Self::from_matrix(&covariance))
    }

    /// Covariance from a symmetric matrix (its lower half counts): rotation vector (rad),
    /// then translation (m).
    pub fn from_matrix(matrix: &[[f64; N]; N]) -> Self {
        let mut entries = (1..).zip(matrix).flat_map(|(len, row)| row.iter().take(len));
        Self { lower: core::array::from_fn(|_| entries.next().copied().unwrap_or_default()) }
    }

    /// Symmetric matrix: rotation vector (rad), then translation (m).
    pub fn matrix(&self) -> [[f64; N]; N] {
        core::array::from_fn(|row| core::array::from_fn(|column| self.entry(row, column)))
    }

    /// Lower half of the matrix, row by row.
    pub(crate) fn lower(&self) -> [f64; ENTRIES] {
        self.lower
    }

    /// Adds another covariance, times a factor.
    pub(crate) fn add_scaled(&mut self, other: &Self, factor: f64) {
        let entries = self.lower.iter_mut().zip(&other.lower);
        entries.for_each(|(entry, value)| *entry += factor * value);
    }

    /// Row of the matrix.
    pub(crate) fn row(&self, row: usize) -> [f64; N] {
        core::array::from_fn(|column| self.entry(row, column))
    }

    /// Visits the entries.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        visitor.f64s(&mut self.lower);
    }

    /// Standard deviations of the rotation about the current camera's axes, rad.
    pub fn rotation_sigma_rad(&self) -> [f64; 3] {
        core::array::from_fn(|axis| libm::sqrt(self.entry(axis, axis)))
    }

    /// Standard deviations of the translation along the current camera's axes, m: to the right,
    /// down, ahead.
    pub fn translation_sigma_m(&self) -> [f64; 3] {
        core::array::from_fn(|axis| libm::sqrt(self.entry(axis + 3, axis + 3)))
    }

    /// Standard deviation of the position, over all directions, m.
    pub fn distance_sigma_m(&self) -> f64 {
        libm::sqrt((3..N).map(|axis| self.entry(axis, axis)).sum())
    }

    /// Standard deviation of the orientation, over all axes, rad.
    pub fn angle_sigma_rad(&self) -> f64 {
        libm::sqrt((0..3).map(|axis| self.entry(axis, axis)).sum())
    }

    /// Covariance of a pose after a motion, whose own covariance this is, from that of the pose
    /// `before` it. Errors of both count as independent.
    ///
    /// ```
    /// use dynvox_core::{egomotion::MotionCovariance, geometry::Transform};
    ///
    /// // Yaw (about the axis that points down) is known within 0.01 rad, ten metres ago.
    /// let mut matrix = [[0.0; 6]; 6];
    /// matrix[1][1] = 1e-4;
    /// let ahead = Transform::from_translation([0.0, 0.0, -10.0]);
    /// let pose = MotionCovariance::ZERO.after(&MotionCovariance::from_matrix(&matrix), &ahead);
    /// let [right_m, _, ahead_m] = pose.translation_sigma_m();
    /// assert!((right_m - 0.1).abs() < 1e-9 && ahead_m == 0.0);
    /// ```
    // Never inlined: its matrices would be on the stack of each caller.
    #[inline(never)]
    #[must_use]
    pub fn after(&self, before: &Self, t_current_previous: &Transform) -> Self {
        let change = t_current_previous.adjoint();
        let (before, mut sum) = (before.matrix(), self.matrix());
        for (sums, row) in sum.iter_mut().zip(&change) {
            let carried = before.map(|from| dot(row, &from));
            sums.iter_mut().zip(&change).for_each(|(s, other)| *s += dot(&carried, other));
        }
        Self::from_matrix(&sum)
    }

    /// Joins the motion with a turn that something else measured: `error_rad` is that turn less the
    /// motion's, in the current camera's frame, `variance` that of an axis, rad². Returns the step
    /// (rotation vector, translation) to the likeliest motion, and its covariance (three
    /// corrections of a Kalman filter).
    #[inline(never)]
    pub(super) fn with_turn(&self, error_rad: [f64; 3], variance: f64) -> ([f64; N], Self) {
        let (mut step, mut joined) = ([0.0; N], *self);
        for (axis, error_rad) in error_rad.into_iter().enumerate() {
            let column = joined.row(axis);
            let sum = joined.entry(axis, axis) + variance;
            // False for NaN as well.
            if !(sum > 0.0 && sum < f64::INFINITY) {
                continue;
            }
            // The step so far has corrected a part of the error.
            let left_rad = error_rad - step.get(axis).copied().unwrap_or_default();
            step.iter_mut().zip(column).for_each(|(step, own)| *step += own / sum * left_rad);
            let matrix = joined.matrix().map(|row| {
                let gain = row.get(axis).copied().unwrap_or_default() / sum;
                let mut columns = row.into_iter().zip(column);
                core::array::from_fn(|_| columns.next().map_or(0.0, |(old, own)| old - gain * own))
            });
            joined = Self::from_matrix(&matrix);
        }
        (step, joined)
    }

    fn entry(&self, row: usize, column: usize) -> f64 {
        let (high, low) = if row < column { (column, row) } else { (row, column) };
        self.lower.get(high * (high + 1) / 2 + low).copied().unwrap_or_default()
    }
}

/// Error of a point along its flow, px: column in the left and in the right image, both rows
/// together.
fn flow_error(point: &Point, rig: &StereoRig) -> [f64; 3] {
    let Some(before) = rig.project(point.xyz) else { return [0.0; 3] };
    let left = [point.left[0] - before.u_left_px, point.left[1] - before.v_px];
    let right = [point.right[0] - before.u_right_px, point.right[1] - before.v_px];
    let [left, right] = [left, right].map(|[along, down]| {
        let flow_px = libm::sqrt(along * along + down * down);
        let most = FLOW_PX / FLOW_SHARE;
        let share = if flow_px > most { FLOW_PX / flow_px } else { FLOW_SHARE };
        [share * along, share * down]
    });
    [left[0], right[0], left[1] + right[1]]
}

fn add_outer(sum: &mut [[f64; N]; N], vector: [f64; N], factor: f64) {
    for (row, a) in sum.iter_mut().zip(vector) {
        row.iter_mut().zip(vector).for_each(|(entry, b)| *entry += factor * a * b);
    }
}

fn dot(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests;
