//! Sums of absolute differences of eight descriptors at a time, by the vector instructions there are.
//!
//! x86 has one instruction for such sums, which compilers find in a loop over one pair at most. Work that compares descriptors is
//! therefore written once, over [`Eight`] pairs, and compiled for each level of instructions (docs/decisions/0023-vector-kernels.md).

use super::descriptor::{Descriptor, distance};
use crate::parallel::{Level, Vectors};

/// Pairs compared at once: neighbours in a row.
pub(super) const LANES: usize = 8;
/// One value for each of them.
pub(super) type Eight<T> = [T; LANES];

/// Eight descriptors without texture.
pub(super) const UNTEXTURED: Eight<Descriptor> = [Descriptor::UNTEXTURED; LANES];

/// Work that compares descriptors.
pub(super) trait Comparison {
    /// Does the work. To be inlined, with all it calls, so that it is compiled for the level of the kernels.
    fn run(self, kernels: &impl Kernels);
}

/// What there is a kernel for.
pub(super) trait Kernels {
    /// Sums of absolute differences of eight pairs, each at most 4,080.
    fn sums(&self, a: &Eight<Descriptor>, b: &Eight<Descriptor>) -> Eight<u32>;

    /// The same with descriptors from anywhere.
    fn sums_of(&self, a: &Eight<Descriptor>, b: Eight<&Descriptor>) -> Eight<u32>;

    /// The lesser of `best` and of what the pairs' sums make with `base`, each positive as `i32`: `(sum << 12) + base`. In the order in
    /// which the sums come, which [`Kernels::ordered`] undoes.
    fn least(&self, best: Eight<u32>, pairs: [&Eight<Descriptor>; 2], base: u32) -> Eight<u32>;

    /// What [`Kernels::least`] made, in the order of the pairs.
    fn ordered(&self, keys: Eight<u32>) -> Eight<u32>;

    /// Sums of absolute differences of four descriptors with those of columns, eight at a time, each at most 16,320. As many as there are
    /// of all four and room for.
    fn costs(&self, point: &[Descriptor; 4], columns: [&[Eight<Descriptor>]; 4], costs: &mut [Eight<i16>]);
}

/// Kernels as functions, so that each can be written where its instructions are safe.
#[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
struct Functions<S, F, L, O, C> {
    sums: S,
    sums_of: F,
    least: L,
    ordered: O,
    costs: C,
}

#[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
impl<S, F, L, O, C> Kernels for Functions<S, F, L, O, C>
where
    S: Fn(&Eight<Descriptor>, &Eight<Descriptor>) -> Eight<u32>,
    F: Fn(&Eight<Descriptor>, Eight<&Descriptor>) -> Eight<u32>,
    L: Fn(Eight<u32>, [&Eight<Descriptor>; 2], u32) -> Eight<u32>,
    O: Fn(Eight<u32>) -> Eight<u32>,
    C: Fn(&[Descriptor; 4], [&Eight<Descriptor>; 4]) -> Eight<i16>,
{
    #[inline(always)]
    fn sums(&self, a: &Eight<Descriptor>, b: &Eight<Descriptor>) -> Eight<u32> {
        (self.sums)(a, b)
    }

    #[inline(always)]
    fn sums_of(&self, a: &Eight<Descriptor>, b: Eight<&Descriptor>) -> Eight<u32> {
        (self.sums_of)(a, b)
    }

    #[inline(always)]
    fn least(&self, best: Eight<u32>, pairs: [&Eight<Descriptor>; 2], base: u32) -> Eight<u32> {
        (self.least)(best, pairs, base)
    }

    #[inline(always)]
    fn ordered(&self, keys: Eight<u32>) -> Eight<u32> {
        (self.ordered)(keys)
    }

    #[inline(always)]
    fn costs(&self, point: &[Descriptor; 4], columns: [&[Eight<Descriptor>]; 4], costs: &mut [Eight<i16>]) {
        for_columns(columns, costs, |columns| (self.costs)(point, columns));
    }
}

/// Fills in what columns cost, eight at a time.
#[inline(always)]
fn for_columns([a, b, c, d]: [&[Eight<Descriptor>]; 4], costs: &mut [Eight<i16>], cost: impl Fn([&Eight<Descriptor>; 4]) -> Eight<i16>) {
    for ((costs, (a, b)), (c, d)) in costs.iter_mut().zip(a.iter().zip(b)).zip(c.iter().zip(d)) {
        *costs = cost([a, b, c, d]);
    }
}

/// Runs work with the instructions that there are.
#[cfg_attr(
    all(target_arch = "x86_64", target_feature = "sse2"),
    expect(unsafe_code, reason = "calls code compiled for what the processor has")
)]
pub(super) fn compare(vectors: Vectors, work: impl Comparison) {
    match vectors.level() {
        Level::Plain => work.run(&Plain),
        // SAFETY: all of the target's machines have SSE2.
        #[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
        Level::Sse2 => unsafe { x86::with_sse2(work) },
        // SAFETY: this level exists only where the processor says that it has AVX2.
        #[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
        Level::Avx2 => unsafe { x86::with_avx2(work) },
    }
}

