//! Covariance of the states of a Kalman filter that learns from one number at a time.

use crate::state::Visitor;

/// Covariance of `N` states. A row of `N` factors makes a number of the states.
#[derive(Clone, Debug)]
pub(super) struct Covariance<const N: usize>(pub [[f64; N]; N]);

impl<const N: usize> Covariance<N> {
    /// Covariance of states that know nothing of each other.
    pub fn of_variances(variances: [f64; N]) -> Self {
        let mut entries = [[0.0; N]; N];
        let diagonal = entries.as_flattened_mut().iter_mut().step_by(N + 1);
        diagonal.zip(variances).for_each(|(entry, variance)| *entry = variance);
        Self(entries)
    }

    /// Variance of a number.
    pub fn variance(&self, row: &[f64; N]) -> f64 {
        dot(row, &self.with(row))
    }

    /// Covariances of the states with a number.
    fn with(&self, row: &[f64; N]) -> [f64; N] {
        self.0.map(|line| dot(&line, row))
    }

    /// Learns from a number that was measured with that variance. Returns how far each state
    /// follows an error of it; `None`, and nothing changes, where that is no number.
    pub fn measured(&mut self, row: &[f64; N], variance: f64) -> Option<[f64; N]> {
        let with = self.with(row);
        let sum = dot(row, &with) + variance;
        if !(sum.is_finite() && sum > 0.0) {
            return None;
        }
        let gain = with.map(|one| one / sum);
        for (line, gain) in self.0.iter_mut().zip(gain) {
            line.iter_mut().zip(with).for_each(|(entry, other)| *entry -= gain * other);
        }
        Some(gain)
    }

    /// Visits every entry.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        visitor.f64s(self.0.as_flattened_mut());
    }
}

impl<const N: usize> Default for Covariance<N> {
    fn default() -> Self {
        Self([[0.0; N]; N])
    }
}

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Standard deviation of a variance; 0 where rounding left less.
pub(super) fn root(variance: f64) -> f64 {
    libm::sqrt(if variance > 0.0 { variance } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_of_two_numbers_is_told_by_their_sum() {
        let mut covariance = Covariance::of_variances([1.0, 3.0]);
        let sum = [1.0, 1.0];
        assert_eq!(covariance.variance(&sum), 4.0);
        // Half of an error of the sum is its measurement's own.
        assert_eq!(covariance.measured(&sum, 4.0), Some([0.125, 0.375]));
        assert_eq!(covariance.variance(&sum), 2.0);
        assert_eq!(covariance.0, [[0.875, -0.375], [-0.375, 1.875]]);
    }

    #[test]
    fn a_measurement_that_is_no_number_changes_nothing() {
        let mut covariance = Covariance::of_variances([1.0, 3.0]);
        let before = covariance.0;
        for (row, variance) in
            [([f64::NAN, 0.0], 1.0), ([1.0, 0.0], f64::INFINITY), ([0.0; 2], 0.0)]
        {
            assert_eq!(covariance.measured(&row, variance), None);
            assert_eq!(covariance.0, before);
        }
        assert_eq!([root(4.0), root(-1e-20), root(f64::NAN)], [2.0, 0.0, 0.0]);
    }
}
