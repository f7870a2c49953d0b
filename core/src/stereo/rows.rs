//! Rows that are matched densely.
//!
//! Surfaces seldom change within two rows, so that images of many rows are matched on every second
//! one ([`StereoConfig::second_rows_from`]). Matched rows lie one behind the other in the working
//! image, until speckles are removed and gaps filled.

use super::StereoConfig;
use crate::memory::Capacity;

/// The rows of an image that are matched, evenly spaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MatchedRows {
    /// Image rows from one to the next: 1 or 2.
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
