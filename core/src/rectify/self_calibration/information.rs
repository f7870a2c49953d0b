//! An information filter over `P` parameters of the rig, and the sums a frame gives it.
//!
//! A frame's sums are the normal equations of its reprojection errors by the camera's motion (six
//! columns), the parameters (`P`) and the error itself (one): `C = 6 + P + 1` columns. Eliminating
//! the motion leaves what the frame says about the parameters alone (a Schur complement).

use crate::state::Visitor;

/// Columns of the camera's motion: rotation, translation.
pub(super) const MOTION: usize = 6;
/// A pivot below this share of its diagonal leaves the motion undetermined.
const PIVOT_MIN: f64 = 1e-12;
/// Share of what was known that a frame leaves: half is forgotten after 69 frames.
const MEMORY: f64 = 0.99;

/// Lower half of the sums of weighted products of columns.
pub(super) struct Sums<const C: usize>([[f64; C]; C]);

/// Information of a frame on the parameters: `S` and `q` of `S step = -q`.
pub(super) struct FrameInformation<const P: usize> {
    pub matrix: [[f64; P]; P],
    pub vector: [f64; P],
}

/// One parameter without the others and without what was known before.
#[derive(Clone, Copy, Debug)]
pub(super) struct SingleEstimate {
    pub px: f64,
    /// Inverse of the variance, 1/px².
    pub information: f64,
}

#[expect(
    clippy::indexing_slicing,
    clippy::needless_range_loop,
    reason = "all indices run below P, the length of all rows"
)]
impl<const P: usize> FrameInformation<P> {
    pub(super) const ZERO: Self = Self { matrix: [[0.0; P]; P], vector: [0.0; P] };

    /// Returns what the frame says of its first parameter if the others are as linearised, `at_px`
    /// being where it was; `None` where it says nothing.
    pub(super) fn offset_from(&self, at_px: f64) -> Option<SingleEstimate> {
        let information = self.matrix[0][0];
        // False for NaN as well.
        (information > 0.0)
            .then(|| SingleEstimate { px: at_px - self.vector[0] / information, information })
    }

    fn is_finite(&self) -> bool {
        self.matrix.as_flattened().iter().chain(&self.vector).all(|value| value.is_finite())
    }

    /// Returns the parameters' target, multiplied by the matrix, for errors that were taken at
    /// `at`.
    fn target(&self, at: [f64; P]) -> [f64; P] {
        core::array::from_fn(|i| {
            (0..P).fold(-self.vector[i], |sum, j| sum + self.matrix[i][j] * at[j])
        })
    }

    /// Adds a row of derivatives and its error.
    #[inline]
    pub(super) fn add(&mut self, row: &[f64; P], error: f64, weight: f64) {
        for i in 0..P {
            let weighted = weight * row[i];
            self.vector[i] += weighted * error;
            for j in 0..P {
                self.matrix[i][j] += weighted * row[j];
            }
        }
    }
}

#[expect(
    clippy::indexing_slicing,
    clippy::needless_range_loop,
    reason = "all indices run below C or P, the lengths of all rows"
)]
impl<const C: usize> Sums<C> {
    pub(super) const ZERO: Self = Self([[0.0; C]; C]);

    /// Adds a row of whitened derivatives, the error in its last column.
    #[inline]
    pub(super) fn add(&mut self, row: &[f64; C], weight: f64) {
        for i in 0..C {
            let weighted = weight * row[i];
            for j in 0..=i {
                self.0[i][j] += weighted * row[j];
            }
        }
    }

    /// Eliminates the motion. `None` where the matches do not determine it, or where a sum is not
    /// finite.
    pub(super) fn without_motion<const P: usize>(&self) -> Option<FrameInformation<P>> {
        let mut lower = self.0;
        // Gauss's elimination of the motion leaves the Schur complement: what the matches say about
        // the other unknowns, with any motion.
        for k in 0..MOTION {
            let pivot = lower[k][k];
            // False for NaN as well.
            if !(pivot > PIVOT_MIN * self.0[k][k] && pivot < f64::INFINITY) {
                return None;
            }
            for i in k + 1..C {
                let factor = lower[i][k] / pivot;
                for j in k + 1..=i {
                    lower[i][j] -= factor * lower[j][k];
                }
            }
        }
        // Only the lower triangle was eliminated.
        let at = |i: usize, j: usize| {
            if i > j { lower[MOTION + i][MOTION + j] } else { lower[MOTION + j][MOTION + i] }
        };
        let matrix = core::array::from_fn(|i| core::array::from_fn(|j| at(i, j)));
        let vector = core::array::from_fn(|i| lower[C - 1][MOTION + i]);
        let frame = FrameInformation { matrix, vector };
        frame.is_finite().then_some(frame)
    }
}

