//! The turn that an inertial unit predicts, in the camera's motion.

use super::{Egomotion, MotionEstimate};
use crate::{egomotion::PredictedTurn, geometry::Transform};

/// Motion that was refused, because it contradicts an inertial unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RefusedMotion {
    /// From the reference to the current camera.
    pub t_current_reference: Transform,
    /// Standard deviation of its turn about one axis, rad.
    pub sigma_rad: f64,
}

impl Egomotion {
    /// Takes the turn that an inertial unit predicts for the next frame; `None` without one.
    pub(crate) fn expect_turn(&mut self, predicted: Option<PredictedTurn>) {
        (self.predicted, self.contradicting) = (predicted, None);
    }

    /// The predicted turn since the frame that matches are sought with.
    pub(crate) fn expected_turn(&self) -> Option<&Transform> {
        self.predicted.as_ref()?.whole.as_ref().map(|turned| &turned.t_before_now)
    }

    /// Tells that a guess of this frame turns as predicted.
    pub(crate) fn is_turned(&self) -> bool {
        self.predicted.is_some()
    }

    /// The motion since the reference that was refused in this frame because it contradicts the
    /// predicted turn.
    pub(crate) fn contradicting(&self) -> Option<&RefusedMotion> {
        self.contradicting.as_ref()
    }

    /// The motion to the next frame, if the camera moves on as before; it turns as predicted.
    pub(super) fn next_motion(&self) -> Transform {
        let last = self.t_current_previous;
        self.predicted.as_ref().map_or(last, |predicted| predicted.turn(&last))
    }

    /// The estimated motion since the reference if it contradicts the predicted turn.
    pub(super) fn contradiction(&self, estimate: &MotionEstimate) -> Option<RefusedMotion> {
        let (motion, sigma_rad) = (estimate.t_current_previous?, estimate.turn_sigma_rad());
        let contradicts = self.predicted?.contradicts(&motion, sigma_rad);
        contradicts.then_some(RefusedMotion { t_current_reference: motion, sigma_rad })
    }
}
