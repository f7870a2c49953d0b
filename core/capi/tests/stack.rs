//! What the header says of the stack is measured, by painting it.
#![allow(missing_docs, clippy::unwrap_used, clippy::indexing_slicing)]
#![expect(
    clippy::undocumented_unsafe_blocks,
    reason = "each call keeps the header's promises; the stack is written below every live frame"
)]

#[path = "../../../tests/tests/stack/painting.rs"]
mod painting;

use dynvox_capi::*;
use painting::painted;
use std::{ffi::c_void, ptr, thread};

/// The header's bound for making, restoring, stepping and saving.
const BOUND: usize = 40 * 1024;

extern "C" fn write(context: *mut c_void, bytes: *const u8, len: usize) -> bool {
    unsafe {
        (*context.cast::<Vec<u8>>()).extend_from_slice(std::slice::from_raw_parts(bytes, len))
    };
    true
}

extern "C" fn read(context: *mut c_void, bytes: *mut u8, len: usize) -> bool {
    unsafe {
        let rest = &mut *context.cast::<&[u8]>();
        let (front, behind) = rest.split_at(len);
        bytes.copy_from_nonoverlapping(front.as_ptr(), len);
        *rest = behind;
    }
    true
}

fn measured() -> Vec<(&'static str, usize)> {
    let (width, height) = (1242, 375);
    let (mut capacity, mut config) =
        unsafe { (std::mem::zeroed::<DynvoxCapacity>(), std::mem::zeroed::<DynvoxConfig>()) };
    let rig =
        DynvoxRig { focal_px: 700.0, center_u_px: 620.0, center_v_px: 187.0, baseline_m: 0.54 };
    let budget = DynvoxBudget { bytes: 96 << 20, width, height, ..unsafe { std::mem::zeroed() } };
    let mut len = 0;
    unsafe {
        assert_eq!(dynvox_config_default(&raw const rig, &raw mut config), DynvoxStatus::Ok);
        assert_eq!(
            dynvox_capacity_for_budget(&raw const budget, &raw mut capacity, ptr::null_mut()),
            DynvoxStatus::Ok
        );
        assert_eq!(dynvox_bytes(&raw const capacity, &raw mut len), DynvoxStatus::Ok);
    }
    let mut bytes = vec![0xAAu8; len + dynvox_alignment()];
    let start = bytes.as_ptr().align_offset(dynvox_alignment());
    let buffer = bytes[start..].as_mut_ptr();
    let left: Vec<u8> = (0..width * height)
        .map(|at| (((at % width / 3 * 40_503) ^ (at / width / 3 * 30_011)) >> 4) as u8)
        .collect();
    let mut right = left.clone();
    right.rotate_left(20);
    let image = |pixels: &[u8]| DynvoxImage { pixels: pixels.as_ptr(), stride: width };
    let frame = DynvoxFrame {
        width,
        height,
        left: image(&left),
        right: image(&right),
        ..unsafe { std::mem::zeroed() }
    };
    let mut mapper = ptr::null_mut();
    let mut peaks = Vec::new();
    let mut note = |what, (status, peak): (DynvoxStatus, usize)| {
        assert_eq!(status, DynvoxStatus::Ok, "{what}");
        peaks.push((what, peak));
    };
    let (given, settings) = (&raw const capacity, &raw const config);
    note(
        "dynvox_create",
        painted(|| unsafe { dynvox_create(given, settings, buffer, len, &raw mut mapper) }),
    );
    for _ in 0..3 {
        let step =
            || unsafe { dynvox_step(mapper, &raw const frame, ptr::null(), ptr::null_mut()) };
        note("dynvox_step", painted(step));
    }
    let mut snapshot: Vec<u8> = Vec::with_capacity(len);
    let context = (&raw mut snapshot).cast();
    note("dynvox_save", painted(|| unsafe { dynvox_save(mapper, Some(write), context) }));
    let mut rest = &snapshot[..];
    let context = (&raw mut rest).cast();
    let restore = || unsafe {
        dynvox_restore(given, settings, buffer, len, Some(read), context, &raw mut mapper)
    };
    note("dynvox_restore", painted(restore));
    peaks
}

#[dynvox_needs::long]
#[test]
fn every_call_takes_less_than_40_kib_of_stack() {
    let peaks = thread::Builder::new().stack_size(4 << 20).spawn(measured).unwrap().join().unwrap();
    println!("stack, bytes at most: {peaks:?}");
    for (call, peak) in peaks {
        assert!(peak > 1_000, "{call}: the paint shows something");
        assert!(peak < BOUND, "{call}: {peak} bytes");
    }
}