/// Information on the parameters: `L`, `e`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Information<const P: usize> {
    matrix: [[f64; P]; P],
    vector: [f64; P],
}

/// Prior of a filter, px.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prior<const P: usize> {
    /// Parameters before the first frame.
    pub mean: [f64; P],
    /// Standard deviations of the parameters before the first frame.
    pub sigma: [f64; P],
    /// Standard deviations of one frame's errors that the model does not describe.
    pub frame_sigma: [f64; P],
}

#[expect(
    clippy::indexing_slicing,
    clippy::needless_range_loop,
    reason = "all indices run below P, the length of all rows"
)]
impl<const P: usize> Information<P> {
    pub(super) const NONE: Self = Self { matrix: [[0.0; P]; P], vector: [0.0; P] };

    /// Returns the first parameter if the others are 0, without the prior; `None` where nothing is
    /// known of it.
    pub(super) fn first_alone(&self) -> Option<SingleEstimate> {
        let information = self.matrix[0][0];
        (information > 0.0)
            .then(|| SingleEstimate { px: self.vector[0] / information, information })
    }

    /// Takes a frame in, linearised at `at`, that is worth a `share` of an independent one. With
    /// `F` the variances a frame may be off by, it counts as
    /// `(S⁻¹ + F)⁻¹`, which is `S - S D (I + D S D)⁻¹ D S` with `D² = F` and needs no
    /// inverse of `S`.
    // Never inlined, as all that has many callers here: it is unrolled, and large.
    #[inline(never)]
    pub(super) fn take(
        &mut self,
        prior: &Prior<P>,
        frame: &FrameInformation<P>,
        at: [f64; P],
        share: f64,
    ) -> Option<()> {
        // A frame's own deviation widens its covariance to S^-1 + D^2. Its inverse is S - S D (1 +
        // D S D)^-1 D S, which needs no inverse of S: S may be singular.
        let (s, d) = (&frame.matrix, prior.frame_sigma);
        let damped: [[f64; P]; P] = core::array::from_fn(|i| {
            core::array::from_fn(|j| d[i] * s[i][j] * d[j] + if i == j { 1.0 } else { 0.0 })
        });
        let reduce = |right: [f64; P]| -> Option<[f64; P]> {
            let inner = solve(&damped, core::array::from_fn(|i| d[i] * right[i]))?;
            Some(core::array::from_fn(|i| {
                right[i] - (0..P).fold(0.0, |sum, j| sum + s[i][j] * d[j] * inner[j])
            }))
        };
        let mut matrix = [[0.0; P]; P];
        for (j, column) in matrix.iter_mut().enumerate() {
            // Columns of a symmetric matrix stand for its rows.
            *column = reduce(core::array::from_fn(|i| s[i][j]))?;
        }
        let vector = reduce(frame.target(at))?;
        self.add(&matrix, &vector, share);
        Some(())
    }

    /// Takes a frame in, linearised at `at`, that is off by nothing but its noise.
    pub(super) fn take_exact(&mut self, frame: &FrameInformation<P>, at: [f64; P]) -> Option<()> {
        let target = FrameInformation { matrix: frame.matrix, vector: frame.target(at) };
        target.is_finite().then(|| self.add(&target.matrix, &target.vector, 1.0))
    }

    /// Adds a share of what a frame says, after forgetting a little of what was known.
    #[inline]
    fn add(&mut self, matrix: &[[f64; P]; P], vector: &[f64; P], share: f64) {
        // Frames that are worth little replace little.
        let memory = 1.0 - share * (1.0 - MEMORY);
        for i in 0..P {
            self.vector[i] = memory * self.vector[i] + share * vector[i];
            for j in 0..P {
                self.matrix[i][j] =
                    memory * self.matrix[i][j] + share * (0.5 * (matrix[i][j] + matrix[j][i]));
            }
        }
    }

    /// The parameters and the error of the first one, px.
    #[inline(never)]
    pub(super) fn estimate(&self, prior: &Prior<P>) -> Option<([f64; P], f64)> {
        let weight = |i: usize| 1.0 / (prior.sigma[i] * prior.sigma[i]);
        // The prior adds its own information on the diagonal.
        let matrix: [[f64; P]; P] = core::array::from_fn(|i| {
            core::array::from_fn(|j| self.matrix[i][j] + if i == j { weight(i) } else { 0.0 })
        });
        let parameters =
            solve(&matrix, core::array::from_fn(|i| self.vector[i] + weight(i) * prior.mean[i]))?;
        // A column of the inverse: its first entry is the first parameter's variance.
        let variance = solve(&matrix, core::array::from_fn(|i| if i == 0 { 1.0 } else { 0.0 }))?;
        Some((parameters, libm::sqrt(variance[0])))
    }

