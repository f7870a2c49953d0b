//! Kernels for Arm cores without vectors but with the DSP extension: Cortex-M4, M7, and M33 where
//! it was chosen.
//!
//! One instruction adds four absolute differences of bytes to a sum. The standard library's
//! function for it is unstable, hence the assembly.
#![expect(unsafe_code, reason = "one instruction; docs/decisions/0085-the-dsp-extension.md")]

use super::{
    Descriptor,
    scalar::{Distance, OneByOne},
};
use core::arch::asm;

/// Kernels by that instruction.
pub(super) const KERNELS: OneByOne<Quads> = OneByOne(Quads);

/// Distances of four bytes at a time.
pub(super) struct Quads;

impl Distance for Quads {
    #[inline(always)]
    fn distance(&self, a: &Descriptor, b: &Descriptor) -> u32 {
        let ([a, b, c, d], [e, f, g, h]): ([u32; 4], [u32; 4]) =
            (bytemuck::cast(*a), bytemuck::cast(*b));
        // One sum throughout: the processor adds and accumulates in one instruction.
        added(d, h, added(c, g, added(b, f, first(a, e))))
    }
}

/// Sum of absolute differences of four bytes.
#[inline(always)]
fn first(a: u32, b: u32) -> u32 {
    let sum;
    // SAFETY: the target's processors have the instruction (build.rs). It reads and writes the
    // registers named, and nothing else.
    unsafe {
        asm!(
            "usad8 {sum}, {a}, {b}",
            sum = lateout(reg) sum,
            a = in(reg) a,
            b = in(reg) b,
            options(pure, nomem, nostack, preserves_flags)
        );
    }
    sum
}

/// Adds the absolute differences of four bytes to a sum.
#[inline(always)]
fn added(a: u32, b: u32, before: u32) -> u32 {
    let sum;
    // SAFETY: as above.
    unsafe {
        asm!(
            "usada8 {sum}, {a}, {b}, {before}",
            sum = lateout(reg) sum,
            a = in(reg) a,
            b = in(reg) b,
            before = in(reg) before,
            options(pure, nomem, nostack, preserves_flags)
        );
    }
    sum
}
