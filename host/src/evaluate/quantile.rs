//! The one definition of a quantile: of `n` sorted values the one at position `share * n`, rounded
//! down. The median of an even number is the higher of the two in the middle. A quantile is always
//! a value that occurred, so infinite ones need no special case.

/// The value at `share`, 0 to 1, of ascending values; `None` without values.
pub fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    sorted.get(rank(sorted.len(), share)).copied()
}

/// Median of the values that are not NaN; `None` without any.
pub fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    quantile(&ascending(values), 0.5)
}

/// The values that are not NaN, ascending.
pub fn ascending(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.filter(|value| !value.is_nan()).collect();
    values.sort_by(f64::total_cmp);
    values
}

/// The bin that the value at `share` lies in, of a histogram; `None` when it is empty.
pub fn quantile_bin(counts: &[u64], share: f64) -> Option<usize> {
    let all: u64 = counts.iter().sum();
    // The rank of a value in all of them, from 0 on.
    let rank = rank(usize::try_from(all).unwrap_or(usize::MAX), share) as u64;
    let mut below = 0;
    counts.iter().position(|count| {
        below += count;
        below > rank
    })
}

/// Five numbers for a box plot: whiskers end at the last value within one and a half times the
/// box's height (Tukey).
pub fn five_numbers(values: &[f64]) -> Option<[f64; 5]> {
    // Frames without a figure have no place in a box plot.
    let sorted = ascending(values.iter().copied().filter(|value| value.is_finite()));
    let [low, middle, high] =
        [quantile(&sorted, 0.25)?, quantile(&sorted, 0.5)?, quantile(&sorted, 0.75)?];
    let reach = 1.5 * (high - low);
    // Values, not limits: a whisker ends where a frame lies.
    let first = sorted.iter().copied().find(|value| *value >= low - reach)?;
    let last = sorted.iter().rev().copied().find(|value| *value <= high + reach)?;
    Some([first, low, middle, high, last])
}

pub(super) fn rank(len: usize, share: f64) -> usize {
    ((share * len as f64) as usize).min(len.saturating_sub(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values_that_occurred() {
        let sorted: Vec<f64> = (1..=200).map(f64::from).collect();
        assert_eq!(
            [0.0, 0.5, 0.99, 1.0].map(|share| quantile(&sorted, share)),
            [1.0, 101.0, 199.0, 200.0].map(Some)
        );
        assert_eq!(quantile(&[], 0.5), None);
        assert_eq!(median([3.0, f64::NAN, 1.0, f64::INFINITY].into_iter()), Some(3.0));
    }

    #[test]
    fn a_histogram_has_the_quantiles_of_its_values() {
        let counts = [2, 0, 3, 5];
        let values: Vec<f64> = [0.0, 0.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 3.0, 3.0].to_vec();
        for share in [0.0, 0.19, 0.2, 0.5, 0.99, 1.0] {
            assert_eq!(
                quantile_bin(&counts, share).map(|bin| bin as f64),
                quantile(&values, share),
                "{share}"
            );
        }
        assert_eq!(quantile_bin(&[0, 0], 0.5), None);
    }

    #[test]
    fn boxes_are_quartiles_and_whiskers_end_at_values() {
        // By hand: nine values and one far off.
        let values = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 100.0];
        assert_eq!(five_numbers(&values), Some([1.0, 3.0, 5.0, 7.0, 8.0]));
        assert_eq!(five_numbers(&[2.0, 1.0]), Some([1.0, 1.0, 2.0, 2.0, 2.0]));
        assert_eq!((five_numbers(&[0.5]), five_numbers(&[])), (Some([0.5; 5]), None));
    }
}
