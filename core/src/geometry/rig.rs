//! A rectified stereo pair.

/// Two identical pinhole cameras, rectified, the right one `baseline_m` along +x of the left.
///
/// ```
/// use dynvox_core::geometry::StereoRig;
///
/// let kitti = StereoRig { focal_px: 718.9, center_u_px: 607.2, center_v_px: 185.2, baseline_m: 0.54 };
/// let depth_m = kitti.focal_baseline_px_m() / 38.8; // of a disparity of 38.8 px
/// assert!(kitti.validate().is_ok() && (depth_m - 10.0).abs() < 0.01);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StereoRig {
    /// Focal length, px, equal in both directions.
    pub focal_px: f64,
    /// Column of the principal point, px from the centre of the leftmost pixel.
    pub center_u_px: f64,
    /// Row of the principal point, px from the centre of the topmost pixel.
    pub center_v_px: f64,
    /// Distance between the cameras, m.
    pub baseline_m: f64,
}

/// Why a rig cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RigProblem {
    /// The focal length is not a positive finite number.
    Focal,
    /// The principal point is not finite.
    Center,
    /// The baseline is not a positive finite number.
    Baseline,
}

impl StereoRig {
    /// Checks that every figure is finite and the focal length and baseline are positive.
    ///
    /// ```
    /// use dynvox_core::geometry::{RigProblem, StereoRig};
    ///
    /// let swapped = StereoRig { focal_px: 700.0, center_u_px: 600.0, center_v_px: 180.0, baseline_m: -0.5 };
    /// assert_eq!(swapped.validate(), Err(RigProblem::Baseline));
    /// ```
    pub fn validate(&self) -> Result<(), RigProblem> {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        if !positive(self.focal_px) {
            return Err(RigProblem::Focal);
        }
        if !(self.center_u_px.is_finite() && self.center_v_px.is_finite()) {
            return Err(RigProblem::Center);
        }
        if !positive(self.baseline_m) {
            return Err(RigProblem::Baseline);
        }
        Ok(())
    }

    /// Focal length times baseline: depth in metres of one pixel of disparity.
    pub fn focal_baseline_px_m(&self) -> f64 {
        self.focal_px * self.baseline_m
    }
}
