//! Deviation of the camera's pose from the surfaces in view.
//!
//! Motions are precise or not, and each says by how much. Where several in a row are not, the pose
//! has left the map without one motion that stands out. Their variances add up here, and fade as
//! surfaces come into view that were fused at the pose as it is.

use crate::{egomotion::MotionCovariance, state::Visitor};

/// Share of a variance that stays from one estimated motion to the next.
const STAYS: f64 = 0.9;
/// Deviation of the orientation that is no longer small, px.
const TURN_PX: f64 = 1.0;

/// Standard deviations of a pose against the surfaces in view.
///
/// ```
/// let report = dynvox_core::Report::default();
/// assert!(!report.displaced && report.accumulated.way_sigma_m == 0.0);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct AccumulatedSigma {
    /// Standard deviation of the position, over all directions, m.
    pub way_sigma_m: f32,
    /// Standard deviation of the orientation, over all axes, rad.
    pub turn_sigma_rad: f32,
}

impl AccumulatedSigma {
    /// Returns true where the position deviates by more than the truncation distance, so that a
    /// surface may be fused beside itself, or the orientation by more than a pixel.
    pub(super) fn is_large(&self, truncation_m: f32, focal_px: f64) -> bool {
        self.way_sigma_m > truncation_m || f64::from(self.turn_sigma_rad) * focal_px > TURN_PX
    }
}

/// Variances of a pose against the surfaces in view.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct AccumulatedError {
    way_m2: f64,
    turn_rad2: f64,
}

impl AccumulatedError {
    /// Adds the covariance of an estimated motion.
    pub(super) fn add(&mut self, motion: &MotionCovariance) {
        let [way_m, turn_rad] = [motion.distance_sigma_m(), motion.angle_sigma_rad()];
        self.way_m2 = STAYS * self.way_m2 + way_m * way_m;
        self.turn_rad2 = STAYS * self.turn_rad2 + turn_rad * turn_rad;
    }

    /// Standard deviations.
    pub(super) fn sigma(&self) -> AccumulatedSigma {
        let [way_sigma_m, turn_sigma_rad] =
            [self.way_m2, self.turn_rad2].map(|variance| libm::sqrt(variance) as f32);
        AccumulatedSigma { way_sigma_m, turn_sigma_rad }
    }

    /// Visits the variances.
    pub(super) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { way_m2, turn_rad2 } = self;
        visitor.f64(way_m2);
        visitor.f64(turn_rad2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Covariance of a motion whose way and turn deviate so much about one axis.
    fn motion(way_m: f64, turn_rad: f64) -> MotionCovariance {
        let mut matrix = [[0.0; 6]; 6];
        (matrix[1][1], matrix[5][5]) = (turn_rad * turn_rad, way_m * way_m);
        MotionCovariance::from_matrix(&matrix)
    }

    #[test]
    fn imprecise_motions_in_a_row_add_up_and_precise_ones_let_them_fade() {
        let mut error = AccumulatedError::default();
        let mut add = |way_m: f64, degrees: f64, times: usize| {
            (0..times).for_each(|_| error.add(&motion(way_m, degrees.to_radians())));
            error.sigma().is_large(0.3, 200.0)
        };
        assert!(!add(0.01, 0.05, 100), "as on a road");
        // A pixel is 0.29 degrees.
        assert!(!add(0.0, 0.2, 1), "one turn that is imprecise");
        assert!(add(0.0, 0.2, 3), "four of them");
        assert!(add(0.0, 0.01, 3), "the surfaces in view are those of before");
        assert!(!add(0.0, 0.01, 20));
        assert!(add(0.31, 0.0, 1), "more than the truncation distance");
    }
}
