//! Sums of absolute differences of eight descriptors at a time, by the vector instructions there
//! are.
//!
//! x86 has one instruction for such sums, which compilers find in a loop over one pair at most.
//! Work that compares descriptors is therefore written once, over [`Eight`] pairs, and compiled for
//! each level of instructions (docs/decisions/0023-vector-kernels.md).

use crate::{
    lanes::{Eight, LANES},
    parallel::{Level, Vectors},
};
use bytemuck::{Pod, Zeroable};

/// Sixteen samples of an image around a pixel. Aligned, so that they are loaded as one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C, align(16))]
pub(crate) struct Descriptor(pub [u8; 16]);

/// Sum of absolute differences of two descriptors, at most 4,080.
///
/// Written as larger less smaller in bytes: where one descriptor stays the same throughout a loop,
/// the compiler would widen it once before the loop and so lose the one instruction that x86 has
/// for such sums.
#[inline(always)]
pub(crate) fn distance(a: &Descriptor, b: &Descriptor) -> u32 {
    let mut differences = [0u8; 16];
    for (difference, (&a, &b)) in differences.iter_mut().zip(a.0.iter().zip(&b.0)) {
        *difference = a.max(b) - a.min(b);
    }
    differences.iter().map(|&difference| u32::from(difference)).sum()
}

/// Work that compares descriptors.
pub(crate) trait Comparison {
    /// Does the work. To be inlined, with all it calls, so that it is compiled for the level of the
    /// kernels.
    fn run(self, kernels: &impl Kernels);
}

/// Bits of a key below the sum, for energies and disparities.
pub(crate) const KEY_SCALE_BITS: i32 = 12;
/// Bits of a key that tell which feature it is.
pub(crate) const OFFSET_BITS: u32 = 18;
/// The key of no feature.
pub(crate) const NO_FEATURE: u32 = i32::MAX as u32;

/// Eight features, and which of them count.
pub(crate) struct Inside<'a> {
    /// Columns and rows of the eight candidates.
    pub at: &'a Eight<[u16; 2]>,
    /// The first column and row of those that count.
    pub low: [u16; 2],
    /// Distance of the last candidates from there.
    pub span: [u16; 2],
    /// Offset of the first of the eight; the others follow.
    pub offset: u32,
    /// Candidates from here on do not count.
    pub end: u32,
}

/// Operations that have a vector kernel.
pub(crate) trait Kernels {
    /// Sums of absolute differences of eight pairs, each at most 4,080.
    fn sums(&self, a: &Eight<Descriptor>, b: &Eight<Descriptor>) -> Eight<u32>;

    /// Sums absolute differences with descriptors from anywhere.
    fn sums_of(&self, a: &Eight<Descriptor>, b: Eight<&Descriptor>) -> Eight<u32>;

    /// Sums of eight descriptors with two each, which lie side by side anywhere: those with the
    /// first ones, and those with the second ones.
    fn sums_of_two(&self, a: &Eight<Descriptor>, b: Eight<&[Descriptor; 2]>) -> [Eight<u32>; 2];

    /// Quotients of integers below 2^24, without their fractions; no divisor is 0.
    fn quotients(&self, dividends: Eight<i32>, divisors: Eight<i32>) -> Eight<i32>;

    /// The lesser of `best` and of the keys of eight features that are compared with one: the sum
    /// of absolute differences of their two descriptors, at most 8,160, above [`OFFSET_BITS`] for
    /// their offsets. Features outside do not count.
    fn least_inside(
        &self,
        best: Eight<u32>,
        sought: &[Descriptor; 2],
        others: &Eight<[Descriptor; 2]>,
        inside: &Inside<'_>,
    ) -> Eight<u32>;

    /// The lesser of `best` and of what the pairs' sums make with `base`, each positive as `i32`:
    /// `(sum << 12) + base`. In the order in which the sums come, which [`Kernels::ordered`]
    /// undoes.
    fn least(&self, best: Eight<u32>, pairs: [&Eight<Descriptor>; 2], base: u32) -> Eight<u32>;

    /// Returns the results of [`Kernels::least`] in the order of the pairs.
    fn ordered(&self, keys: Eight<u32>) -> Eight<u32>;

    /// Sums of absolute differences of four descriptors with those of columns, eight at a time,
    /// each at most 16,320. As many as there are of all four and space for.
    fn costs(
        &self,
        point: &[Descriptor; 4],
        columns: [&[Eight<Descriptor>]; 4],
        costs: &mut [Eight<i16>],
    );
}

