//! Turn of the camera that another sensor than the images predicts.

use crate::{geometry::Transform, state::Visitor};

/// Sigmas within which two turns agree.
pub(crate) const AGREE_SIGMAS: f64 = 5.0;

/// Rotation of the camera over a time, with its variance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Turned {
    /// Axes now to those before. Its translation is the way of the camera as forces tell it, 0
    /// where they tell none.
    pub t_before_now: Transform,
    /// Variance about one axis, rad2.
    pub variance: f64,
}

impl Turned {
    /// This turn and then `next`.
    pub fn then(&self, next: &Self) -> Self {
        Self {
            t_before_now: (self.t_before_now * next.t_before_now).normalized(),
            variance: self.variance + next.variance,
        }
    }

    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { t_before_now, variance } = self;
        visitor.transform(t_before_now);
        visitor.f64(variance);
    }
}

/// Turn that a trusted inertial unit predicts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PredictedTurn {
    /// Since the frame before.
    pub last: Turned,
    /// Since the frame that matches are sought with; `None` if one between was not covered.
    pub whole: Option<Turned>,
    /// Standard deviation of the way of `last` along one axis, m; `None` where forces tell no way.
    pub way_sigma_m: Option<f64>,
}

impl PredictedTurn {
    /// The motion as predicted, with the way of the last one, `t_current_previous`, where none is.
    pub fn turn(&self, t_current_previous: &Transform) -> Transform {
        let predicted = self.last.t_before_now;
        let way = if predicted.translation_m == [0.0; 3] {
            t_current_previous.inverse()
        } else {
            predicted
        };
        Transform { rotation: predicted.rotation, ..way }.inverse().normalized()
    }

    /// Returns true if a motion since the reference turns otherwise than predicted, by more than
    /// the error of both.
    pub fn contradicts(&self, t_current_reference: &Transform, sigma_rad: f64) -> bool {
        let Some(whole) = &self.whole else { return false };
        let off_rad = (*t_current_reference * whole.t_before_now).angle_rad();
        let variance = whole.variance + sigma_rad * sigma_rad;
        off_rad * off_rad > AGREE_SIGMAS * AGREE_SIGMAS * variance
    }
}
