//! Vector instructions that kernels may use: told to the core by its caller, never a reason for
//! another bit.
//!
//! A value of [`Vectors`] above [`Vectors::BASELINE`] exists only where the processor was asked, so
//! that a kernel may rely on it (docs/decisions/0023-vector-kernels.md).

/// Vector instructions that a machine has.
///
/// ```
/// use dynvox_core::parallel::Vectors;
///
/// println!("kernels for {}", Vectors::detect().name());
/// assert!(Vectors::available().any(|vectors| vectors == Vectors::detect()));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Vectors(Level);

/// Ordinary code whose loops compilers turn into vectors: compiled once for each level that
/// compilers can write for.
///
/// [`Work::run`] is `#[inline(always)]`, and so is every function that one of its loops is in: what is called and not inlined keeps to
/// the target's baseline. No level multiplies and adds in one instruction, so that none gives
/// another bit.
pub(crate) trait Work {
    type Output;

    fn run(self) -> Self::Output;
}

/// Levels of vector instructions that kernels are written for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    /// No explicit instructions: only those that the compiler finds.
    Plain,
    /// 128 bits: every x86-64 has them, but some kernels of operating systems must not use them.
    #[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
    Sse2,
    /// Four bytes in a register, of Arm's DSP extension.
    #[cfg(dynvox_dsp)]
    Dsp,
    /// 256 bits.
    #[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
    Avx2,
    /// 128 bits of 64-bit Arm.
    #[cfg(all(target_arch = "aarch64", target_feature = "neon", target_endian = "little"))]
    Neon,
}

impl Vectors {
    /// Ordinary code alone.
    pub const PLAIN: Self = Self(Level::Plain);
    /// Vectors that every machine of the target has.
    #[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
    pub const BASELINE: Self = Self(Level::Sse2);
    /// Vectors that every machine of the target has.
    #[cfg(all(target_arch = "aarch64", target_feature = "neon", target_endian = "little"))]
    pub const BASELINE: Self = Self(Level::Neon);
    /// Vectors that every machine of the target has.
    #[cfg(dynvox_dsp)]
    pub const BASELINE: Self = Self(Level::Dsp);
    /// Vectors that every machine of the target has.
    #[cfg(not(any(
        dynvox_dsp,
        all(target_arch = "x86_64", target_feature = "sse2"),
        all(target_arch = "aarch64", target_feature = "neon", target_endian = "little")
    )))]
    pub const BASELINE: Self = Self::PLAIN;

    /// The most this machine has: asks the processor, on x86-64.
    ///
    /// ```
    /// use dynvox_core::parallel::Vectors;
    ///
    /// // All kinds give the same bits; the caller chooses once, at start.
    /// assert!(Vectors::available().any(|vectors| vectors == Vectors::detect()));
    /// ```
    pub fn detect() -> Self {
        #[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
        if x86::has_avx2() {
            return Self(Level::Avx2);
        }
        Self::BASELINE
    }

    /// Every level that this machine has, each once: what a comparison of kernels runs.
    pub fn available() -> impl Iterator<Item = Self> {
        let [plain, baseline, most] = [Self::PLAIN, Self::BASELINE, Self::detect()];
        [Some(plain), (baseline != plain).then_some(baseline), (most != baseline).then_some(most)]
            .into_iter()
            .flatten()
    }

    /// Runs work compiled for these vectors.
    #[cfg_attr(
        all(target_arch = "x86_64", target_feature = "sse2"),
        expect(
            unsafe_code,
            reason = "calls code compiled for what the processor has; \
                      docs/decisions/0023-vector-kernels.md"
        )
    )]
    pub(crate) fn run<W: Work>(self, work: W) -> W::Output {
        match self.0 {
            // SAFETY: this level exists only where the processor says that it has AVX2.
            #[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
            Level::Avx2 => unsafe { x86::with_avx2(work) },
            // Ordinary code is compiled for what every machine of the target has.
            _ => work.run(),
        }
    }

    /// Name in tables.
    pub const fn name(self) -> &'static str {
        match self.0 {
            Level::Plain => "plain",
            #[cfg(dynvox_dsp)]
            Level::Dsp => "DSP",
            #[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
            Level::Sse2 => "SSE2",
            #[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
            Level::Avx2 => "AVX2",
            #[cfg(all(target_arch = "aarch64", target_feature = "neon", target_endian = "little"))]
            Level::Neon => "NEON",
        }
    }

    pub(crate) const fn level(self) -> Level {
        self.0
    }
}

#[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
#[expect(
    unsafe_code,
    reason = "asks for the processor's state; docs/decisions/0023-vector-kernels.md"
)]
mod x86 {
    use core::arch::x86_64::{__cpuid, __cpuid_count, _xgetbv};

    /// Returns true if processor and operating system have AVX2.
    pub fn has_avx2() -> bool {
        const OSXSAVE: u32 = 1 << 27;
        const AVX2: u32 = 1 << 5;
        /// The operating system saves SSE and AVX registers.
        const SAVED: u64 = 0b110;
        let known = __cpuid(0).eax >= 7
            && __cpuid(1).ecx & OSXSAVE != 0
            && __cpuid_count(7, 0).ebx & AVX2 != 0;
        // SAFETY: XGETBV exists where OSXSAVE is set.
        known && unsafe { saved_state() } & SAVED == SAVED
    }

    /// Runs work with 256 bits.
    #[target_feature(enable = "avx2")]
    pub fn with_avx2<W: super::Work>(work: W) -> W::Output {
        work.run()
    }

    #[target_feature(enable = "xsave")]
    fn saved_state() -> u64 {
        // SAFETY: register 0 exists wherever XGETBV does.
        unsafe { _xgetbv(0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn what_is_available_begins_plain_ends_with_the_most_and_repeats_nothing() {
        let available: Vec<_> = Vectors::available().collect();
        assert_eq!(available.first(), Some(&Vectors::PLAIN));
        assert_eq!(available.last(), Some(&Vectors::detect()));
        assert!(available.windows(2).all(|pair| pair[0] != pair[1]));
    }

    #[cfg(all(target_arch = "x86_64", target_feature = "sse2"))]
    #[test]
    fn the_processor_is_asked_as_the_standard_library_asks_it() {
        assert_eq!(
            Vectors::detect() == Vectors(Level::Avx2),
            std::is_x86_feature_detected!("avx2")
        );
    }
}
