//! Whether both cameras of a rig expose at the same time.
//!
//! A camera that exposes later, or delivers an older image, is not where the calibration says: while the rig moves forward it stands ahead
//! of that, or behind. Seen from a right camera that stands `a` ahead, a point at depth z has its row farther
//! from the middle by a factor of 1 / (1 - a / z): with y the row from the principal point, d the disparity, f and b the rig's,
//! v_right - v_left = a y d / (f b). A shift of the rows and another focal length of one camera, which a calibration may leave, are
//! estimated along with it: they do not depend on the disparity.
//!
//! **Memory.** None. **Time.** Linear in the matches.

use crate::{geometry::StereoRig, scene_flow::Match};
use nalgebra::{Matrix3, Vector3};

/// Rounds of weighting matches by their residuals.
const ROUNDS: usize = 4;
/// Residual at which a match weighs half, px.
const HALF_WEIGHT_PX: f64 = 0.5;
/// Least determinant, as a share of what unknowns that do not mix would have.
const DETERMINANT_MIN: f64 = 1e-6;
/// Fewest matches that say something.
const MATCHES_MIN: usize = 20;

/// How far ahead of where the calibration has it the right camera stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RightAhead {
    /// The distance, m; below 0 where it stands behind.
    pub distance_m: f64,
    /// Its standard deviation, m.
    pub sigma_m: f64,
}

impl RightAhead {
    /// Whether the cameras seem to expose at the same time, where synchronous ones show at most `most_m`. A distance four times as large is
    /// enough to say no; a smaller one where few matches agree with the motion; and after a gap one that few matches leave open, too.
    pub fn is_synchronous(&self, most_m: f64, agree: bool, after_gap: bool) -> bool {
        let (distance_m, sigma_m) = (libm::fabs(self.distance_m), self.sigma_m);
        let is_far = distance_m - 4.0 * sigma_m > 4.0 * most_m;
        let may_be_far = distance_m - sigma_m > most_m || after_gap && distance_m + sigma_m > 2.0 * most_m;
        !(is_far || !agree && may_be_far)
    }

    /// Estimates it from the current positions of matches; `None` where they do not determine it.
    pub fn of<'m>(rig: &StereoRig, matches: impl Iterator<Item = &'m Match> + Clone) -> Option<Self> {
        let rows = matches.filter_map(|m| row(rig, m));
        let count = rows.clone().count();
        if count < MATCHES_MIN {
            return None;
        }
        let mut estimate = (Vector3::zeros(), 0.0);
        for _ in 0..ROUNDS {
            estimate = solve(rows.clone(), &estimate.0)?;
        }
        let (solution, sigma_m) = estimate;
        Some(Self { distance_m: solution.z, sigma_m })
    }
}

/// What a match says: how the rows' difference changes with shift, focal length and distance, and that difference, px.
fn row(rig: &StereoRig, m: &Match) -> Option<(Vector3<f64>, f64)> {
    let disparity_px = f64::from(m.current_left[0]) - f64::from(m.current_right[0]);
    let y_px = f64::from(m.current_left[1]) - rig.center_v_px;
    let near_per_m = disparity_px / (rig.focal_px * rig.baseline_m);
    let difference_px = f64::from(m.current_right[1]) - f64::from(m.current_left[1]);
    (disparity_px > 0.0).then(|| (Vector3::new(1.0, y_px / rig.focal_px, y_px * near_per_m), difference_px))
}

/// Least squares with weights by the residuals of `before`; and the standard deviation of the third unknown.
fn solve(rows: impl Iterator<Item = (Vector3<f64>, f64)>, before: &Vector3<f64>) -> Option<(Vector3<f64>, f64)> {
    let (mut matrix, mut vector, mut squares, mut weights) = (Matrix3::zeros(), Vector3::zeros(), 0.0, 0.0);
    for (row, difference_px) in rows {
        let residual_px = difference_px - row.dot(before);
        let share = residual_px / HALF_WEIGHT_PX;
        let weight = 1.0 / (1.0 + share * share);
        matrix += row * row.transpose() * weight;
        vector += row * (weight * difference_px);
        squares += weight * residual_px * residual_px;
        weights += weight;
    }
    let is_determined = matrix.determinant() > DETERMINANT_MIN * (matrix.m11 * matrix.m22 * matrix.m33);
    let inverse = matrix.try_inverse().filter(|_| is_determined)?;
    let solution = inverse * vector;
    let variance = squares / weights * inverse.m33;
    let is_known = solution.iter().all(|x| x.is_finite()) && variance.is_finite() && variance >= 0.0;
    is_known.then(|| (solution, libm::sqrt(variance)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    const RIG: StereoRig = StereoRig { focal_px: 700.0, center_u_px: 600.0, center_v_px: 180.0, baseline_m: 0.5 };

    /// Matches of points between 5 and 45 m whose right camera stands `ahead_m` ahead, has rows shifted by 1 px and a focal length half a
    /// percent longer; every fifth is an outlier.
    fn matches(ahead_m: f64, random: &mut Random) -> [Match; 200] {
        core::array::from_fn(|index| {
            let mut within = |most: f64| f64::from(random.below(1 << 20)) / f64::from(1 << 20) * most;
            let (x, y, z) = (within(20.0) - 10.0, within(4.0) - 2.0, 5.0 + within(40.0));
            let noise_px = within(0.4) - 0.2 + if index % 5 == 0 { within(4.0) } else { 0.0 };
            let left = [600.0 + 700.0 * x / z, 180.0 + 700.0 * y / z];
            let right = [600.0 + 700.0 * (x - 0.5) / z, 181.0 + 703.5 * y / (z - ahead_m) + noise_px];
            let [left, right] = [left, right].map(|at| at.map(|px| px as f32));
            Match {
                previous_left: left,
                previous_right: right,
                current_left: left,
                current_right: right,
            }
        })
    }

    #[test]
    fn a_right_camera_ahead_is_found_beside_errors_of_the_calibration() {
        let mut random = Random::new(3);
        for ahead_m in [-0.8, -0.1, 0.0, 0.05, 0.4] {
            let found = RightAhead::of(&RIG, matches(ahead_m, &mut random).iter()).unwrap();
            // To first order in the distance.
            assert!((found.distance_m - ahead_m).abs() < 4.0 * found.sigma_m + 0.2 * ahead_m.abs(), "{ahead_m}: {found:?}");
            assert_eq!(!found.is_synchronous(0.05, true, false), ahead_m.abs() > 0.2, "{ahead_m}: {found:?}");
            assert_eq!(!found.is_synchronous(0.05, false, false), ahead_m.abs() > 0.07, "{ahead_m}: {found:?}");
        }
    }

    #[test]
    fn what_few_matches_leave_open_counts_after_a_gap() {
        let open = RightAhead { distance_m: 0.02, sigma_m: 0.1 };
        assert!(open.is_synchronous(0.05, false, false) && open.is_synchronous(0.05, true, true));
        assert!(!open.is_synchronous(0.05, false, true));
        assert!(RightAhead { sigma_m: 0.01, ..open }.is_synchronous(0.05, false, true));
    }

    #[test]
    fn matches_that_say_nothing_give_no_estimate() {
        let all = matches(0.4, &mut Random::new(3));
        assert_eq!(RightAhead::of(&RIG, all.iter().take(MATCHES_MIN - 1)), None);
        assert_eq!(RightAhead::of(&RIG, [all[0]; 50].iter()), None, "one point alone");
        let far = all.map(|m| Match { current_right: m.current_left, ..m });
        assert_eq!(RightAhead::of(&RIG, far.iter()), None, "without disparity");
    }
}
