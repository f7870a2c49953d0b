//! Numbers of a file as the core's disparities.

use super::{GivenDepth, Meaning};
use crate::dataset::Image;
use dynvox_core::geometry::StereoRig;
use dynvox_core::image::DISPARITY_ONE_PX;

/// Below this, px or m, a value says that there is none.
const NONE_BELOW: f32 = 1e-5;

/// Values of one image that could not be used and were taken as none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DepthRefusals {
    /// Infinite, or not a number.
    pub not_finite: u32,
    /// Negative, or a disparity of 256 px and more.
    pub absurd: u32,
}

impl DepthRefusals {
    /// All of them.
    pub fn count(&self) -> u32 {
        self.not_finite + self.absurd
    }
}

/// Turns disparities in px or depths in m into disparities in 1/256 px.
pub(super) fn to_disparity(values: &Image<f32>, meaning: Meaning, rig: &StereoRig) -> GivenDepth {
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
        let disparity_px = match meaning {
            Meaning::DisparityPx => value,
            Meaning::DepthM => px_m / value,
        };
        let units = (disparity_px * f32::from(DISPARITY_ONE_PX)).round();
        if (0.0..=f32::from(u16::MAX)).contains(&units) {
            units as u16
        } else {
            refused.absurd += 1;
            0
        }
    });
    GivenDepth { disparity_q8, refused }
}
