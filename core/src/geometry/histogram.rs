//! The median of many values by their counts, exact to a bin. The order of the values does not
//! matter.

/// Bins of a [`Histogram`].
pub(crate) const BINS: usize = 512;

/// Values counted by bin. Memory: 2 KiB.
pub(crate) struct Histogram {
    counts: [u32; BINS],
    total: u32,
}

impl Histogram {
    pub const fn new() -> Self {
        Self { counts: [0; BINS], total: 0 }
    }

    /// Counts a value; one beyond the last bin is left out.
    pub fn add(&mut self, bin: usize) {
        if let Some(count) = self.counts.get_mut(bin) {
            *count += 1;
            self.total += 1;
        }
    }

    /// Values counted.
    pub const fn total(&self) -> u32 {
        self.total
    }

    /// The bin of the median: the first up to whose end more than half of all values lie. `None` of
    /// no value.
    pub fn median(&self) -> Option<usize> {
        let mut below = 0;
        self.counts.iter().position(|&count| {
            below += count;
            2 * below > self.total
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle_value_and_of_two_the_greater() {
        let of = |bins: &[usize]| {
            let mut histogram = Histogram::new();
            bins.iter().for_each(|&bin| histogram.add(bin));
            (histogram.total(), histogram.median())
        };
        assert_eq!(of(&[]), (0, None));
        // A value beyond the bins is not counted.
        assert_eq!(of(&[BINS]), (0, None));
        assert_eq!(of(&[BINS - 1]), (1, Some(BINS - 1)));
        assert_eq!(of(&[9, 0, 300]), (3, Some(9)));
        assert_eq!(of(&[9, 0, 300, 4]), (4, Some(9)));
    }
}