    /// The deviation of one parameter, px.
    #[inline(never)]
    pub(super) fn sigma_px(&self, prior: &Prior<P>, of: usize) -> Option<f64> {
        let matrix: [[f64; P]; P] = core::array::from_fn(|i| {
            core::array::from_fn(|j| {
                let own = if i == j { 1.0 / (prior.sigma[i] * prior.sigma[i]) } else { 0.0 };
                self.matrix[i][j] + own
            })
        });
        let column = solve(&matrix, core::array::from_fn(|i| if i == of { 1.0 } else { 0.0 }))?;
        column.get(of).map(|variance| libm::sqrt(*variance))
    }

    /// Visits every field.
    pub(super) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { matrix, vector } = self;
        visitor.f64s(matrix.as_flattened_mut());
        visitor.f64s(vector);
    }
}

/// Solves a positive definite matrix for `right`; `None` if it is not positive definite.
#[expect(
    clippy::indexing_slicing,
    clippy::needless_range_loop,
    reason = "all indices run below P, the length of all rows"
)]
#[inline(never)]
fn solve<const P: usize>(matrix: &[[f64; P]; P], right: [f64; P]) -> Option<[f64; P]> {
    // No pivoting: a matrix that is not positive definite is refused.
    let (mut upper, mut solution) = (*matrix, right);
    for k in 0..P {
        // False for NaN as well.
        if !(upper[k][k] > 0.0 && upper[k][k] < f64::INFINITY) {
            return None;
        }
        for i in k + 1..P {
            let factor = upper[i][k] / upper[k][k];
            for j in k..P {
                upper[i][j] -= factor * upper[k][j];
            }
            solution[i] -= factor * solution[k];
        }
    }
    for k in (0..P).rev() {
        for j in k + 1..P {
            solution[k] -= upper[k][j] * solution[j];
        }
        solution[k] /= upper[k][k];
    }
    solution.iter().all(|value| value.is_finite()).then_some(solution)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_positive_definite_matrix_is_solved_and_another_refused() {
        let matrix = [[4.0, 1.0, 0.5], [1.0, 3.0, -0.2], [0.5, -0.2, 2.0]];
        let [x, y, z] =
            solve(&matrix, [4.0 + 2.0 + 1.5, 1.0 + 6.0 - 0.6, 0.5 - 0.4 + 6.0]).unwrap();
        assert!((x - 1.0).abs() < 1e-12 && (y - 2.0).abs() < 1e-12 && (z - 3.0).abs() < 1e-12);
        assert_eq!(solve(&[[1.0, 2.0], [2.0, 1.0]], [1.0, 1.0]), None);
        assert_eq!(solve(&[[f64::NAN]], [1.0]), None);
    }

    #[test]
    fn a_frame_counts_no_more_than_what_it_may_be_off_by() {
        let prior = Prior { mean: [0.0], sigma: [0.5], frame_sigma: [0.1] };
        let mut information = Information::NONE;
        // A frame that is certain of 0.4 px, were it not for what the model lacks.
        let frame = FrameInformation { matrix: [[1e9]], vector: [-0.4e9] };
        information.take(&prior, &frame, [0.0], 1.0).unwrap();
        let ([found], sigma) = information.estimate(&prior).unwrap();
        assert!((sigma - 0.098).abs() < 1e-3 && (found - 0.4).abs() < 0.02, "{found} {sigma}");
        let start = Prior { mean: [0.7], ..prior };
        assert_eq!(
            Information::NONE.estimate(&start).unwrap(),
            ([0.7], 0.5),
            "before the first frame the prior is all there is"
        );
    }

    #[test]
    fn motion_is_eliminated_or_said_to_be_undetermined() {
        let mut sums = Sums::<8>::ZERO;
        assert!(sums.without_motion::<1>().is_none());
        for k in 0..7 {
            let mut row = [0.0; 8];
            (row[k], row[6], row[7]) = (1.0, 1.0, if k == 6 { 3.0 } else { 0.0 });
            sums.add(&row, 1.0);
        }
        // Six rows are used up by the motion; the seventh is left: parameter 1, error 3.
        let left = sums.without_motion::<1>().unwrap();
        assert!((left.matrix[0][0] - 1.0).abs() < 1e-12 && (left.vector[0] - 3.0).abs() < 1e-12);
    }
}
