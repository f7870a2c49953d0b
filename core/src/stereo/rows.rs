//! Rows that are matched densely.
//!
//! Surfaces seldom change within two rows, so that images of many rows are matched on every second
//! one ([`StereoConfig::second_rows_from`]); on fewer, where a budget of work allows no more.
//! Matched rows lie one behind the other in the working image, until speckles are removed and gaps
//! filled.

use super::StereoConfig;
use crate::memory::Capacity;

/// Widest limit, in working units: no disparity is so near to the mark of none.
const WIDEST: usize = i16::MAX as usize / 2;

/// The rows of an image that are matched, evenly spaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MatchedRows {
    /// Image rows from one to the next: 1 or 2, more within a budget.
    pub step: usize,
    /// Number of rows.
    pub count: usize,
}

impl MatchedRows {
    /// The rows of an image of that height.
    pub const fn new(config: &StereoConfig, height: usize) -> Self {
        let is_thinned = config.second_rows_from > 0 && height >= config.second_rows_from;
        let step = if is_thinned { 2 } else { 1 };
        Self { step, count: height / step }
    }

    /// The rows of an image of that height, `most` at most: where all are more, others farther
    /// apart.
    pub fn within(config: &StereoConfig, height: usize, most: usize) -> Self {
        let all = Self::new(config, height);
        if all.count <= most {
            return all;
        }
        // The least step with no more rows than that.
        Self::every(height / (most + 1) + 1, height)
    }

    /// The rows of an image of that height, so many image rows from one to the next.
    pub fn every(step: usize, height: usize) -> Self {
        Self { step, count: height / step.max(1) }
    }

    /// Rows are farther apart than without a budget.
    pub const fn is_sparse(self) -> bool {
        self.step > 2
    }

    /// The most, in working units, that disparities of one surface differ by from a row to the
    /// next, of a limit for rows that lie at most two apart.
    pub fn widened(self, limit: i16) -> i16 {
        if !self.is_sparse() {
            return limit;
        }
        let widened = limit.unsigned_abs() as usize * self.step / 2;
        widened.min(WIDEST) as i16
    }

    /// Image row of matched row `i`: the last of its `step` rows, since the first one of an image
    /// has no descriptors.
    pub const fn row(self, i: usize) -> usize {
        (i + 1) * self.step - 1
    }

    /// The most rows that are matched in any image of at most that height.
    pub const fn most(config: &StereoConfig, height: usize) -> usize {
        let full = Self::new(config, height).count;
        // Lower images may be matched at every row.
        let lower = config.second_rows_from.saturating_sub(1);
        let lower = if lower < height { lower } else { height };
        if full > lower { full } else { lower }
    }
}

/// Pixels that are matched densely in an image within the capacity, at most.
pub(crate) const fn most_pixels(capacity: &Capacity, config: &StereoConfig) -> usize {
    capacity.image_width * MatchedRows::most(config, capacity.image_height)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn from(second_rows_from: usize) -> StereoConfig {
        StereoConfig { second_rows_from, ..StereoConfig::default() }
    }

    #[test]
    fn images_of_many_rows_are_matched_on_every_second_one() {
        for (limit, height, step, count) in
            [(0, 375, 1, 375), (200, 199, 1, 199), (200, 200, 2, 100), (200, 375, 2, 187)]
        {
            let rows = MatchedRows::new(&from(limit), height);
            assert_eq!(rows, MatchedRows { step, count });
            assert!(rows.row(count - 1) < height && rows.row(0) == step - 1);
        }
    }

    #[test]
    fn a_budget_leaves_as_many_rows_as_it_allows_and_no_more() {
        for limit in [0, 200] {
            for height in [16, 199, 200, 375, 601] {
                let all = MatchedRows::new(&from(limit), height);
                for most in 0..=all.count + 1 {
                    let rows = MatchedRows::within(&from(limit), height, most);
                    assert_eq!(rows.count, height / rows.step);
                    assert!(rows.count <= most && rows.step >= all.step, "{height}: {rows:?}");
                    assert!(most < all.count || rows == all, "{height}: {rows:?} of {most}");
                    // One step less would be too many.
                    let closer = rows.step - 1;
                    assert!(rows == all || height / closer > most, "{height}: {rows:?} of {most}");
                }
            }
        }
    }

    #[test]
    fn the_bound_on_rows_holds_for_every_lower_image_and_is_met_by_one() {
        for limit in [0, 1, 17, 200, 300, 301, 5_000] {
            for height in [16, 200, 201, 300, 599] {
                let counts =
                    (1..=height).map(|height| MatchedRows::new(&from(limit), height).count);
                let most = MatchedRows::most(&from(limit), height);
                assert_eq!(most, counts.max().unwrap(), "{height} from {limit}");
            }
        }
    }
}
