//! P1: making a mapper, a step on one thread, saving and restoring each stay within 32 KiB of
//! stack, measured by painting it.
#![expect(unsafe_code, reason = "the stack below a frame can only be written to through a pointer")]

#[path = "stack/painting.rs"]
mod painting;

use dynvox::input::InstanceMask;
use dynvox_core::{Capacity, Mapper, Serial, StereoFrame};
use dynvox_tests::{Clip, HeapSlab};
use painting::painted;
use std::{convert::Infallible, thread};

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
