//! Disparity from elsewhere, as the core takes it.

use crate::formats::Image;
use dynvox_core::geometry::StereoRig;
use dynvox_core::image::DISPARITY_ONE_PX;

/// Values below this, px or m, mean unknown.
const NONE_BELOW: f32 = 1e-5;

/// Disparity of a frame from elsewhere.
#[derive(Clone, Debug)]
pub struct GivenDepth {
    /// Disparity of the left pixels, 1/256 px, 0 none.
    pub disparity_q8: Image<u16>,
    /// Counts of values that could not be used.
    pub refused: DepthRefusals,
}

/// Quantity that the numbers of a file measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Disparity, px.
    DisparityPx,
    /// Depth, m.
    DepthM,
}

/// Values of one image that could not be used and were taken as none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DepthRefusals {
    /// Infinite, or not a number.
    pub not_finite: u32,
    /// Negative, or a disparity of 256 px and more.
    pub out_of_range: u32,
}

impl DepthRefusals {
    /// All of them.
    pub fn count(&self) -> u32 {
        self.not_finite + self.out_of_range
    }
}

/// Turns disparities in px or depths in m into disparities in 1/256 px.
pub fn to_disparity(values: &Image<f32>, quantity: Quantity, rig: &StereoRig) -> GivenDepth {
    let px_m = rig.focal_baseline_px_m() as f32;
    let mut refused = DepthRefusals::default();
    let disparity_q8 = values.map(|&value| {
        if !value.is_finite() {
            refused.not_finite += 1;
            return 0;
        }
        if value.abs() < NONE_BELOW {
            return 0;
        }
        let disparity_px = match quantity {
            Quantity::DisparityPx => value,
            Quantity::DepthM => px_m / value,
        };
        let units = (disparity_px * f32::from(DISPARITY_ONE_PX)).round();
        if (0.0..=f32::from(u16::MAX)).contains(&units) {
            units as u16
        } else {
            refused.out_of_range += 1;
            0
        }
    });
    GivenDepth { disparity_q8, refused }
}