/// Kernels as functions, so that each can be written where its instructions are safe.
#[cfg(any(
    all(target_arch = "x86_64", target_feature = "sse2"),
    all(target_arch = "aarch64", target_feature = "neon", target_endian = "little")
))]
struct Functions<S, F, T, Q, W, L, O, C> {
    sums: S,
    sums_of: F,
    sums_of_two: T,
    quotients: Q,
    least_inside: W,
    least: L,
    ordered: O,
    costs: C,
}

#[cfg(any(
    all(target_arch = "x86_64", target_feature = "sse2"),
    all(target_arch = "aarch64", target_feature = "neon", target_endian = "little")
))]
impl<S, F, T, Q, W, L, O, C> Kernels for Functions<S, F, T, Q, W, L, O, C>
where
    S: Fn(&Eight<Descriptor>, &Eight<Descriptor>) -> Eight<u32>,
    F: Fn(&Eight<Descriptor>, Eight<&Descriptor>) -> Eight<u32>,
    T: Fn(&Eight<Descriptor>, Eight<&[Descriptor; 2]>) -> [Eight<u32>; 2],
    Q: Fn(Eight<i32>, Eight<i32>) -> Eight<i32>,
    W: Fn(Eight<u32>, &[Descriptor; 2], &Eight<[Descriptor; 2]>, &Inside<'_>) -> Eight<u32>,
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
    fn sums_of_two(&self, a: &Eight<Descriptor>, b: Eight<&[Descriptor; 2]>) -> [Eight<u32>; 2] {
        (self.sums_of_two)(a, b)
    }

    #[inline(always)]
    fn quotients(&self, dividends: Eight<i32>, divisors: Eight<i32>) -> Eight<i32> {
        (self.quotients)(dividends, divisors)
    }

    #[inline(always)]
    fn least_inside(
        &self,
        best: Eight<u32>,
        sought: &[Descriptor; 2],
        others: &Eight<[Descriptor; 2]>,
        inside: &Inside<'_>,
    ) -> Eight<u32> {
        (self.least_inside)(best, sought, others, inside)
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
    fn costs(
        &self,
        point: &[Descriptor; 4],
        columns: [&[Eight<Descriptor>]; 4],
        costs: &mut [Eight<i16>],
    ) {
        for_columns(columns, costs, |columns| (self.costs)(point, columns));
    }
}

/// Fills in what columns cost, eight at a time.
#[inline(always)]
fn for_columns(
    [a, b, c, d]: [&[Eight<Descriptor>]; 4],
    costs: &mut [Eight<i16>],
    cost: impl Fn([&Eight<Descriptor>; 4]) -> Eight<i16>,
) {
    for ((costs, (a, b)), (c, d)) in costs.iter_mut().zip(a.iter().zip(b)).zip(c.iter().zip(d)) {
        *costs = cost([a, b, c, d]);
    }
}

/// Runs work with the instructions that there are.
#[cfg_attr(
    any(
        all(target_arch = "x86_64", target_feature = "sse2"),
        all(target_arch = "aarch64", target_feature = "neon", target_endian = "little")
    ),
    expect(unsafe_code, reason = "calls code compiled for what the processor has")
)]
pub(crate) fn compare(vectors: Vectors, work: impl Comparison) {
    match vectors.level() {
        Level::Plain => work.run(&PLAIN),
        #[cfg(dynvox_dsp)]
        Level::Dsp => work.run(&dsp::KERNELS),
        // SAFETY: all of the target's machines have SSE2.
        #[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
        Level::Sse2 => unsafe { x86::with_sse2(work) },
        // SAFETY: this level exists only where the processor says that it has AVX2.
        #[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
        Level::Avx2 => unsafe { x86::with_avx2(work) },
        // SAFETY: this level exists only for targets whose machines all have it.
        #[cfg(all(target_arch = "aarch64", target_feature = "neon", target_endian = "little"))]
        Level::Neon => unsafe { aarch64::with_neon(work) },
    }
}

#[cfg(all(target_arch = "aarch64", target_feature = "neon", target_endian = "little"))]
mod aarch64;
#[cfg(dynvox_dsp)]
mod dsp;
mod scalar;
#[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
mod x86;

use scalar::PLAIN;

#[cfg(test)]
mod tests;
