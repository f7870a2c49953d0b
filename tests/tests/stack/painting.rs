//! The stack that a piece of work takes, measured by painting what lies below it.

use std::hint::black_box;

/// Bytes below a frame that are painted.
const PAINTED: usize = 512 * 1024;
/// Not painted: what the painter itself stands on.
const MARGIN: usize = 1024;
const PAINT: u8 = 0xA5;

/// Returns the approximate end of the caller's stack.
#[inline(never)]
fn stack_pointer() -> *mut u8 {
    let mut here = 0u8;
    black_box(&raw mut here)
}

#[inline(never)]
fn paint() {
    let top = stack_pointer();
    for below in MARGIN..PAINTED {
        // SAFETY: the thread's stack is 4 MiB; these bytes lie below every live frame and above the
        // guard page.
        unsafe { top.wrapping_sub(below).write_volatile(PAINT) };
    }
}

/// Bytes below this frame that are no longer painted.
#[inline(never)]
fn used() -> usize {
    let top = stack_pointer();
    // This frame may begin a little below the painter's.
    let deepest = PAINTED - MARGIN;
    // SAFETY: as in `paint`; the bytes were written there.
    let kept = (MARGIN..deepest)
        .rev()
        .take_while(|&below| unsafe { top.wrapping_sub(below).read_volatile() } == PAINT)
        .count();
    deepest - kept
}

/// Returns the result of `work`, run in its caller's frame, and the stack it took below that.
#[inline(never)]
pub fn painted<R>(work: impl FnOnce() -> R) -> (R, usize) {
    paint();
    let result = work();
    (result, used())
}
