//! Remaining error of a calibration in the disparity, and its correction.

use super::{Shares, StereoRig, scalar::floored_i32};
use crate::image::{DISPARITY_ONE_PX, DisparityQ8};

/// Mean square of the distances of matches from the middle row, in shares of that of the first row:
/// so much is taken off the square of each, and what grows over the rows says nothing of the
/// offset.
pub(crate) const ROW_SQUARE_MEAN: f64 = 0.2;

/// Correction added to a disparity, by where the right camera sees the point.
///
/// At shares `s` of the way from the principal point to the side of the image and `t` to its first
/// row: `offset + slope s + quartic s⁴ + quadratic (t² - 1/5)`. The offset is what is left of the
/// cameras' convergence, the rest is what is left of their lenses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DisparityCorrection {
    /// Constant part of the correction, px.
    pub offset_px: f64,
    /// Growth with the column, px at the right side.
    pub slope_px: f64,
    /// Growth with the fourth power of the distance from the middle column, px at the sides.
    pub quartic_px: f64,
    /// Growth with the square of the distance from the middle row, px from there to the first row.
    pub row_quadratic_px: f64,
}

/// A [`DisparityCorrection`] for a rig, in single precision: the same bits for matches and images.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PixelCorrection {
    offset_px: f32,
    slope_px: f32,
    quartic_px: f32,
    row_quadratic_px: f32,
    /// By how much the right camera is turned about its axis, rad.
    roll_rad: f32,
    shares: Shares,
}

impl DisparityCorrection {
    /// Prepares it for a rig. A principal point in column 0 has no sides, one in row 0 no first
    /// row: what grows towards them is left out.
    pub(crate) fn for_rig(&self, rig: &StereoRig) -> PixelCorrection {
        PixelCorrection {
            offset_px: self.offset_px as f32,
            slope_px: self.slope_px as f32,
            quartic_px: self.quartic_px as f32,
            row_quadratic_px: self.row_quadratic_px as f32,
            roll_rad: 0.0,
            shares: Shares::new(rig),
        }
    }

    /// Returns the correction for a disparity whose point the right camera of this rig sees at
    /// `[u, v]`, px.
    ///
    /// ```
    /// use dynvox_core::geometry::{DisparityCorrection, StereoRig};
    ///
    /// let rig = StereoRig { focal_px: 700.0, center_u_px: 600.0, center_v_px: 180.0, baseline_m: 0.5 };
    /// let correction = DisparityCorrection { offset_px: 0.25, row_quadratic_px: -0.5, ..DisparityCorrection::default() };
    /// assert!((correction.added_px(&rig, [300.0, 180.0]) - 0.35).abs() < 1e-6);
    /// assert!((correction.added_px(&rig, [300.0, 0.0]) + 0.15).abs() < 1e-6);
    /// ```
    pub fn added_px(&self, rig: &StereoRig, right_px: [f32; 2]) -> f32 {
        self.for_rig(rig).at(right_px)
    }

    /// Returns true if the correction changes nothing.
    ///
    /// ```
    /// use dynvox_core::geometry::DisparityCorrection;
    ///
    /// assert!(DisparityCorrection::default().is_zero());
    /// assert!(!DisparityCorrection { offset_px: 0.1, ..Default::default() }.is_zero());
    /// ```
    pub fn is_zero(&self) -> bool {
        *self == Self::default()
    }
}

impl PixelCorrection {
    /// Returns the correction for a right camera that is rotated as well: where the rotation moves
    /// rows by an angle times the column, it moves columns by the angle times the row.
    pub(crate) fn rolled(self, roll_rad: f64) -> Self {
        Self { roll_rad: roll_rad as f32, ..self }
    }

    /// Returns the correction for a disparity whose point the right camera sees at `[u, v]`, px.
    #[inline]
    pub(crate) fn at(&self, [u_px, v_px]: [f32; 2]) -> f32 {
        self.in_row(self.of_row(v_px), u_px)
    }

    /// Returns the part of the correction that all columns of a row share, px.
    #[inline(always)]
    fn of_row(&self, v_px: f32) -> f32 {
        let share = self.shares.down(v_px);
        self.offset_px
            + self.row_quadratic_px * (share * share - ROW_SQUARE_MEAN as f32)
            + self.roll_rad * self.shares.below_px(v_px)
    }

    /// Returns the correction in a column of a row, given the part that its columns share, px.
    #[inline(always)]
    fn in_row(&self, row_px: f32, u_px: f32) -> f32 {
        let share = self.shares.across(u_px);
        let square = share * share;
        row_px + self.slope_px * share + self.quartic_px * (square * square)
    }

    /// Maps a pixel of the right camera to that of the corrected rig.
    #[inline]
    pub(crate) fn corrected(&self, [u_px, v_px]: [f32; 2]) -> [f32; 2] {
        [u_px - self.at([u_px, v_px]), v_px]
    }

    /// The place in the picture as it is, for one of the corrected rig: the inverse of
    /// [`PixelCorrection::corrected`] but for a hundredth of the correction.
    #[inline]
    pub(crate) fn uncorrected(&self, [u_px, v_px]: [f32; 2]) -> [f32; 2] {
        [u_px + self.at([u_px, v_px]), v_px]
    }

