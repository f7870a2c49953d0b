//! Counting points of one region in one frame.

use serde::{Deserialize, Serialize};

/// Limits beyond which a disparity is wrong: off by more than `px` and by more than `share` of the
/// true one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    /// Error allowed, px.
    pub px: f32,
    /// Error allowed as a share of the true disparity; 0 for a plain threshold.
    pub share: f32,
}

impl Rule {
    /// KITTI's: right when off by at most 3 px or 5 %.
    pub const KITTI: Self = Self { px: 3.0, share: 0.05 };

    const fn plain(px: f32) -> Self {
        Self { px, share: 0.0 }
    }

    /// Name of the rule in figures.
    pub const KITTI_NAME: &'static str = "3 px or 5 %";

    /// Returns true if a disparity is wrong by this rule.
    pub fn is_error(&self, disparity_px: f32, true_px: f32) -> bool {
        let off_px = (disparity_px - true_px).abs();
        off_px > self.px && off_px > self.share * true_px
    }
}

/// All rules counted: KITTI's, by which accuracy is reported, then the original's plain thresholds.
pub const ACCEPTANCE_RULES: [Rule; 14] = [
    Rule::KITTI,
    Rule::plain(0.5),
    Rule::plain(1.0),
    Rule::plain(2.0),
    Rule::plain(3.0),
    Rule::plain(4.0),
    Rule::plain(5.0),
    Rule::plain(6.0),
    Rule::plain(7.0),
    Rule::plain(8.0),
    Rule::plain(9.0),
    Rule::plain(10.0),
    Rule::plain(11.0),
    Rule::plain(12.0),
];

/// Counts of one source.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SourceCounts {
    /// Points this source lacks.
    pub missing_alone: u32,
    /// Wrong points by rule, of those both sources have.
    pub errors: [u32; ACCEPTANCE_RULES.len()],
    /// Wrong points by rule, of those this source has.
    pub errors_alone: [u32; ACCEPTANCE_RULES.len()],
}

/// Counts of one region in one frame. `total = errors + missing + correct` for either source and
/// every rule.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Points.
    pub total: u32,
    /// Points that input or map lacks.
    pub missing: u32,
    /// Input, then map.
    pub sources: [SourceCounts; 2],
}

impl Counts {
    /// Takes in a point: its true disparity, the input's and the map's; 0 where it is unknown.
    pub fn add(&mut self, true_px: f32, seen_px: [f32; 2]) {
        self.total += 1;
        let both = seen_px.iter().all(|&seen| seen > 0.0);
        self.missing += u32::from(!both);
        for (source, seen) in self.sources.iter_mut().zip(seen_px) {
            if seen <= 0.0 {
                source.missing_alone += 1;
                // One source can be compared where the other has no answer; `errors` counts points
                // that both have.
                continue;
            }
            for (at, rule) in ACCEPTANCE_RULES.iter().enumerate() {
                let wrong = u32::from(rule.is_error(seen, true_px));
                source.errors_alone[at] += wrong;
                source.errors[at] += if both { wrong } else { 0 };
            }
        }
    }

    /// Share of the points both sources have that are right in source `source`, by rule `rule`;
    /// `None` where there is no point.
    pub fn accuracy(&self, source: usize, rule: usize) -> Option<f64> {
        right(self.sources[source].errors[rule], self.total - self.missing)
    }

    /// Returns the accuracy over all points this source has, even where the other source has none.
    pub fn accuracy_alone(&self, source: usize, rule: usize) -> Option<f64> {
        let of = &self.sources[source];
        right(of.errors_alone[rule], self.total - of.missing_alone)
    }

    /// Share of the points the source has.
    pub fn completeness(&self, source: usize) -> Option<f64> {
        right(self.sources[source].missing_alone, self.total)
    }

    /// Harmonic mean of accuracy and completeness.
    pub fn f1(&self, source: usize, rule: usize) -> Option<f64> {
        let (a, c) = (self.accuracy(source, rule)?, self.completeness(source)?);
        (a + c > 0.0).then(|| 2.0 * a * c / (a + c))
    }
}

fn right(wrong: u32, all: u32) -> Option<f64> {
    (all > 0).then(|| f64::from(all - wrong) / f64::from(all))
}
