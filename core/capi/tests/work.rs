//! Work of steps through C: counted, and never above the bound.
#![allow(missing_docs, clippy::unwrap_used, clippy::indexing_slicing)]
#![expect(clippy::undocumented_unsafe_blocks, reason = "each call keeps the header's promises")]

mod support;

use dynvox_capi::*;
use std::ptr;
use support::*;

fn bound(config: &DynvoxConfig) -> Result<DynvoxWork, DynvoxStatus> {
    let (capacity, mut bound) = (capacity(), unsafe { std::mem::zeroed() });
    match unsafe { dynvox_work_bound(&raw const capacity, config, &raw mut bound) } {
        DynvoxStatus::Ok => Ok(bound),
        status => Err(status),
    }
}

/// Report of the last of some frames of a pair with a disparity of 8 px.
fn stepped(config: &DynvoxConfig, frames: usize) -> DynvoxReport {
    let mut buffer = Buffer::new();
    let mapper = create(&mut buffer, config).unwrap();
    let (left, mut right) = (pixels(), pixels());
    right.rotate_left(8);
    let mut given = frame(&left);
    given.right.pixels = right.as_ptr();
    let mut report: DynvoxReport = unsafe { std::mem::zeroed() };
    for _ in 0..frames {
        let status = unsafe { dynvox_step(mapper, &raw const given, ptr::null(), &raw mut report) };
        assert_eq!(status, DynvoxStatus::Ok);
    }
    report
}

#[test]
fn a_steps_work_is_counted_and_lies_within_the_bound() {
    let config = config();
    let most = bound(&config).unwrap();
    let report = stepped(&config, 3);
    let done = report.work;
    assert_eq!(done.stereo_pixels, (WIDTH * HEIGHT) as u64);
    let pairs = [
        [done.stereo_pixels, most.stereo_pixels],
        [done.support_candidates, most.support_candidates],
        [done.triangles, most.triangles],
        [done.features, most.features],
        [done.compared_descriptors, most.compared_descriptors],
        [done.block_requests, most.block_requests],
        [done.fused_voxels, most.fused_voxels],
    ];
    for (at, [done, most]) in pairs.into_iter().enumerate() {
        assert!(done > 0 && done <= most, "unit {at}: {done} of {most}");
    }
    assert!(!report.world_moved, "no loop is closed");
}

#[test]
fn a_budget_of_work_defers_what_is_far_and_says_so() {
    let mut config = config();
    let most = bound(&config).unwrap();
    assert_eq!(set(&mut config, c"mapper.work_budget", c"0.05"), DynvoxStatus::Ok);
    let report = stepped(&config, 1);
    assert!(report.fused_blocks_deferred > 0, "{report:?}");
    let rows = report.work.stereo_pixels;
    assert!(rows > 0 && 20 * rows <= most.stereo_pixels, "{report:?}");
    assert_eq!(
        unsafe { dynvox_work_bound(ptr::null(), ptr::null(), ptr::null_mut()) },
        DynvoxStatus::Null
    );
}
