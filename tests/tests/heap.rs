//! P1: after construction the core never asks for memory.
#![expect(unsafe_code, reason = "a global allocator cannot be written without")]

use dynvox_core::{Capacity, Serial};
use dynvox_tests::Clip;
use std::{
    alloc::{GlobalAlloc, Layout, System},
    sync::atomic::{AtomicUsize, Ordering},
};

/// The system's allocator, counting.
struct Counting;

static CALLS: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is passed on unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        CALLS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        CALLS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn a_hundred_steps_a_look_and_a_mesh_make_no_heap_call() {
    let clip = Clip::street(320, 96, 100);
    let (calls, steps, pixels, triangles) = clip.with_mapper(&Capacity::TINY, |mapper| {
        let before = CALLS.load(Ordering::Relaxed);
        let (mut steps, mut pose) = (0, None);
        for frame in clip.stereo() {
            pose = mapper.step(&frame, &Serial).ok().map(|report| report.t_world_camera);
            steps += u32::from(pose.is_some());
        }
        mapper.finish();
        let pixels =
            pose.and_then(|pose| mapper.raycast(&pose, &Serial).ok()).map_or(0, |view| view.depth_m().map_or(0, |depth| depth.height()));
        let triangles = mapper.triangles(&mut |_| ());
        (CALLS.load(Ordering::Relaxed) - before, steps, pixels, triangles)
    });
    assert_eq!((calls, steps, pixels), (0, 100, 96));
    assert!(triangles > 1_000, "and yet there is a map");
}
