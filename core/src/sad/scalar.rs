//! Kernels without vectors: one pair of descriptors after the other.

use super::{Descriptor, Eight, Inside, KEY_SCALE_BITS, Kernels, LANES, OFFSET_BITS, for_columns};

/// A sum of absolute differences of two descriptors, by the instructions of one machine.
pub(super) trait Distance {
    /// Sum of absolute differences, at most 4,080.
    fn distance(&self, a: &Descriptor, b: &Descriptor) -> u32;
}

/// Distances by ordinary code.
pub(super) struct Ordinary;

impl Distance for Ordinary {
    #[inline(always)]
    fn distance(&self, a: &Descriptor, b: &Descriptor) -> u32 {
        super::distance(a, b)
    }
}

/// Kernels that take one pair of descriptors after the other.
pub(super) struct OneByOne<D>(pub D);

/// The twins of all other kernels, and the kernels of machines without any.
pub(super) const PLAIN: OneByOne<Ordinary> = OneByOne(Ordinary);

impl<D: Distance> Kernels for OneByOne<D> {
    #[inline(always)]
    fn sums(&self, a: &Eight<Descriptor>, b: &Eight<Descriptor>) -> Eight<u32> {
        self.sums_of(a, b.each_ref())
    }

    #[inline(always)]
    fn sums_of(&self, a: &Eight<Descriptor>, b: Eight<&Descriptor>) -> Eight<u32> {
        let mut sums = [0; LANES];
        sums.iter_mut().zip(a.iter().zip(b)).for_each(|(sum, (a, b))| *sum = self.0.distance(a, b));
        sums
    }

    #[inline(always)]
    fn sums_of_two(&self, a: &Eight<Descriptor>, b: Eight<&[Descriptor; 2]>) -> [Eight<u32>; 2] {
        let mut sums = [[0; LANES]; 2];
        for (step, sums) in sums.iter_mut().enumerate() {
            let others = b.iter().filter_map(|two| two.get(step));
            sums.iter_mut()
                .zip(a.iter().zip(others))
                .for_each(|(sum, (a, b))| *sum = self.0.distance(a, b));
        }
        sums
    }

    #[inline(always)]
    fn quotients(&self, mut dividends: Eight<i32>, divisors: Eight<i32>) -> Eight<i32> {
        // Such integers are exact, and so is their quotient once its fraction is cut off.
        dividends.iter_mut().zip(divisors).for_each(|(a, b)| *a = (*a as f32 / b as f32) as i32);
        dividends
    }

    #[inline(always)]
    fn least_inside(
        &self,
        mut best: Eight<u32>,
        [first, second]: &[Descriptor; 2],
        others: &Eight<[Descriptor; 2]>,
        inside: &Inside<'_>,
    ) -> Eight<u32> {
        let Inside { at, low, span, offset, end } = *inside;
        for ((best, offset), ([u, v], [a, b])) in
            best.iter_mut().zip(offset..).zip(at.iter().zip(others))
        {
            // Left of the first column, or above the first row, differences wrap to far beyond the
            // last.
            let counts = (u.wrapping_sub(low[0]) <= span[0])
                & (v.wrapping_sub(low[1]) <= span[1])
                & (offset < end);
            let key =
                (self.0.distance(first, a) + self.0.distance(second, b)) << OFFSET_BITS | offset;
            *best = if counts { key.min(*best) } else { *best };
        }
        best
    }

    #[inline(always)]
    fn least(
        &self,
        mut best: Eight<u32>,
        [a, b]: [&Eight<Descriptor>; 2],
        base: u32,
    ) -> Eight<u32> {
        for (best, (a, b)) in best.iter_mut().zip(a.iter().zip(b)) {
            *best = ((self.0.distance(a, b) << KEY_SCALE_BITS) + base).min(*best);
        }
        best
    }

    #[inline(always)]
    fn ordered(&self, keys: Eight<u32>) -> Eight<u32> {
        keys
    }

    #[inline(always)]
    fn costs(
        &self,
        point: &[Descriptor; 4],
        columns: [&[Eight<Descriptor>]; 4],
        costs: &mut [Eight<i16>],
    ) {
        for_columns(columns, costs, |columns| {
            let mut costs = [0; LANES];
            for (corner, column) in point.iter().zip(columns) {
                costs
                    .iter_mut()
                    .zip(column)
                    .for_each(|(cost, other)| *cost += self.0.distance(corner, other) as i16);
            }
            costs
        });
    }
}
