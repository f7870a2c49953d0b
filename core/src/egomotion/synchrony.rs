//! Test of whether both cameras of a rig expose at the same time.
//!
//! A camera that exposes later, or delivers an older image, is not where the calibration says:
//! while the rig moves forward it stands ahead of that, or behind. Seen from a right camera that
//! stands `a` ahead, a point at depth z has its row farther from the middle by a factor of 1 / (1 -
//! a / z): with y the row from the principal point, d the disparity, f and b the rig's, v_right -
//! v_left = a y d / (f b). A shift of the rows and another focal length of one camera, which a
//! calibration may leave, are estimated along with it: they do not depend on the disparity.
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

/// Distance by which the right camera is ahead of its calibrated position.
///
/// ```
/// use dynvox_core::egomotion::RightAhead;
///
/// let ahead = RightAhead { distance_m: 1.0, sigma_m: 0.01 };
/// assert!(!ahead.is_synchronous(0.05, true, false), "the right camera exposes later");
/// let noise = RightAhead { distance_m: 0.01, sigma_m: 0.01 };
/// assert!(noise.is_synchronous(0.05, true, false));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RightAhead {
    /// The distance, m; below 0 where it stands behind.
    pub distance_m: f64,
    /// Standard deviation of the distance, m.
    pub sigma_m: f64,
}

impl RightAhead {
    /// Returns true if the cameras seem to expose at the same time, for which synchronous ones show
    /// at most `max_m`. They do not if the distance is certainly four times as large, or after a
    /// gap as large; if a smaller one comes with few matches that agree with the motion; and after
    /// a gap, if few matches leave it open.
    pub fn is_synchronous(&self, max_m: f64, agree: bool, after_gap: bool) -> bool {
        let (distance_m, sigma_m) = (libm::fabs(self.distance_m), self.sigma_m);
        let is_far = distance_m - 4.0 * sigma_m > if after_gap { max_m } else { 4.0 * max_m };
        let may_be_far =
            distance_m - sigma_m > max_m || after_gap && distance_m + sigma_m > 2.0 * max_m;
        !(is_far || !agree && may_be_far)
    }

    /// Estimates it from the current positions of matches; `None` where they do not determine it.
    pub fn from_matches<'m>(
        rig: &StereoRig,
        matches: impl Iterator<Item = &'m Match> + Clone,
    ) -> Option<Self> {
        // Counted first: the rows are made anew for each round, since the core has no heap to hold
        // them.
        let rows = matches.filter_map(|m| row(rig, m));
        let count = rows.clone().count();
        if count < MATCHES_MIN {
            return None;
        }
        // The first round has equal weights, the others those of the estimate before.
        let mut estimate = (Vector3::zeros(), 0.0);
        for _ in 0..ROUNDS {
            estimate = solve(rows.clone(), &estimate.0)?;
        }
        let (solution, sigma_m) = estimate;
        Some(Self { distance_m: solution.z, sigma_m })
    }
}

/// Linearises a match: the change of the rows' difference with shift, focal length and distance,
/// and that difference, px.
fn row(rig: &StereoRig, m: &Match) -> Option<(Vector3<f64>, f64)> {
    let disparity_px = f64::from(m.current_left[0]) - f64::from(m.current_right[0]);
    let y_px = f64::from(m.current_left[1]) - rig.center_v_px;
    let near_per_m = disparity_px / (rig.focal_px * rig.baseline_m);
    let difference_px = f64::from(m.current_right[1]) - f64::from(m.current_left[1]);
    (disparity_px > 0.0)
        .then(|| (Vector3::new(1.0, y_px / rig.focal_px, y_px * near_per_m), difference_px))
}

