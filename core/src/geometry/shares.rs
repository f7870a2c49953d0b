//! Position of a pixel, as shares of the way from the principal point to the image's borders.

use super::StereoRig;

/// Pixels of a rig's images as shares, in single precision: the same bits wherever they are asked
/// for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Shares {
    center_px: [f32; 2],
    per_px: [f32; 2],
}

impl Shares {
    /// Makes the shares of a rig. A principal point in column 0 has no side, one in row 0 no first
    /// row: the share is 0 then.
    pub(crate) fn new(rig: &StereoRig) -> Self {
        Self {
            center_px: [rig.center_u_px as f32, rig.center_v_px as f32],
            per_px: Self::per_px(rig).map(|per_px| per_px as f32),
        }
    }

    /// Shares of the way to the side and to the first row in a pixel.
    pub(crate) fn per_px(rig: &StereoRig) -> [f64; 2] {
        let per_px =
            |center_px: f64| if libm::fabs(center_px) >= 1.0 { 1.0 / center_px } else { 0.0 };
        [per_px(rig.center_u_px), per_px(rig.center_v_px)]
    }

    /// The share of the way to the side, in column `u`.
    #[inline(always)]
    pub(crate) fn across(&self, u_px: f32) -> f32 {
        let ([center_px, _], [per_px, _]) = (self.center_px, self.per_px);
        (u_px - center_px) * per_px
    }

    /// The share of the way to the first row, in row `v`.
    #[inline(always)]
    pub(crate) fn down(&self, v_px: f32) -> f32 {
        let [_, per_px] = self.per_px;
        self.below_px(v_px) * per_px
    }

    /// Returns the distance of row `v` below the principal point, px.
    #[inline(always)]
    pub(crate) fn below_px(&self, v_px: f32) -> f32 {
        let [_, center_px] = self.center_px;
        v_px - center_px
    }
}
