//! A match's reprojection errors, whitened by the noise of both frames, and their derivatives by
//! the motion and by the disparity error.

use crate::geometry::{
    DisparityCorrection, ROW_SQUARE_MEAN, Shares, StereoObservation, StereoRig, Transform,
};

/// Noise of a column, px; a row's, the mean of two, has half the variance.
const NOISE_PX: f64 = 0.2;
/// Variances of left column, row and right column, in those of a column.
const VARIANCES: [f64; 3] = [1.0, 0.5, 1.0];
/// Squared error, in sigmas, from which a match has no weight for the witness.
const STRICT_SQUARED: f64 = 25.0;
/// Smallest disparity of a match that is used, px.
const DISPARITY_MIN_PX: f64 = 1.0;
/// Nearest depth of a point after the motion, m.
const DEPTH_MIN_M: f64 = 0.5;

/// Columns: rotation and translation, then constant, slope, fourth power and quadratic, then the
/// error.
pub(super) type Row = [f64; 11];

/// The rows of one match.
pub(super) struct MatchRows {
    pub rows: [Row; 3],
    /// Squared error in sigmas.
    squared: f64,
    /// Distance from the middle column as a share of that of the side.
    share: f64,
}

impl MatchRows {
    /// Weight of the match: less where the error is large (Cauchy), less towards the sides.
    pub(super) fn weight(&self, knee: f64) -> f64 {
        let share = self.share / knee;
        let square = share * share;
        let fourth = square * square;
        1.0 / ((1.0 + 0.25 * self.squared) * (1.0 + fourth * fourth))
    }

    /// Weight of the match for a witness: none where the error is larger than the motion explains
    /// (Tukey), less towards the sides.
    pub(super) fn strict_weight(&self, knee: f64) -> f64 {
        let share = self.share / knee;
        let square = share * share;
        let fourth = square * square;
        let left = 1.0 - self.squared / STRICT_SQUARED;
        if left > 0.0 { left * left / (1.0 + fourth * fourth) } else { 0.0 }
    }
}

/// Makes the rows of matches of one frame.
pub(super) struct Residuals<'r> {
    rig: &'r StereoRig,
    t_current_previous: &'r Transform,
    rotation: [[f64; 3]; 3],
    per_px: [f64; 2],
    /// Terms still to be added to disparities at the point of linearisation: constant, slope,
    /// fourth power, quadratic.
    ahead_px: [f64; 4],
}

impl<'r> Residuals<'r> {
    /// Residuals of observations corrected by `applied`, linearised at `at`.
    pub(super) fn new(
        rig: &'r StereoRig,
        t_current_previous: &'r Transform,
        applied: &DisparityCorrection,
        at: &DisparityCorrection,
    ) -> Self {
        Self {
            rig,
            t_current_previous,
            rotation: t_current_previous.rotation_matrix(),
            per_px: Shares::per_px(rig),
            // What the correction that is tried adds to the one that the observations have.
            ahead_px: [
                at.offset_px - applied.offset_px,
                at.slope_px - applied.slope_px,
                at.quartic_px - applied.quartic_px,
                at.row_quadratic_px - applied.row_quadratic_px,
            ],
        }
    }

