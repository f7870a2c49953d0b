//! Which pose of one trajectory is of the same moment as which of another.

/// Times differ by at most this, s, as `evo` has it; and by at most half an interval of the
/// sparser trajectory.
pub(super) const SAME_TIME_S: f64 = 0.01;

/// Pairs of positions of the same moment, each position in at most one pair. Times increase. Each
/// time of the shorter list takes the nearest of the longer; of two that take the same, the nearer
/// has it.
pub(super) fn associated(first_s: &[f64], second_s: &[f64]) -> Vec<(usize, usize)> {
    let swapped = first_s.len() > second_s.len();
    let (short_s, long_s) = if swapped { (second_s, first_s) } else { (first_s, second_s) };
    // Half an interval of the sparser one: further off another pose would be nearer.
    let half_s = [short_s, long_s].map(half_interval_s).into_iter().fold(0.0, f64::max);
    let within_s = if half_s > 0.0 { SAME_TIME_S.min(half_s) } else { SAME_TIME_S };
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for (at, &time_s) in short_s.iter().enumerate() {
        let apart = |other: usize| long_s.get(other).map_or(f64::INFINITY, |s| (s - time_s).abs());
        let after = long_s.partition_point(|&s| s < time_s);
        let before = after.saturating_sub(1);
        // Of two equally near ones the earlier.
        let nearest = if apart(after) < apart(before) { after } else { before };
        if apart(nearest) > within_s {
            continue;
        }
        match pairs.last_mut().filter(|(_, taken)| *taken == nearest) {
            Some((other, taken)) => {
                if apart(*taken) < (long_s[*taken] - short_s[*other]).abs() {
                    *other = at;
                }
            }
            None => pairs.push((at, nearest)),
        }
    }
    // Back in the order of the arguments.
    if swapped {
        pairs.iter_mut().for_each(|pair| *pair = (pair.1, pair.0));
    }
    pairs
}

/// Half the median interval of increasing times; 0 of fewer than two.
fn half_interval_s(times_s: &[f64]) -> f64 {
    let mut intervals: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    intervals.sort_by(f64::total_cmp);
    intervals.get(intervals.len() / 2).map_or(0.0, |interval| interval / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(count: usize, rate_hz: f64, late_s: f64) -> Vec<f64> {
        (0..count).map(|at| at as f64 / rate_hz + late_s).collect()
    }

    #[test]
    fn a_path_at_200_hz_has_one_pose_for_each_of_its_truth_at_10_hz() {
        let (fast, slow) = (times(851, 200.0, 0.0), times(43, 10.0, 0.0));
        let pairs = associated(&fast, &slow);
        assert_eq!(pairs, (0..43).map(|at| (20 * at, at)).collect::<Vec<_>>());
        assert_eq!(associated(&slow, &fast), (0..43).map(|at| (at, 20 * at)).collect::<Vec<_>>());
    }

    #[test]
    fn gaps_have_no_partner_and_no_pose_has_two() {
        let mut gappy = times(100, 10.0, 0.002);
        gappy.drain(40..60);
        let pairs = associated(&gappy, &times(100, 10.0, 0.0));
        assert_eq!(pairs.len(), 80);
        assert!(pairs.iter().all(|&(a, b)| a == b || a + 20 == b));
        // Bursts of the shorter list around single times of the longer.
        let bursts = [0.0, 0.004, 1.0, 1.000_5, 2.0];
        assert_eq!(associated(&bursts, &times(6, 1.0, 0.001)), [(0, 0), (3, 1), (4, 2)]);
        assert_eq!(associated(&times(100, 10.0, 0.05), &times(100, 10.0, 0.0)), []);
    }
}
