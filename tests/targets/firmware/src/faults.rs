//! Faults put in on purpose, to see that the proofs notice them.

use core::hint::black_box;

/// A panic, a recursion and a big frame.
pub fn all(seed: usize) -> u64 {
    // Unknown, so that each fault is possible and none certain.
    let seed = black_box(seed);
    #[cfg(feature = "heap_fault")]
    let seed = seed + allocation(seed);
    u64::from(panic(seed)) + recursion(seed) + frame(seed)
}

#[inline(never)]
fn panic(seed: usize) -> u8 {
    let table = black_box([1, 2, 3]);
    table[seed]
}

// Nothing but a call will do: the compiler makes loops of calls whose results it can add up.
#[inline(never)]
fn recursion(seed: usize) -> u64 {
    if seed == 0 { 1 } else { black_box(recursion(black_box(seed) / 2)) + 1 }
}

#[inline(never)]
fn frame(seed: usize) -> u64 {
    let mut frame = [0u8; 100_000];
    black_box(&mut frame);
    frame.get(seed).copied().map_or(0, u64::from)
}

/// An allocation.
#[cfg(feature = "heap_fault")]
#[inline(never)]
fn allocation(seed: usize) -> usize {
    extern crate alloc;
    *black_box(alloc::boxed::Box::new(seed))
}