/// The twins of the kernels, and the kernels of machines without any.
struct Plain;

impl Kernels for Plain {
    #[inline(always)]
    fn sums(&self, a: &Eight<Descriptor>, b: &Eight<Descriptor>) -> Eight<u32> {
        self.sums_of(a, b.each_ref())
    }

    #[inline(always)]
    fn sums_of(&self, a: &Eight<Descriptor>, b: Eight<&Descriptor>) -> Eight<u32> {
        let mut sums = [0; LANES];
        sums.iter_mut().zip(a.iter().zip(b)).for_each(|(sum, (a, b))| *sum = distance(a, b));
        sums
    }

    #[inline(always)]
    fn least(&self, mut best: Eight<u32>, [a, b]: [&Eight<Descriptor>; 2], base: u32) -> Eight<u32> {
        for (best, (a, b)) in best.iter_mut().zip(a.iter().zip(b)) {
            *best = ((distance(a, b) << 12) + base).min(*best);
        }
        best
    }

    #[inline(always)]
    fn ordered(&self, keys: Eight<u32>) -> Eight<u32> {
        keys
    }

    #[inline(always)]
    fn costs(&self, point: &[Descriptor; 4], columns: [&[Eight<Descriptor>]; 4], costs: &mut [Eight<i16>]) {
        for_columns(columns, costs, |columns| {
            let mut costs = [0; LANES];
            for (corner, column) in point.iter().zip(columns) {
                costs.iter_mut().zip(column).for_each(|(cost, other)| *cost += distance(corner, other) as i16);
            }
            costs
        });
    }
}

#[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
mod x86;

/// Eight descriptors from column `at` on. Those beyond the row are taken from `spare`, which is filled for the purpose.
#[inline(always)]
pub(super) fn eight<'r>(row: &'r [Descriptor], at: usize, spare: &'r mut Eight<Descriptor>) -> &'r Eight<Descriptor> {
    match row.get(at..).and_then(|row| row.first_chunk()) {
        Some(all) => all,
        None => copy_within(row, at, spare),
    }
}

/// Copies those of the columns from `at` on that are within the row; a column left of it has wrapped around.
#[cold]
#[inline(never)]
fn copy_within<'r>(row: &[Descriptor], at: usize, spare: &'r mut Eight<Descriptor>) -> &'r Eight<Descriptor> {
    for (lane, to) in spare.iter_mut().enumerate() {
        *to = row.get(at.wrapping_add(lane)).copied().unwrap_or(Descriptor::UNTEXTURED);
    }
    spare
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Kernels and their twins on one input.
    struct Equal {
        a: Eight<Descriptor>,
        b: Eight<Descriptor>,
        /// The greatest key to begin with.
        most: u32,
    }

    impl Equal {
        /// The least keys of two candidates.
        fn least(&self, base: u32, kernels: &impl Kernels) -> Eight<u32> {
            let halved = self.a.map(|Descriptor(bytes)| Descriptor(bytes.map(|byte| byte / 2)));
            let best = kernels.least([self.most; LANES], [&self.a, &self.b], base);
            kernels.ordered(kernels.least(best, [&self.b, &halved], base + 1))
        }
    }

    impl Comparison for Equal {
        fn run(self, kernels: &impl Kernels) {
            for base in [0, 7, 65_280 << 8 | 255] {
                assert_eq!(self.least(base, kernels), self.least(base, &Plain));
            }
            let Self { a, b, .. } = self;
            assert_eq!(kernels.sums(&a, &b), Plain.sums(&a, &b));
            assert_eq!(kernels.sums_of(&a, b.each_ref()), Plain.sums(&a, &b));
            let (point, columns) = ([a[0], a[3], b[5], b[7]], [&[a, b, b][..], &[b, a, a], &[b, b, a], &[a, b]]);
            let [mut costs, mut twin] = [[[-1; LANES]; 3]; 2];
            kernels.costs(&point, columns, &mut costs);
            Plain.costs(&point, columns, &mut twin);
            assert_eq!(costs, twin);
            assert_eq!(costs[2], [-1; LANES], "one of the four has two");
        }
    }

    #[test]
    fn every_level_gives_the_sums_of_ordinary_code() {
        let mut random = Random::new(8);
        for vectors in Vectors::available() {
            for bound in [2, 16, 256].repeat(50) {
                let [a, b] =
                    [(); 2].map(|()| [(); LANES].map(|()| Descriptor([(); 16].map(|()| (random.below(bound) * 255 / (bound - 1)) as u8))));
                compare(vectors, Equal { a, b, most: random.below(1 << 30) });
            }
            let extremes = [[0; 16], [255; 16]].map(Descriptor);
            compare(vectors, Equal { a: [extremes[0]; LANES], b: [extremes[1]; LANES], most: 1 << 30 });
        }
    }
}
