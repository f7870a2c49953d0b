//! P1: a step on one thread stays within 32 KiB of stack, measured by painting it.
#![expect(unsafe_code, reason = "the stack below a frame can only be written to through a pointer")]

use dynvox_core::{Capacity, Serial};
use dynvox_tests::Clip;
use std::thread;

const PAINTED: usize = 512 * 1024;
/// Not painted: what the painter itself stands on.
const MARGIN: usize = 1024;
const PAINT: u8 = 0xA5;

/// Where the caller's stack ends now, roughly.
#[inline(never)]
fn stack_pointer() -> *mut u8 {
    let mut here = 0u8;
    std::hint::black_box(&raw mut here)
}

#[inline(never)]
fn paint() {
    let top = stack_pointer();
    for below in MARGIN..PAINTED {
        // SAFETY: the thread's stack is 4 MiB; these bytes lie below every live frame and above the guard page.
        unsafe { top.wrapping_sub(below).write_volatile(PAINT) };
    }
}

/// Bytes below this frame that are no longer painted.
#[inline(never)]
fn used() -> usize {
    let top = stack_pointer();
    // SAFETY: as in `paint`; the bytes were written there.
    let kept = (MARGIN..PAINTED).rev().take_while(|&below| unsafe { top.wrapping_sub(below).read_volatile() } == PAINT).count();
    PAINTED - kept
}

#[test]
fn a_step_stays_within_32_kib_of_stack() {
    let clip = Clip::street(320, 96, 12);
    let peak = thread::Builder::new()
        .stack_size(4 << 20)
        .spawn(move || {
            clip.with_mapper(&Capacity::TINY, |mapper| {
                let mut peak = 0;
                for frame in clip.stereo() {
                    paint();
                    let report = mapper.step(&frame, &Serial);
                    peak = peak.max(used());
                    assert!(report.is_ok());
                }
                peak
            })
        })
        .expect("a thread")
        .join()
        .expect("no panic");
    println!("stack of a step: {peak} bytes at most");
    assert!(peak > 1_000, "the paint shows something");
    assert!(peak <= 32 * 1024, "{peak} bytes");
}
