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
/// assert!(!report.accumulated.is_large && report.accumulated.way_sigma_m == 0.0);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct AccumulatedSigma {
    /// Standard deviation of the position, over all directions, m.
    pub way_sigma_m: f64,
    /// Standard deviation of the orientation, over all axes, rad.
    pub turn_sigma_rad: f64,
    /// True where the position deviates by more than the truncation distance, so that a surface may
    /// be fused beside itself, or the orientation by more than a pixel.
    pub is_large: bool,
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

    /// Deviations, for a map with this truncation distance and images of this focal length.
    pub(super) fn report(&self, truncation_m: f32, focal_px: f64) -> AccumulatedSigma {
        let [way_sigma_m, turn_sigma_rad] = [self.way_m2, self.turn_rad2].map(libm::sqrt);
        let is_large = way_sigma_m > f64::from(truncation_m) || turn_sigma_rad * focal_px > TURN_PX;
        AccumulatedSigma { way_sigma_m, turn_sigma_rad, is_large }
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
            error.report(0.3, 200.0)
        };
        assert!(!add(0.01, 0.05, 100).is_large, "as on a road");
        // A pixel is 0.29 degrees.
        assert!(!add(0.0, 0.2, 1).is_large, "one turn that is imprecise");
        assert!(add(0.0, 0.2, 3).is_large, "four of them");
        assert!(add(0.0, 0.01, 3).is_large, "the surfaces in view are those of before");
        assert!(!add(0.0, 0.01, 20).is_large);
        assert!(add(0.31, 0.0, 1).is_large, "more than the truncation distance");
    }
}
