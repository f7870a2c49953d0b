//! Directions in which matches do not hold the camera: far points alone say little of its way, a
//! road without edges little of the way along it.
//!
//! The covariance of an estimate names them. Along such a direction the last motion is kept,
//! unless the estimate contradicts it; the others, and the rotation, stay as estimated.

use super::{Egomotion, MotionEstimate};
use core::fmt;

/// Standard deviation of a motion's way along an axis from which on the axis is weak, m.
const WEAK_M: f64 = 0.1;
/// Deviations by which an estimate may differ from the last motion without contradicting it. After
/// a jump the estimate is weak and right: the last motion would hide it.
const AGREES_SIGMAS: f64 = 4.0;

/// Axes of the current camera along which a motion is not determined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WeakDirections {
    /// To the right.
    pub right: bool,
    /// Downwards.
    pub down: bool,
    /// Ahead.
    pub ahead: bool,
}

impl WeakDirections {
    /// Tells whether there is one.
    ///
    /// ```
    /// use dynvox_core::egomotion::WeakDirections;
    ///
    /// assert!(!WeakDirections::default().any());
    /// let tunnel = WeakDirections { ahead: true, ..WeakDirections::default() };
    /// assert!(tunnel.any() && tunnel.to_string() == "ahead");
    /// ```
    pub fn any(&self) -> bool {
        self.right || self.down || self.ahead
    }
}

impl fmt::Display for WeakDirections {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        let names = [(self.right, "right"), (self.down, "down"), (self.ahead, "ahead")];
        for (_, name) in names.iter().filter(|(weak, _)| *weak) {
            write!(f, "{separator}{name}")?;
            separator = ", ";
        }
        Ok(())
    }
}

impl Egomotion {
    /// Lets the last motion go on along the directions that the estimate does not determine, where
    /// there is a last motion.
    pub(super) fn hold_weak_directions(&self, mut estimate: MotionEstimate) -> MotionEstimate {
        let (Some(covariance), Some(motion)) =
            (estimate.covariance, estimate.t_current_previous.as_mut())
        else {
            return estimate;
        };
        let sigma_m = covariance.translation_sigma_m();
        let [right, down, ahead] = sigma_m.map(|sigma| sigma > WEAK_M);
        estimate.weak = WeakDirections { right, down, ahead };
        // Several frames in one motion have no last motion to compare with.
        if self.motion_s > 0.0 && self.since_reference == 0 {
            let last = self.t_current_previous.translation() * (self.reference_s / self.motion_s);
            for ((way, last), sigma) in motion.translation_m.iter_mut().zip(&last).zip(sigma_m) {
                if sigma > WEAK_M && (*last - *way).abs() <= AGREES_SIGMAS * sigma {
                    *way = *last;
                }
            }
        }
        estimate
    }
}

#[cfg(test)]
mod tests;