    /// The rows of a match; `None` where it is too far, too near or not finite.
    pub(super) fn match_rows(
        &self,
        previous: &StereoObservation,
        current: &StereoObservation,
    ) -> Option<MatchRows> {
        let (previous, current) = (&self.ahead(previous), &self.ahead(current));
        // False for NaN as well.
        if !(previous.disparity_px() > DISPARITY_MIN_PX
            && current.disparity_px() > DISPARITY_MIN_PX)
        {
            return None;
        }
        let before = self.rig.triangulate(previous)?;
        let [x, y, z] = self.t_current_previous.transform_point(before);
        let predicted = self.rig.project([x, y, z]).filter(|_| z > DEPTH_MIN_M)?;
        let by_point = self.rig.project_jacobian([x, y, z]);
        // Noise of the previous observation reaches the prediction by triangulation, motion and
        // projection.
        let by_previous =
            product(&product(&by_point, &self.rotation), &self.rig.triangulate_jacobian(previous));
        let errors = [
            predicted.u_left_px - current.u_left_px,
            predicted.v_px - current.v_px,
            predicted.u_right_px - current.u_right_px,
        ];
        let (before, now) = (self.basis(previous), self.basis(current));
        // Derivatives by the motion: the carried point turned about each axis, then moved along it.
        let [mut left, mut row, mut right] = by_point
            .map(|[a, b, c]| [c * y - b * z, a * z - c * x, b * x - a * y, a, b, c])
            .map(rows_of);
        for (derivatives, [.., by_right]) in
            [&mut left, &mut row, &mut right].into_iter().zip(by_previous)
        {
            let [.., constant, slope, quartic, quadratic, _] = derivatives;
            // The correction moves the previous right column to the left ...
            for (entry, part) in [constant, slope, quartic, quadratic].into_iter().zip(before) {
                *entry = -by_right * part;
            }
        }
        let [.., constant, slope, quartic, quadratic, _] = &mut right;
        // ... and the current one, with which the prediction is compared.
        for (entry, part) in [constant, slope, quartic, quadratic].into_iter().zip(now) {
            *entry += part;
        }
        for (derivatives, value) in [&mut left, &mut row, &mut right].into_iter().zip(errors) {
            let [.., error] = derivatives;
            *error = value;
        }
        // Rows of unit noise can be added, those of near and far points alike.
        let rows = whitened([left, row, right], &covariance(&by_previous))?;
        let squared = rows.iter().fold(0.0, |sum, [.., error]| sum + error * error);
        squared.is_finite().then_some(MatchRows {
            rows,
            squared,
            share: current.u_left_px * self.per_px[0],
        })
    }

    /// An observation as the correction it is linearised at would leave it.
    fn ahead(&self, seen: &StereoObservation) -> StereoObservation {
        let ([constant, slope, quartic, quadratic], [a, b, c, d]) =
            (self.basis(seen), self.ahead_px);
        StereoObservation {
            u_right_px: seen.u_right_px - (a * constant + b * slope + c * quartic + d * quadratic),
            ..*seen
        }
    }

    /// Returns the factors of constant, slope, fourth power and quadratic.
    fn basis(&self, seen: &StereoObservation) -> [f64; 4] {
        let [across, down] = self.per_px;
        let (column, row) = (seen.u_right_px * across, seen.v_px * down);
        let square = column * column;
        [1.0, column, square * square, row * row - ROW_SQUARE_MEAN]
    }
}

/// Motion columns as a row whose other columns are 0.
fn rows_of([a, b, c, d, e, f]: [f64; 6]) -> Row {
    [a, b, c, d, e, f, 0.0, 0.0, 0.0, 0.0, 0.0]
}

#[expect(clippy::indexing_slicing, reason = "all indices are below 3")]
fn product(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    a.map(|row| core::array::from_fn(|j| row[0] * b[0][j] + row[1] * b[1][j] + row[2] * b[2][j]))
}

/// Covariance of an error: noise of the current frame and, carried along, of the previous one.
#[expect(clippy::indexing_slicing, reason = "all indices are below 3")]
fn covariance(by_previous: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    core::array::from_fn(|i| {
        core::array::from_fn(|j| {
            let carried = (0..3)
                .fold(0.0, |sum, k| sum + by_previous[i][k] * VARIANCES[k] * by_previous[j][k]);
            NOISE_PX * NOISE_PX * (carried + if i == j { VARIANCES[i] } else { 0.0 })
        })
    })
}

/// Rows multiplied by the inverse of the covariance's Cholesky factor: their errors are independent
/// and of sigma 1 then. `None` where the covariance is not positive definite.
#[expect(clippy::indexing_slicing, reason = "all indices are below 3 or run over whole rows")]
fn whitened(rows: [Row; 3], covariance: &[[f64; 3]; 3]) -> Option<[Row; 3]> {
    let mut factor = [[0.0; 3]; 3];
    let mut white = rows;
    for i in 0..3 {
        for j in 0..=i {
            let rest = (0..j).fold(covariance[i][j], |sum, k| sum - factor[i][k] * factor[j][k]);
            if i > j {
                factor[i][j] = rest / factor[j][j];
            } else if rest > 0.0 {
                factor[i][i] = libm::sqrt(rest);
            } else {
                return None;
            }
        }
        // Forward substitution, row by row, with the rows above.
        for k in 0..i {
            let (above, below) = white.split_at_mut(i);
            for (entry, other) in below[0].iter_mut().zip(&above[k]) {
                *entry -= factor[i][k] * other;
            }
        }
        for entry in &mut white[i] {
            *entry /= factor[i][i];
        }
    }
    Some(white)
}
