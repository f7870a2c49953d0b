//! P1: making a mapper, a step on one thread, saving and restoring each stay within 32 KiB of
//! stack, measured by painting it.
#![expect(unsafe_code, reason = "the stack below a frame can only be written to through a pointer")]

use dynvox::input::InstanceMask;
use dynvox_core::{Capacity, Mapper, Serial, StereoFrame};
use dynvox_tests::{Clip, HeapSlab};
use std::{convert::Infallible, hint::black_box, thread};

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
fn painted<R>(work: impl FnOnce() -> R) -> (R, usize) {
    paint();
    let result = work();
    (result, used())
}

#[test]
fn a_mapper_and_its_step_stay_within_32_kib_of_stack() {
    let measured = || {
        // A thread of its own, so that the stack is painted from a known depth.
        let clip = Clip::street(320, 96, 12);
        let mut slab = HeapSlab::of(&Capacity::TINY);
        let config = clip.config();
        let (mut made, making) = painted(|| Mapper::new(&Capacity::TINY, &config, slab.bytes()));
        let mapper = made.as_mut().expect("a slab that fits");
        let mut step = 0;
        // With detections, so that objects take their share.
        for (frame, seen) in clip.stereo().zip(clip.sightings()) {
            let detections: Vec<_> = seen.iter().map(InstanceMask::detection).collect();
            let (report, bytes) =
                painted(|| mapper.step(&StereoFrame { detections: &detections, ..frame }, &Serial));
            assert!(report.is_ok());
            step = step.max(bytes);
        }
        assert!(mapper.objects().next().is_some(), "cars have maps of their own");
        let mut snapshot = Vec::with_capacity(8 << 20);
        let mut sink = |bytes: &[u8]| -> Result<(), Infallible> {
            snapshot.extend_from_slice(bytes);
            Ok(())
        };
        let (_, saving) = painted(|| mapper.save(&mut sink));
        drop(made);
        let mut rest = &snapshot[..];
        let mut source = |bytes: &mut [u8]| -> Result<(), Infallible> {
            bytes.copy_from_slice(rest.split_off(..bytes.len()).expect("as many as were saved"));
            Ok(())
        };
        let (restored, restoring) =
            painted(|| Mapper::restore(&Capacity::TINY, &config, slab.bytes(), &mut source));
        assert!(restored.is_ok());
        [("making", making), ("a step", step), ("saving", saving), ("restoring", restoring)]
    };
    let peaks = thread::Builder::new()
        .stack_size(4 << 20)
        .spawn(measured)
        .expect("a thread")
        .join()
        .expect("no panic");
    println!("stack, bytes at most: {peaks:?}; the mapper itself: {}", size_of::<Mapper<'_>>());
    // Zero would mean that the paint was not read.
    for (what, peak) in peaks {
        assert!(peak > 1_000, "{what}: the paint shows something");
        assert!(peak <= 32 * 1024, "{what}: {peak} bytes");
    }
}
