//! The turn that an inertial unit predicts, in the camera's motion.
//!
//! Few matches, or those of somebody who walks by, tell a turn badly that the unit tells well. A
//! motion of the images that the unit contradicts is looked for anew near the prediction; the turn
//! of the motion that is taken is the mean of both, each weighted by its own error. Decision 104
//! has the rules. Without a prediction nothing changes.

use super::{Egomotion, EgomotionConfig, Estimator, MotionEstimate, MotionStatus};
use crate::{
    egomotion::{AGREE_SIGMAS, PredictedTurn},
    geometry::{StereoRig, Transform},
    scene_flow::Match,
};

/// Share of the matches that must agree with a motion near the prediction, and the fewest.
const NEAR_SHARE_MIN: f32 = 0.12;
const NEAR_MATCHES_MIN: u32 = 12;
/// Share of the matches from which on they, not forces, tell the way.
const WAY_SHARE: f32 = 0.9;

/// Motion as images showed it, before an inertial unit had a part in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SeenMotion {
    /// From the reference to the current camera.
    pub t_current_reference: Transform,
    /// Standard deviation of its turn about one axis, rad.
    pub sigma_rad: f64,
    /// Half of the matches and more agree with it.
    pub strong: bool,
    /// True if it was refused, because it contradicts the unit.
    pub refused: bool,
}

/// Matches of a frame, and how a motion is estimated from them.
pub(super) struct Sight<'a, M> {
    pub config: &'a EgomotionConfig,
    pub rig: &'a StereoRig,
    pub matches: M,
}

impl Egomotion {
    /// Takes the turn that an inertial unit predicts for the next frame; `None` without one.
    pub(crate) fn expect_turn(&mut self, predicted: Option<PredictedTurn>) {
        (self.predicted, self.seen) = (predicted, None);
    }

    /// The predicted turn since the frame that matches are sought with.
    pub(crate) fn expected_turn(&self) -> Option<&Transform> {
        self.predicted.as_ref()?.whole.as_ref().map(|turned| &turned.t_before_now)
    }

    /// Tells that a guess of this frame turns as predicted.
    pub(crate) fn is_turned(&self) -> bool {
        self.predicted.is_some()
    }

    /// The motion since the reference as images showed it in this frame; `None` if they showed
    /// none, or no turn was predicted.
    pub(crate) fn seen(&self) -> Option<&SeenMotion> {
        self.seen.as_ref()
    }

    /// The motion to the next frame, if the camera moves on as before; it turns as predicted.
    pub(super) fn next_motion(&self) -> Transform {
        let last = self.t_current_previous;
        self.predicted.as_ref().map_or(last, |predicted| predicted.turn(&last))
    }

    /// Holds an estimate to the predicted turn: one that contradicts it is sought anew near the
    /// prediction, and one that agrees with it takes its share of it.
    #[inline(never)]
    pub(super) fn hold_to_turn<'m>(
        &mut self,
        sight: Sight<'_, impl Iterator<Item = &'m Match>>,
        estimator: &mut Estimator<'_>,
        found: MotionEstimate,
    ) -> MotionEstimate {
        let Some(predicted) = self.predicted else { return found };
        self.seen = found.t_current_previous.map(|motion| {
            let sigma_rad = found.turn_sigma_rad();
            SeenMotion {
                t_current_reference: motion,
                sigma_rad,
                strong: found.is_strong(),
                refused: predicted.contradicts(&motion, sigma_rad),
            }
        });
        let taken = if self.agrees(&predicted, &found) {
            found
        } else {
            self.look_again(sight, estimator, found)
        };
        self.share_turn(&predicted, taken)
    }

    /// Makes a guess the frame that matches are sought with, where a unit turned it, the images
    /// show something, and an older frame did not locate the camera: it turned away from that one,
    /// which would be out of view ever after.
    pub(super) fn follow_turn(&mut self, config: &EgomotionConfig, estimate: &MotionEstimate) {
        let shows_something = estimate.matches >= u32::from(config.matches_min);
        if self.predicted.is_some() && self.since_reference > 1 && shows_something {
            self.refer_to_last();
        }
    }

    /// Estimates the motion near the predicted one; the one that was found where that is none, and
    /// does not contradict the prediction.
    // Never inlined: what it needs of the stack must not lie below the last step.
    #[inline(never)]
    fn look_again<'m>(
        &self,
        Sight { config, rig, matches }: Sight<'_, impl Iterator<Item = &'m Match>>,
        estimator: &mut Estimator<'_>,
        found: MotionEstimate,
    ) -> MotionEstimate {
        let config = EgomotionConfig { inlier_share_min: NEAR_SHARE_MIN, ..*config };
        let near = estimator.estimate_near(&config, rig, matches, &self.expected());
        let agrees = |predicted: &PredictedTurn| self.agrees(predicted, &near);
        if near.inliers >= NEAR_MATCHES_MIN && self.predicted.as_ref().is_some_and(agrees) {
            return MotionEstimate { samples: found.samples, ..near };
        }
        if self.seen.is_some_and(|seen| seen.refused) {
            let status = MotionStatus::Implausible;
            return MotionEstimate { status, t_current_previous: None, covariance: None, ..found };
        }
        found
    }

    /// Returns true for a motion whose turn and, where few matches agree, whose way is the
    /// predicted one, within the error of both.
    fn agrees(&self, predicted: &PredictedTurn, estimate: &MotionEstimate) -> bool {
        let Some(motion) = &estimate.t_current_previous else { return false };
        if predicted.contradicts(motion, estimate.turn_sigma_rad()) {
            return false;
        }
        let many = WAY_SHARE * estimate.matches as f32;
        let way_sigma_m = predicted.way_sigma_m.filter(|_| {
            // Over several frames errors of the velocity add up unknown.
            self.since_reference == 0 && (estimate.inliers as f32) < many
        });
        way_sigma_m.is_none_or(|way_sigma_m| {
            let off_m = (motion.translation() - self.next_motion().translation()).norm();
            let seen_m = estimate.covariance.map_or(0.0, |seen| seen.distance_sigma_m());
            let variance = 3.0 * way_sigma_m * way_sigma_m + seen_m * seen_m;
            off_m * off_m <= AGREE_SIGMAS * AGREE_SIGMAS * variance
        })
    }

    /// Moves an estimate to the mean of its turn and the predicted one.
    #[inline(never)]
    fn share_turn(&self, predicted: &PredictedTurn, estimate: MotionEstimate) -> MotionEstimate {
        let parts = estimate.t_current_previous.zip(estimate.covariance).zip(predicted.whole);
        let Some(((motion, covariance), whole)) = parts else { return estimate };
        let error_rad = (motion * whole.t_before_now).inverse().rotation_vector();
        let (step, covariance) = covariance.with_turn(error_rad, whole.variance);
        MotionEstimate {
            t_current_previous: Some(motion.retract(step)),
            covariance: Some(covariance),
            ..estimate
        }
    }
}
