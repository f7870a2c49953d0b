//! Remaining error of a calibration in the rows, and its correction.

use super::{Shares, StereoRig};

/// Correction added to the rows of the right image, so that both cameras see a point in the same
/// row.
///
/// At shares `s` of the way from the principal point to the side of the image and `t` to its first
/// row: `constant + column s + row t + column_quadratic s² + product s t + row_quadratic t²`. The
/// constant and what grows with the column are what is left of the cameras' rotations, the rest is
/// what is left of their lenses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RowCorrection {
    /// Constant part of the correction, px.
    pub constant_px: f64,
    /// Growth with the column, px at the right side.
    pub column_px: f64,
    /// Growth from the middle row to the first one, px there.
    pub row_px: f64,
    /// Growth with the square of the distance from the middle column, px at the sides.
    pub column_quadratic_px: f64,
    /// Growth with column and row, px in the last column of the first row.
    pub product_px: f64,
    /// Growth with the square of the distance from the middle row, px at the first row.
    pub row_quadratic_px: f64,
}

impl RowCorrection {
    /// Number of terms.
    pub(crate) const TERMS: usize = 6;

    /// Powers of a pixel's shares, in the order of the terms.
    pub(crate) fn powers([s, t]: [f64; 2]) -> [f64; Self::TERMS] {
        [1.0, s, t, s * s, s * t, t * t]
    }

    /// Returns the terms in the order of the fields.
    pub(crate) fn terms(&self) -> [f64; Self::TERMS] {
        let Self {
            constant_px,
            column_px,
            row_px,
            column_quadratic_px,
            product_px,
            row_quadratic_px,
        } = *self;
        [constant_px, column_px, row_px, column_quadratic_px, product_px, row_quadratic_px]
    }

    /// The correction with these terms.
    pub(crate) fn of_terms(terms: [f64; Self::TERMS]) -> Self {
        let [constant_px, column_px, row_px, column_quadratic_px, product_px, row_quadratic_px] =
            terms;
        Self {
            constant_px,
            column_px,
            row_px,
            column_quadratic_px,
            product_px,
            row_quadratic_px,
        }
    }

    /// Returns the correction at shares of the way from the principal point to side and first row,
    /// px.
    pub(crate) fn at(&self, shares: [f64; 2]) -> f64 {
        self.terms()
            .iter()
            .zip(Self::powers(shares))
            .fold(0.0, |sum, (term, power)| sum + term * power)
    }

    /// The largest difference from another correction, at corners, middles of the borders and the
    /// principal point, px.
    pub(crate) fn largest_from_px(&self, other: &Self) -> f64 {
        let mut largest = 0.0;
        for shares in [-1.0, 0.0, 1.0].map(|s| [-1.0, 0.0, 1.0].map(|t| [s, t])).as_flattened() {
            let difference = libm::fabs(self.at(*shares) - other.at(*shares));
            largest = if difference > largest { difference } else { largest };
        }
        largest
    }

    /// The largest part of the image's rows, px: at corners, middles of the borders or the
    /// principal point.
    ///
    /// ```
    /// use dynvox_core::geometry::RowCorrection;
    ///
    /// let correction = RowCorrection { constant_px: 0.5, column_px: -1.0, ..RowCorrection::default() };
    /// assert_eq!(correction.largest_px(), 1.5);
    /// ```
    pub fn largest_px(&self) -> f64 {
        self.largest_from_px(&Self::default())
    }

    /// The angle by which the right camera is turned, which is what grows with the column, rad.
    pub(crate) fn roll_rad(&self, rig: &StereoRig) -> f64 {
        let [across, _] = Shares::per_px(rig);
        self.column_px * across
    }

    /// Prepares it for the images of a rig. A principal point in column 0 has no sides, one in row
    /// 0 no first row: what grows towards them is left out.
    pub(crate) fn for_rig(&self, rig: &StereoRig) -> RowShift {
        RowShift { terms_px: self.terms().map(|term| term as f32), shares: Shares::new(rig) }
    }
}

/// A [`RowCorrection`] for the images of a rig, in single precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RowShift {
    terms_px: [f32; RowCorrection::TERMS],
    shares: Shares,
}

impl RowShift {
    /// Returns the distance, px, by which the left image sees a point below row `v`, which the
    /// right one has in column `u`.
    #[inline(always)]
    pub(crate) fn at(&self, [u_px, v_px]: [f32; 2]) -> f32 {
        let (s, t) = (self.shares.across(u_px), self.shares.down(v_px));
        let [constant, column, row, column_2, both, row_2] = self.terms_px;
        (constant + t * (row + t * row_2)) + s * ((column + t * both) + s * column_2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIG: StereoRig =
        StereoRig { focal_px: 700.0, center_u_px: 600.0, center_v_px: 180.0, baseline_m: 0.5 };

    #[test]
    fn the_shift_of_a_rig_is_the_correction_at_its_pixels() {
        let correction = RowCorrection::of_terms([0.2, 0.05, 0.1, 0.2, -1.4, 0.1]);
        let shift = correction.for_rig(&RIG);
        for shares in [[0.0, 0.0], [1.0, -1.0], [-1.0, 0.5], [0.3, 1.0]] {
            let pixel = [600.0 * (1.0 + shares[0]), 180.0 * (1.0 + shares[1])].map(|px| px as f32);
            assert!((f64::from(shift.at(pixel)) - correction.at(shares)).abs() < 1e-5);
        }
    }
}
