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

/// Precision of a pose.
///
/// ```
/// use dynvox_core::{PosePrecision, Report};
///
/// assert_eq!(Report::default().precision, PosePrecision::Precise);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum PosePrecision {
    /// The deviations that are known are small.
    #[default]
    Precise,
    /// The standard deviation of the motion is more than half a voxel: what is fused at this pose
    /// is blurred by it.
    Imprecise,
    /// The deviations of the motions since the surfaces in view were fused add up to more than the
    /// truncation distance, so that a surface may be fused beside itself, or to more than a pixel.
    Displaced,
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

    /// Returns true where the position deviates by more than the truncation distance, or the
    /// orientation by more than a pixel.
    pub(super) fn is_large(&self, truncation_m: f32, focal_px: f64) -> bool {
        let truncation_m = f64::from(truncation_m);
        self.way_m2 > truncation_m * truncation_m
            || self.turn_rad2 * focal_px * focal_px > TURN_PX * TURN_PX
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
            error.is_large(0.3, 200.0)
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
