//! P1: after construction the core never asks for memory.
#![expect(unsafe_code, reason = "a global allocator cannot be written without")]

use dynvox::input::InstanceMask;
use dynvox_core::{Capacity, Serial, StereoFrame, objects::NoSink, volume::NoStore};
use dynvox_tests::Clip;
use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
};

/// The system's allocator, counting each thread's calls: tests run beside one another.
struct Counting;

thread_local! {
    static CALLS: Cell<usize> = const { Cell::new(0) };
}

/// Calls made by this thread.
fn calls() -> usize {
    CALLS.with(Cell::get)
}

fn count() {
    CALLS.with(|calls| calls.set(calls.get() + 1));
}

// SAFETY: every call is passed on unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count();
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn a_hundred_steps_a_look_and_a_mesh_make_no_heap_call() {
    // Forwards and backwards, for rendering takes longer than mapping.
    let clip = Clip::street(320, 96, 10);
    let there: Vec<StereoFrame<'_>> = clip.stereo().collect();
    let (calls, steps, pixels, triangles) = clip.with_mapper(&Capacity::TINY, |mapper| {
        let before = calls();
        let (mut steps, mut pose) = (0, None);
        for frame in (0..5).flat_map(|_| there.iter().chain(there.iter().rev())) {
            pose = mapper.step(frame, &Serial).ok().map(|report| report.t_world_camera);
            steps += u32::from(pose.is_some());
        }
        mapper.finish();
        let pixels = pose
            .and_then(|pose| mapper.raycast(&pose, &Serial).ok())
            .map_or(0, |view| view.depth_m().map_or(0, |depth| depth.height()));
        let triangles = mapper.triangles(&mut |_| ());
        (calls() - before, steps, pixels, triangles)
    });
    assert_eq!((calls, steps, pixels), (0, 100, 96));
    assert!(triangles > 1_000, "and yet there is a map");
}

#[test]
fn detections_objects_and_a_look_at_them_make_no_heap_call() {
    let clip = Clip::street(480, 144, 12);
    let sightings = clip.sightings();
    let detections: Vec<Vec<_>> =
        sightings.iter().map(|seen| seen.iter().map(InstanceMask::detection).collect()).collect();
    let (calls, objects, shown, handed) = clip.with_mapper(&Capacity::SMALL, |mapper| {
        // The counter runs over all steps, pictures included.
        let before = calls();
        let (mut objects, mut shown) = (0, 0);
        for (frame, detections) in clip.stereo().zip(&detections) {
            let frame = StereoFrame { detections, ..frame };
            let Ok(report) = mapper.step_with(&frame, &Serial, &mut NoStore, &mut NoSink) else {
                continue;
            };
            objects += report.objects.fused;
            shown += mapper
                .raycast_composed(&report.t_world_camera, &Serial)
                .map_or(0, |seen| seen.layer().map_or(0, |image| image.height()));
        }
        let handed = mapper.objects().count();
        mapper.finish_with(&mut NoSink);
        (calls() - before, objects, shown, handed)
    });
    assert_eq!((calls, shown), (0, 12 * 144));
    // Without objects the test would prove nothing.
    assert!(
        objects > 10 && handed > 0,
        "and yet there are objects: {objects} fused, {handed} at the end"
    );
}
