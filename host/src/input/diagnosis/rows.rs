//! How far the rows of matched points differ: a shift in the middle of the image and a roll, from
//! vertical disparities alone.
//!
//! A line over the columns, first through the medians of the left and the right third, then by
//! least squares with Cauchy's weights: of any 100 matches 30 may be wrong. Vertical disparities
//! tell rows and roll; of the horizontal offset they tell nothing. The weighted residuals tell how
//! well the line is known: a verdict asks for a difference of two sigmas.

use super::median;
use super::patches::PatchMatch;

/// Error of a matched row at which a match weighs half, px.
const HALF_WEIGHT_PX: f64 = 0.3;
/// Rounds of weighing.
const ROUNDS: usize = 8;
/// Matches whose columns span less say nothing of a roll, px.
const SPAN_MIN_PX: f64 = 20.0;

/// Sigmas within which a difference may be chance.
const SIGMAS: f64 = 2.0;

/// Misalignment of right images relative to left ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowError {
    /// Distance by which the right image shows a point lower, in the middle column, px.
    pub shift_px: f64,
    /// Clockwise rotation of the right image, degrees.
    pub roll_deg: f64,
    /// Standard deviation of the shift, px.
    pub shift_sigma_px: f64,
    /// Standard deviation of the roll, degrees.
    pub roll_sigma_deg: f64,
    /// Median distance of matched rows, px.
    pub median_px: f64,
    /// Median distance of matched rows from the fitted line, px.
    pub rest_px: f64,
}

impl RowError {
    /// Fits the misalignment to matches in images `width_px` wide.
    pub fn of(matches: &[&PatchMatch], width_px: f64) -> Self {
        let (mut shift_px, mut slope) = through_thirds(matches, width_px);
        let (mut shift_sigma_px, mut slope_sigma) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..ROUNDS {
            let Some(fit) = weighed(matches, width_px, (shift_px, slope)) else { break };
            Fit { shift_px, slope, shift_sigma_px, slope_sigma } = fit;
        }
        let rest = |one: &&PatchMatch| {
            (one.rows_px - shift_px - slope * (one.u_px - 0.5 * width_px)).abs()
        };
        Self {
            shift_px,
            roll_deg: slope.atan().to_degrees(),
            shift_sigma_px,
            roll_sigma_deg: slope_sigma.atan().to_degrees(),
            median_px: median(matches.iter().map(|one| one.rows_px.abs()).collect()),
            rest_px: median(matches.iter().map(rest).collect()),
        }
    }

    /// Distance of rows in the middle of the image and half way to its sides, the middle one of
    /// the three, that is no chance, px.
    pub fn certain_px(&self, width_px: f64) -> f64 {
        let slope = self.roll_deg.to_radians().tan();
        let slope_sigma = self.roll_sigma_deg.to_radians().tan();
        let at = |u_px: f64| {
            let sigma_px = self.shift_sigma_px.hypot(slope_sigma * u_px);
            (self.shift_px + slope * u_px).abs() - SIGMAS * sigma_px
        };
        median([-0.25, 0.0, 0.25].map(|share| at(share * width_px)).to_vec())
    }

    /// Shift in the middle that is no chance, px.
    pub fn certain_shift_px(&self) -> f64 {
        self.shift_px.abs() - SIGMAS * self.shift_sigma_px
    }

    /// Roll that is no chance, degrees.
    pub fn certain_roll_deg(&self) -> f64 {
        self.roll_deg.abs() - SIGMAS * self.roll_sigma_deg
    }
}

/// A line over the columns, with the standard deviations of its parts.
struct Fit {
    shift_px: f64,
    slope: f64,
    shift_sigma_px: f64,
    slope_sigma: f64,
}

/// Shift and slope through the medians of the left and the right third of the matches.
fn through_thirds(matches: &[&PatchMatch], width_px: f64) -> (f64, f64) {
    let columns = median_of(matches, |one| one.u_px);
    let mut sorted: Vec<f64> = matches.iter().map(|one| one.u_px).collect();
    sorted.sort_by(f64::total_cmp);
    let at = |share: usize| sorted.get(share * sorted.len() / 3).copied().unwrap_or(columns);
    let side = |holds: &dyn Fn(f64) -> bool| {
        let of: Vec<&PatchMatch> = matches.iter().copied().filter(|one| holds(one.u_px)).collect();
        [median_of(&of, |one| one.u_px), median_of(&of, |one| one.rows_px)]
    };
    let (low, high) = (at(1), at(2));
    let ([u0, rows0], [u1, rows1]) = (side(&|u| u < low), side(&|u| u > high));
    let slope = if u1 - u0 < SPAN_MIN_PX { 0.0 } else { (rows1 - rows0) / (u1 - u0) };
    (median_of(matches, |one| one.rows_px - slope * (one.u_px - 0.5 * width_px)), slope)
}

