//! Counts of values in bins, from which quantiles are read without keeping the values.

use super::quantile::rank;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Bits of a float's fraction that a bin does not tell apart: 512 bins to each power of two.
const DROPPED_BITS: u32 = 14;

/// Counts of values from 0 on. Memory: a counter for each bin that has a value, 512 for each power
/// of two they span. A quantile is the middle of its bin, within 0.1 % of the value.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Histogram {
    counts: BTreeMap<u32, u64>,
    values: u64,
}

impl Histogram {
    /// Counts a value; one below 0 counts as 0, NaN not at all.
    pub fn add(&mut self, value: f64) {
        if !value.is_nan() {
            *self.counts.entry((value.max(0.0) as f32).to_bits() >> DROPPED_BITS).or_default() += 1;
            self.values += 1;
        }
    }

    /// Values counted.
    pub fn values(&self) -> usize {
        self.values as usize
    }

    /// The value at `share`, 0 to 1, of all in ascending order; `None` without any.
    pub fn quantile(&self, share: f64) -> Option<f64> {
        let rank = rank(self.values(), share) as u64;
        let mut below = 0;
        let bin = self.counts.iter().find(|(_, count)| {
            below += **count;
            below > rank
        });
        bin.map(|(&bin, _)| {
            if bin == 0 {
                0.0
            } else {
                // The middle of the bin: the dropped bits are half of their range.
                f64::from(f32::from_bits(bin << DROPPED_BITS | 1 << (DROPPED_BITS - 1)))
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::quantile::{ascending, quantile};

    #[test]
    fn quantiles_are_within_a_thousandth_of_those_of_the_values() {
        let values: Vec<f64> = (0..5_000u32)
            .map(|at| f64::from(at.wrapping_mul(2_654_435_761) >> 12) * 1e-4)
            .collect();
        let mut histogram = Histogram::default();
        values.iter().for_each(|value| histogram.add(*value));
        // No value, and counted by none.
        histogram.add(f64::NAN);
        let sorted = ascending(values.into_iter());
        for share in [0.0, 0.01, 0.5, 0.99, 1.0] {
            let (ours, exact) =
                (histogram.quantile(share).unwrap(), quantile(&sorted, share).unwrap());
            assert!((ours - exact).abs() <= 0.001 * exact, "{share}: {ours} for {exact}");
        }
        assert_eq!((histogram.values(), Histogram::default().quantile(0.5)), (5_000, None));
        // -0 has its sign bit set, and must count as 0.
        let mut zero = Histogram::default();
        zero.add(-0.0);
        assert_eq!(zero.quantile(0.5), Some(0.0));
    }
}