    /// Corrects row `v` of disparities, 1/256 px, 0 none. What would be less than 1/256 px after it
    /// becomes none. The mark of what the matcher filled in stays.
    #[inline(always)]
    pub(crate) fn correct_row(&self, v: usize, disparity_q8: &mut [u16]) {
        const ONE_PX: f32 = DISPARITY_ONE_PX as f32;
        const MOST: f32 = u16::MAX as f32;
        let row_px = self.of_row(v as f32);
        for (u, disparity) in (0i32..).zip(disparity_q8) {
            let px = f32::from(*disparity) / ONE_PX;
            let value = (px + self.in_row(row_px, u as f32 - px)) * ONE_PX + 0.5;
            // What is below 0, and no number, becomes 0, which is none.
            let held = if value > 0.0 { value } else { 0.0 };
            let corrected = floored_i32(if held < MOST { held } else { MOST }) as u16;
            *disparity = DisparityQ8::new(*disparity).with_value(corrected).get();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::vec::Vec;

    const RIG: StereoRig =
        StereoRig { focal_px: 700.0, center_u_px: 600.0, center_v_px: 180.0, baseline_m: 0.5 };

    #[test]
    fn the_offset_is_the_same_everywhere_and_the_sides_grow() {
        let correction = DisparityCorrection {
            offset_px: 0.5,
            slope_px: 0.2,
            quartic_px: 1.0,
            row_quadratic_px: -0.4,
        }
        .for_rig(&RIG);
        for (at, expected) in [
            ([600.0, 180.0], 0.58),
            ([0.0, 180.0], 1.38),
            ([1200.0, 180.0], 1.78),
            ([300.0, 180.0], 0.58 - 0.1 + 1.0 / 16.0),
            ([600.0, 0.0], 0.18),
            ([600.0, 360.0], 0.18),
            ([600.0, 270.0], 0.48),
        ] {
            assert!((correction.at(at) - expected).abs() < 1e-5, "{at:?}");
            let [u, v] = correction.uncorrected(correction.corrected(at));
            assert!((u - at[0]).abs() < 0.02 && v == at[1]);
        }
        let middle = DisparityCorrection {
            offset_px: 0.5,
            slope_px: 9.0,
            quartic_px: 9.0,
            row_quadratic_px: 9.0,
        };
        assert_eq!(
            middle.for_rig(&StereoRig { center_u_px: 0.0, ..RIG }).at([50.0, 180.0]),
            0.5 - 9.0 * 0.2
        );
    }

    #[test]
    fn a_turned_camera_errs_with_the_row() {
        let turned = DisparityCorrection { offset_px: 0.5, ..DisparityCorrection::default() }
            .for_rig(&RIG)
            .rolled(0.005);
        assert!(
            (turned.at([50.0, 280.0]) - 1.0).abs() < 1e-6
                && (turned.at([900.0, 80.0])).abs() < 1e-6
        );
    }

    #[test]
    fn rows_are_corrected_where_there_is_a_disparity() {
        let correction =
            DisparityCorrection { offset_px: -0.5, ..DisparityCorrection::default() }.for_rig(&RIG);
        // None, a pixel, less than the shift, just as much, the largest, and a flag without
        // disparity.
        let mut row = [0, 256, 100, 128, 65_535, 1];
        correction.correct_row(0, &mut row);
        assert_eq!(row, [0, 128, 0, 0, 65_407, 0]);
        let far =
            DisparityCorrection { offset_px: 9.0, ..DisparityCorrection::default() }.for_rig(&RIG);
        let mut row = [65_535, 0];
        far.correct_row(0, &mut row);
        assert_eq!(row, [65_535, 0], "held at the end");
    }

    #[test]
    fn a_row_equals_its_twin_one_cast_at_a_time() {
        let mut random = Random::new(51);
        // No correction, usual ones, and some beyond those of any rig: limits must be alike.
        for ([offset_px, slope_px, quartic_px, row_quadratic_px], v) in [
            ([0.0; 4], 0),
            ([-0.7, 0.3, 0.2, 0.0], 5),
            ([-0.2, 0.3, 0.2, -0.6], 300),
            ([3.0, -40.0, 9.0, 1.0], 1_000),
            ([-200.0, 1.0, 0.0, 0.0], 7),
            ([f64::NAN, 0.0, 0.0, 0.0], 7),
        ] {
            let correction =
                DisparityCorrection { offset_px, slope_px, quartic_px, row_quadratic_px }
                    .for_rig(&RIG);
            // About half of the pixels have no disparity, as in a real image.
            let row: Vec<u16> = (0..1_301)
                .map(|_| random.below(65_536).saturating_sub(random.below(2) * 65_000) as u16)
                .collect();
            let mut corrected = row.clone();
            correction.correct_row(v, &mut corrected);
            for (u, (&before, after)) in row.iter().zip(corrected).enumerate() {
                let px = f32::from(before) / 256.0;
                let plain =
                    // The lowest bit is a flag, which is kept.
                    ((px + correction.at([u as f32 - px, v as f32])) * 256.0 + 0.5) as u16 & !1;
                assert_eq!(after, if before == 0 || plain == 0 { 0 } else { plain | before & 1 });
            }
        }
    }
}
