//! What is left of a calibration's error in the disparity, and how it is taken out.

use super::{StereoRig, scalar::floored_i32};
use crate::image::{DISPARITY_FILLED, DISPARITY_ONE_PX};

/// What must be added to a disparity, by where the right camera sees the point.
///
/// At share `s = (u_right - c) / c` of the way from the principal point `c` to the side of the
/// image: `offset + slope s + quartic s⁴`. The offset is what is left of the cameras' convergence,
/// the fourth power what is left of their lenses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DisparityCorrection {
    /// The same everywhere, px.
    pub offset_px: f64,
    /// Growth with the column, px at the right side.
    pub slope_px: f64,
    /// Growth with the fourth power of the distance from the middle column, px at the sides.
    pub quartic_px: f64,
}

/// A [`DisparityCorrection`] for a rig, in single precision: the same bits for matches and images.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ColumnCorrection {
    offset_px: f32,
    slope_px: f32,
    quartic_px: f32,
    center_u_px: f32,
    per_px: f32,
}

impl DisparityCorrection {
    /// Prepares it for a rig. A principal point in column 0 has no sides: only the offset is left.
    pub(crate) fn for_rig(&self, rig: &StereoRig) -> ColumnCorrection {
        let center = rig.center_u_px;
        ColumnCorrection {
            offset_px: self.offset_px as f32,
            slope_px: self.slope_px as f32,
            quartic_px: self.quartic_px as f32,
            center_u_px: center as f32,
            per_px: if libm::fabs(center) >= 1.0 { (1.0 / center) as f32 } else { 0.0 },
        }
    }

    /// Whether it changes nothing.
    pub fn is_zero(&self) -> bool {
        *self == Self::default()
    }
}

impl ColumnCorrection {
    /// What must be added to a disparity whose point the right camera sees in column `u_right_px`.
    #[inline]
    pub(crate) fn at(&self, u_right_px: f32) -> f32 {
        let share = (u_right_px - self.center_u_px) * self.per_px;
        let square = share * share;
        self.offset_px + self.slope_px * share + self.quartic_px * (square * square)
    }

    /// Where the right camera of the corrected rig sees what is seen in column `u_right_px`.
    #[inline]
    pub(crate) fn corrected(&self, u_right_px: f32) -> f32 {
        u_right_px - self.at(u_right_px)
    }

    /// The column of the picture as it is, for one of the corrected rig: the inverse of
    /// [`ColumnCorrection::corrected`] but for a hundredth of the correction.
    #[inline]
    pub(crate) fn uncorrected(&self, u_right_px: f32) -> f32 {
        u_right_px + self.at(u_right_px)
    }

    /// Corrects a row of disparities, 1/256 px, 0 none. What would be less than 1/256 px after it
    /// becomes none. The lowest bit stays: it marks what the matcher filled in.
    #[inline(always)]
    pub(crate) fn correct_row(&self, disparity_q8: &mut [u16]) {
        const ONE_PX: f32 = DISPARITY_ONE_PX as f32;
        const MOST: f32 = u16::MAX as f32;
        for (u, disparity) in (0i32..).zip(disparity_q8) {
            let px = f32::from(*disparity) / ONE_PX;
            let value = (px + self.at(u as f32 - px)) * ONE_PX + 0.5;
            // What is below 0, and no number, becomes 0, which is none.
            let held = if value > 0.0 { value } else { 0.0 };
            let corrected = floored_i32(if held < MOST { held } else { MOST }) as u16;
            let (corrected, mark) = (corrected & !DISPARITY_FILLED, *disparity & DISPARITY_FILLED);
            *disparity = if (*disparity == 0) | (corrected == 0) { 0 } else { corrected | mark };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::vec::Vec;

    const RIG: StereoRig = StereoRig { focal_px: 700.0, center_u_px: 600.0, center_v_px: 180.0, baseline_m: 0.5 };

    #[test]
    fn the_offset_is_the_same_everywhere_and_the_sides_grow() {
        let correction = DisparityCorrection { offset_px: 0.5, slope_px: 0.2, quartic_px: 1.0 }.for_rig(&RIG);
        for (column, expected) in [(600.0, 0.5), (0.0, 1.3), (1200.0, 1.7), (300.0, 0.5 - 0.1 + 1.0 / 16.0)] {
            assert!((correction.at(column) - expected).abs() < 1e-5, "{column}");
            assert!((correction.uncorrected(correction.corrected(column)) - column).abs() < 0.02);
        }
        let middle = DisparityCorrection { offset_px: 0.5, slope_px: 9.0, quartic_px: 9.0 };
        assert_eq!(middle.for_rig(&StereoRig { center_u_px: 0.0, ..RIG }).at(50.0), 0.5);
    }

    #[test]
    fn rows_are_corrected_where_there_is_a_disparity() {
        let correction = DisparityCorrection { offset_px: -0.5, ..DisparityCorrection::default() }.for_rig(&RIG);
        let mut row = [0, 256, 100, 128, 65_535, 1];
        correction.correct_row(&mut row);
        assert_eq!(row, [0, 128, 0, 0, 65_407, 0]);
        let far = DisparityCorrection { offset_px: 9.0, ..DisparityCorrection::default() }.for_rig(&RIG);
        let mut row = [65_535, 0];
        far.correct_row(&mut row);
        assert_eq!(row, [65_535, 0], "held at the end");
    }

    #[test]
    fn a_row_equals_its_twin_one_cast_at_a_time() {
        let mut random = Random::new(51);
        for (offset_px, slope_px, quartic_px) in
            [(0.0, 0.0, 0.0), (-0.7, 0.3, 0.2), (3.0, -40.0, 9.0), (-200.0, 1.0, 0.0), (f64::NAN, 0.0, 0.0)]
        {
            let correction = DisparityCorrection { offset_px, slope_px, quartic_px }.for_rig(&RIG);
            let row: Vec<u16> = (0..1_301).map(|_| random.below(65_536).saturating_sub(random.below(2) * 65_000) as u16).collect();
            let mut corrected = row.clone();
            correction.correct_row(&mut corrected);
            for (u, (&before, after)) in row.iter().zip(corrected).enumerate() {
                let px = f32::from(before) / 256.0;
                let plain = ((px + correction.at(u as f32 - px)) * 256.0 + 0.5) as u16 & !DISPARITY_FILLED;
                assert_eq!(after, if before == 0 || plain == 0 { 0 } else { plain | before & DISPARITY_FILLED });
            }
        }
    }
}