fn median_of(matches: &[&PatchMatch], value: impl Fn(&PatchMatch) -> f64) -> f64 {
    median(matches.iter().map(|one| value(one)).collect())
}

/// One round of weighted least squares; `None` where the columns do not span enough.
fn weighed(matches: &[&PatchMatch], width_px: f64, (shift_px, slope): (f64, f64)) -> Option<Fit> {
    let (mut sum, mut sum_u, mut sum_uu, mut sum_r, mut sum_ur) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let mut sum_ee = 0.0;
    for one in matches {
        let u = one.u_px - 0.5 * width_px;
        let error = (one.rows_px - shift_px - slope * u) / HALF_WEIGHT_PX;
        let weight = 1.0 / (1.0 + error * error);
        sum += weight;
        sum_u += weight * u;
        sum_uu += weight * u * u;
        sum_r += weight * one.rows_px;
        sum_ur += weight * u * one.rows_px;
        sum_ee += weight * (error * HALF_WEIGHT_PX).powi(2);
    }
    let determinant = sum * sum_uu - sum_u * sum_u;
    let spans = determinant > sum * sum * SPAN_MIN_PX * SPAN_MIN_PX;
    // Two are fitted; of fewer matches the residuals tell nothing.
    let variance = sum_ee / (sum - 2.0).max(f64::MIN_POSITIVE);
    spans.then(|| Fit {
        shift_px: (sum_uu * sum_r - sum_u * sum_ur) / determinant,
        slope: (sum * sum_ur - sum_u * sum_r) / determinant,
        shift_sigma_px: (variance * sum_uu / determinant).sqrt(),
        slope_sigma: (variance * sum / determinant).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matches(rows_px: impl Fn(f64) -> f64) -> Vec<PatchMatch> {
        let one = |at: u32| {
            let u_px = f64::from(at * 37 % 600);
            // Three of ten are wrong, all to one side.
            let rows_px =
                if at % 10 < 3 { 7.0 } else { rows_px(u_px) + 0.1 * f64::from(at % 7) - 0.3 };
            PatchMatch { u_px, disparity_px: 10.0, rows_px, brightness: 1.0 }
        };
        (0..200).map(one).collect()
    }

    #[test]
    fn shift_and_roll_are_found_among_wrong_matches() {
        let roll = 0.6f64.to_radians().tan();
        let matches = matches(|u| 1.5 + roll * (u - 300.0));
        let found = RowError::of(&matches.iter().collect::<Vec<_>>(), 600.0);
        assert!(
            (found.shift_px - 1.5).abs() < 0.1 && (found.roll_deg - 0.6).abs() < 0.05,
            "{found:?}"
        );
        assert!(
            found.shift_sigma_px < 0.1 && found.certain_shift_px() > 1.2,
            "many matches leave little doubt: {found:?}"
        );
    }

    #[test]
    fn a_few_scattered_matches_leave_a_doubt() {
        let scattered: Vec<PatchMatch> = (0..14)
            .map(|at| PatchMatch {
                u_px: 40.0 * f64::from(at),
                disparity_px: 10.0,
                rows_px: 4.0 * f64::from(at * 5 % 7) - 12.0 + 0.8,
                brightness: 1.0,
            })
            .collect();
        let found = RowError::of(&scattered.iter().collect::<Vec<_>>(), 600.0);
        assert!(found.certain_px(600.0) < 0.5 && found.rest_px > 2.0, "{found:?}");
    }

    #[test]
    fn matches_in_one_column_tell_no_roll_and_none_tell_nothing() {
        let narrow: Vec<PatchMatch> = (0..40)
            .map(|_| PatchMatch { u_px: 50.0, disparity_px: 1.0, rows_px: 2.0, brightness: 1.0 })
            .collect();
        let found = RowError::of(&narrow.iter().collect::<Vec<_>>(), 600.0);
        assert_eq!((found.shift_px, found.roll_deg), (2.0, 0.0));
        let none = RowError::of(&[], 600.0);
        assert!(found.certain_px(600.0) < 0.0 && none.certain_px(600.0) < 0.0, "{found:?}");
    }
}
