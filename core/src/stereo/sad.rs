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

    /// The lesser of `best` and of what the pairs' sums make with `base` and `barred`, each positive as `i32`: `((sum << 12) + base) | barred`.
    fn least(&self, best: Eight<u32>, pairs: [&Eight<Descriptor>; 2], base: u32, barred: &Eight<u32>) -> Eight<u32>;

    /// Sums of absolute differences of four descriptors with those of eight columns, each at most 16,320.
    fn costs(&self, point: &[Descriptor; 4], columns: [&Eight<Descriptor>; 4]) -> Eight<i16>;
}

/// Kernels as functions, so that each can be written where its instructions are safe.
#[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
struct Functions<S, L, C> {
    sums: S,
    least: L,
    costs: C,
}

#[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
impl<S, L, C> Kernels for Functions<S, L, C>
where
    S: Fn(&Eight<Descriptor>, &Eight<Descriptor>) -> Eight<u32>,
    L: Fn(Eight<u32>, [&Eight<Descriptor>; 2], u32, &Eight<u32>) -> Eight<u32>,
    C: Fn(&[Descriptor; 4], [&Eight<Descriptor>; 4]) -> Eight<i16>,
{
    #[inline(always)]
    fn sums(&self, a: &Eight<Descriptor>, b: &Eight<Descriptor>) -> Eight<u32> {
        (self.sums)(a, b)
    }

    #[inline(always)]
    fn least(&self, best: Eight<u32>, pairs: [&Eight<Descriptor>; 2], base: u32, barred: &Eight<u32>) -> Eight<u32> {
        (self.least)(best, pairs, base, barred)
    }

    #[inline(always)]
    fn costs(&self, point: &[Descriptor; 4], columns: [&Eight<Descriptor>; 4]) -> Eight<i16> {
        (self.costs)(point, columns)
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
        let mut sums = [0; LANES];
        sums.iter_mut().zip(a.iter().zip(b)).for_each(|(sum, (a, b))| *sum = distance(a, b));
        sums
    }

    #[inline(always)]
    fn least(&self, mut best: Eight<u32>, [a, b]: [&Eight<Descriptor>; 2], base: u32, barred: &Eight<u32>) -> Eight<u32> {
        for ((best, (a, b)), barred) in best.iter_mut().zip(a.iter().zip(b)).zip(barred) {
            *best = (((distance(a, b) << 12) + base) | barred).min(*best);
        }
        best
    }

    #[inline(always)]
    fn costs(&self, point: &[Descriptor; 4], columns: [&Eight<Descriptor>; 4]) -> Eight<i16> {
        let mut costs = [0; LANES];
        for (corner, column) in point.iter().zip(columns) {
            costs.iter_mut().zip(column).for_each(|(cost, other)| *cost += distance(corner, other) as i16);
        }
        costs
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
        best: Eight<u32>,
        barred: Eight<u32>,
    }

    impl Comparison for Equal {
        fn run(self, kernels: &impl Kernels) {
            let Self { a, b, best, barred } = self;
            assert_eq!(kernels.sums(&a, &b), Plain.sums(&a, &b));
            for base in [0, 7, 65_280 << 8 | 255] {
                assert_eq!(kernels.least(best, [&a, &b], base, &barred), Plain.least(best, [&a, &b], base, &barred));
            }
            let (point, columns) = ([a[0], a[3], b[5], b[7]], [&a, &b, &b, &a]);
            assert_eq!(kernels.costs(&point, columns), Plain.costs(&point, columns));
        }
    }

    #[test]
    fn every_level_gives_the_sums_of_ordinary_code() {
        let mut random = Random::new(8);
        for vectors in Vectors::available() {
            for bound in [2, 16, 256].repeat(50) {
                let [a, b] =
                    [(); 2].map(|()| [(); LANES].map(|()| Descriptor([(); 16].map(|()| (random.below(bound) * 255 / (bound - 1)) as u8))));
                let best = [(); LANES].map(|()| random.below(1 << 30));
                let barred = [(); LANES].map(|()| random.below(2) << 30);
                compare(vectors, Equal { a, b, best, barred });
            }
            let extremes = [[0; 16], [255; 16]].map(Descriptor);
            compare(
                vectors,
                Equal {
                    a: [extremes[0]; LANES],
                    b: [extremes[1]; LANES],
                    best: [1 << 30; LANES],
                    barred: [0; LANES],
                },
            );
        }
    }
}