/// Least squares with weights by the residuals of `before`; and the standard deviation of the third
/// unknown.
fn solve(
    rows: impl Iterator<Item = (Vector3<f64>, f64)>,
    before: &Vector3<f64>,
) -> Option<(Vector3<f64>, f64)> {
    let (mut matrix, mut vector, mut squares, mut weights) =
        (Matrix3::zeros(), Vector3::zeros(), 0.0, 0.0);
    for (row, difference_px) in rows {
        let residual_px = difference_px - row.dot(before);
        let share = residual_px / HALF_WEIGHT_PX;
        // Cauchy's weight: a mismatch counts little, and none is left out entirely.
        let weight = 1.0 / (1.0 + share * share);
        matrix += row * row.transpose() * weight;
        vector += row * (weight * difference_px);
        squares += weight * residual_px * residual_px;
        weights += weight;
    }
    // Compared with the diagonal, so that the unknowns' units do not matter.
    let is_determined =
        matrix.determinant() > DETERMINANT_MIN * (matrix.m11 * matrix.m22 * matrix.m33);
    let inverse = matrix.try_inverse().filter(|_| is_determined)?;
    let solution = inverse * vector;
    // The residuals themselves say how noisy the rows are.
    let variance = squares / weights * inverse.m33;
    let is_known =
        solution.iter().all(|x| x.is_finite()) && variance.is_finite() && variance >= 0.0;
    is_known.then(|| (solution, libm::sqrt(variance)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    const RIG: StereoRig =
        StereoRig { focal_px: 700.0, center_u_px: 600.0, center_v_px: 180.0, baseline_m: 0.5 };

    /// Matches of points between 5 and 45 m whose right camera stands `ahead_m` ahead, has rows
    /// shifted by 1 px and a focal length half a percent longer; every fifth is an outlier.
    fn matches(ahead_m: f64, random: &mut Random) -> [Match; 200] {
        core::array::from_fn(|index| {
            // A random number between 0 and `most`.
            let mut within =
                |most: f64| f64::from(random.below(1 << 20)) / f64::from(1 << 20) * most;
            let (x, y, z) = (within(20.0) - 10.0, within(4.0) - 2.0, 5.0 + within(40.0));
            let noise_px = within(0.4) - 0.2 + if index % 5 == 0 { within(4.0) } else { 0.0 };
            let left = [600.0 + 700.0 * x / z, 180.0 + 700.0 * y / z];
            let right =
                // y / (z - ahead_m): the right camera is nearer to the point by what it stands
                // ahead.
                [600.0 + 700.0 * (x - 0.5) / z, 181.0 + 703.5 * y / (z - ahead_m) + noise_px];
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
            let found =
                RightAhead::from_matches(&RIG, matches(ahead_m, &mut random).iter()).unwrap();
            // To first order in the distance.
            assert!(
                (found.distance_m - ahead_m).abs() < 4.0 * found.sigma_m + 0.2 * ahead_m.abs(),
                "{ahead_m}: {found:?}"
            );
            assert_eq!(
                !found.is_synchronous(0.05, true, false),
                ahead_m.abs() > 0.2,
                "{ahead_m}: {found:?}"
            );
            assert_eq!(
                !found.is_synchronous(0.05, false, false),
                ahead_m.abs() > 0.07,
                "{ahead_m}: {found:?}"
            );
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
        assert_eq!(RightAhead::from_matches(&RIG, all.iter().take(MATCHES_MIN - 1)), None);
        assert_eq!(RightAhead::from_matches(&RIG, [all[0]; 50].iter()), None, "one point alone");
        let far = all.map(|m| Match { current_right: m.current_left, ..m });
        assert_eq!(RightAhead::from_matches(&RIG, far.iter()), None, "without disparity");
    }

    #[test]
    fn each_bound_on_the_distance_decides_by_itself() {
        let is_synchronous = |distance_m: f64, sigma_m: f64, agree: bool, after_gap: bool| {
            let both = [distance_m, -distance_m].map(|distance_m| {
                RightAhead { distance_m, sigma_m }.is_synchronous(0.125, agree, after_gap)
            });
            assert_eq!(both[0], both[1], "ahead and behind are alike");
            both[0]
        };
        // Four standard deviations beyond four times the most, and after a gap beyond the most,
        // however many agree.
        assert!(
            is_synchronous(0.75, 0.0625, true, false) && !is_synchronous(0.76, 0.0625, true, false)
        );
        assert!(is_synchronous(0.5, 0.0, true, false) && !is_synchronous(0.51, 0.0, true, false));
        assert!(
            is_synchronous(0.375, 0.0625, true, true) && !is_synchronous(0.38, 0.0625, true, true)
        );
        assert!(is_synchronous(0.125, 0.0, true, true) && !is_synchronous(0.13, 0.0, true, true));
        // One standard deviation beyond the most: where few agree.
        assert!(
            is_synchronous(0.1875, 0.0625, false, false)
                && !is_synchronous(0.19, 0.0625, false, false)
        );
        assert!(is_synchronous(0.19, 0.0625, true, false));
        // One standard deviation below twice the most: after a gap, where few agree.
        assert!(
            is_synchronous(0.125, 0.125, false, true) && !is_synchronous(0.126, 0.125, false, true)
        );
        assert!(
            is_synchronous(0.126, 0.125, false, false) && is_synchronous(0.126, 0.125, true, true)
        );
    }

    /// Matches that the model holds of exactly: rows shifted by `shift_px`, a focal length longer
    /// by a share, the right camera ahead; and each row off by a noise.
    fn modelled(
        shift_px: f64,
        longer: f64,
        ahead_m: f64,
        noise_px: impl Fn(usize) -> f64,
    ) -> [Match; 60] {
        core::array::from_fn(|index| {
            let at = index as f64;
            // Coprime steps, so that rows and disparities are not correlated.
            let (y_px, disparity_px) = (12.0 * (at % 13.0) - 70.0, 8.0 + 3.0 * (at % 11.0));
            let (u_left, v_left) = (300.0 + 5.0 * at, RIG.center_v_px + y_px);
            let v_right = v_left
                + shift_px
                + longer * y_px / 700.0
                + ahead_m * y_px * disparity_px / 350.0
                + noise_px(index);
            let [left, right] = [[u_left, v_left], [u_left - disparity_px, v_right]]
                .map(|at| at.map(|px| px as f32));
            Match {
                previous_left: [0.0; 2],
                previous_right: [0.0; 2],
                current_left: left,
                current_right: right,
            }
        })
    }

    #[test]
    fn what_the_model_holds_of_exactly_is_found_exactly() {
        for (shift_px, longer, ahead_m) in
            [(0.0, 0.0, 0.0), (0.5, -3.0, 0.2), (-1.5, 2.0, -0.7), (0.0, 0.0, 0.05)]
        {
            let found =
                RightAhead::from_matches(&RIG, modelled(shift_px, longer, ahead_m, |_| 0.0).iter())
                    .unwrap();
            assert!(
                (found.distance_m - ahead_m).abs() < 1e-4 && found.sigma_m < 1e-4,
                "{ahead_m}: {found:?}"
            );
        }
    }

    /// The plain way: four rounds of weighted least squares by Gauss's elimination, each sum by
    /// itself.
    fn plainly(matches: &[Match]) -> [f64; 2] {
        let rows = || {
            matches.iter().map(|m| {
                let [u, v] = m.current_left.map(f64::from);
                let [u_right, v_right] = m.current_right.map(f64::from);
                let y = v - 180.0;
                ([1.0, y / 700.0, y * (u - u_right) / 350.0], v_right - v)
            })
        };
        let (mut solution, mut variance) = ([0.0; 3], 0.0);
        for _ in 0..4 {
            let residual = |row: &[f64; 3], difference: f64| {
                difference - (0..3).map(|at| row[at] * solution[at]).sum::<f64>()
            };
            let weight = |row: &[f64; 3], difference: f64| {
                1.0 / (1.0 + 4.0 * residual(row, difference).powi(2))
            };
            // The matrix, the right side, and the unit vector that gives the last entry of the
            // inverse.
            let mut system: [[f64; 5]; 3] = core::array::from_fn(|i| {
                let sum = |of: &dyn Fn(&[f64; 3], f64) -> f64| {
                    rows().map(|(row, d)| weight(&row, d) * row[i] * of(&row, d)).sum::<f64>()
                };
                [
                    sum(&|row, _| row[0]),
                    sum(&|row, _| row[1]),
                    sum(&|row, _| row[2]),
                    sum(&|_, d| d),
                    f64::from(u8::from(i == 2)),
                ]
            });
            for i in 0..3 {
                system[i] = system[i].map(|entry| entry / system[i][i]);
                for other in (0..3).filter(|other| *other != i) {
                    let factor = system[other][i];
                    system[other] =
                        core::array::from_fn(|at| system[other][at] - factor * system[i][at]);
                }
            }
            let weights: f64 = rows().map(|(row, d)| weight(&row, d)).sum();
            let squares: f64 =
                rows().map(|(row, d)| weight(&row, d) * residual(&row, d).powi(2)).sum();
            variance = squares / weights * system[2][4];
            solution = system.map(|row| row[3]);
        }
        [solution[2], variance.sqrt()]
    }

    #[test]
    fn distance_and_deviation_are_those_of_weighted_least_squares() {
        let mut random = Random::new(6);
        for max_px in [0.1, 0.5, 3.0] {
            let noise: [f64; 60] =
                core::array::from_fn(|_| (f64::from(random.below(2_001)) / 1_000.0 - 1.0) * max_px);
            let all = modelled(0.4, 1.0, 0.3, |index| noise[index]);
            let (found, [distance_m, sigma_m]) =
                (RightAhead::from_matches(&RIG, all.iter()).unwrap(), plainly(&all));
            assert!(
                (found.distance_m - distance_m).abs() < 1e-9,
                "{max_px} px: {found:?} {distance_m}"
            );
            assert!(
                (found.sigma_m - sigma_m).abs() < 1e-9 && sigma_m > 0.0,
                "{max_px} px: {found:?} {sigma_m}"
            );
        }
    }

    #[test]
    fn twenty_matches_are_enough() {
        let all = modelled(0.4, 1.0, 0.3, |_| 0.0);
        assert!(RightAhead::from_matches(&RIG, all.iter().take(MATCHES_MIN)).is_some());
        // Matches without disparity are none.
        let some = core::array::from_fn::<_, 21, _>(|at| {
            if at < 2 { Match { current_right: all[at].current_left, ..all[at] } } else { all[at] }
        });
        assert_eq!(RightAhead::from_matches(&RIG, some.iter()), None);
        // All of one disparity: distance and focal length cannot be told apart.
        let alike = all
            .map(|m| Match { current_right: [m.current_left[0] - 9.0, m.current_right[1]], ..m });
        assert_eq!(RightAhead::from_matches(&RIG, alike.iter()), None);
    }
}
