//! Depth from disparity.

use super::StereoRig;
use crate::image::{DISPARITY_ONE_PX, View, ViewMut};

/// Turns disparity (1/256 px, 0 none) into depth in metres, 0 where disparity is unknown or depth
/// outside `near_m..=far_m`. Images of different sizes are turned as far as both reach.
///
/// ```
/// use dynvox_core::{geometry::{StereoRig, depth_from_disparity}, image::{DISPARITY_ONE_PX, View, ViewMut}};
///
/// let rig = StereoRig { focal_px: 200.0, center_u_px: 1.0, center_v_px: 0.0, baseline_m: 0.5 };
/// let disparity_q8 = [10 * DISPARITY_ONE_PX, 0]; // 10 px, none
/// let mut depth_m = [0.0; 2];
/// depth_from_disparity(&rig, 0.5, 20.0, View::new(&disparity_q8, 2, 1).unwrap(), &mut ViewMut::new(&mut depth_m, 2, 1).unwrap());
/// assert_eq!(depth_m, [10.0, 0.0]);
/// ```
pub fn depth_from_disparity(
    rig: &StereoRig,
    near_m: f32,
    far_m: f32,
    disparity_q8: View<'_, u16>,
    depth_m: &mut ViewMut<'_, f32>,
) {
    let depths = DepthRange::new(rig, near_m, far_m);
    // A width of 0 has no rows, but `chunks_exact_mut` panics on it.
    let width = depth_m.width();
    for (row, disparities) in
        depth_m.pixels_mut().chunks_exact_mut(width.max(1)).zip(disparity_q8.rows())
    {
        for (depth, &disparity) in row.iter_mut().zip(disparities) {
            *depth = depths.depth_m(disparity);
        }
    }
}

/// Depths between two limits, as a rig measures them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DepthRange {
    focal_baseline_q8_m: f32,
    near_m: f32,
    far_m: f32,
}

impl DepthRange {
    pub(crate) fn new(rig: &StereoRig, near_m: f32, far_m: f32) -> Self {
        let focal_baseline_q8_m = (rig.focal_baseline_px_m() * f64::from(DISPARITY_ONE_PX)) as f32;
        Self { focal_baseline_q8_m, near_m, far_m }
    }

    /// Depth of a disparity in 1/256 px, m; 0 without disparity and outside the limits.
    #[inline(always)]
    pub(crate) fn depth_m(&self, disparity_q8: u16) -> f32 {
        // Disparity 0 gives infinity, which is beyond far.
        let depth_m = self.focal_baseline_q8_m / f32::from(disparity_q8);
        if (depth_m >= self.near_m) & (depth_m <= self.far_m) { depth_m } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_near_and_far_and_knows_nothing_without_disparity() {
        let rig =
            StereoRig { focal_px: 100.0, center_u_px: 0.0, center_v_px: 0.0, baseline_m: 0.5 };
        let disparities = [0, 10 * DISPARITY_ONE_PX, DISPARITY_ONE_PX, 101 * DISPARITY_ONE_PX];
        let mut depths = [9.0; 4];
        let mut view = ViewMut::new(&mut depths, 4, 1).unwrap();
        depth_from_disparity(&rig, 0.5, 20.0, View::new(&disparities, 4, 1).unwrap(), &mut view);
        assert_eq!(depths, [0.0, 5.0, 0.0, 0.0]);
    }
}
