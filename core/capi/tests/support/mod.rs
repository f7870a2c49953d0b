//! A small mapper in a buffer of a test's.
#![allow(dead_code, reason = "each file of tests uses a part")]

use dynvox_capi::*;
use std::{
    ffi::{CStr, c_void},
    ptr,
};

pub const WIDTH: usize = 160;
pub const HEIGHT: usize = 64;

/// A buffer aligned as a mapper wants it, and a mapper's size.
pub struct Buffer {
    bytes: Vec<u8>,
    start: usize,
    pub len: usize,
}

impl Buffer {
    pub fn new() -> Self {
        Self::holding(&capacity())
    }

    pub fn holding(capacity: &DynvoxCapacity) -> Self {
        let mut len = 0;
        assert_eq!(unsafe { dynvox_bytes(capacity, &raw mut len) }, DynvoxStatus::Ok);
        let bytes = vec![0xAA; len + 2 * dynvox_alignment()];
        let start = bytes.as_ptr().align_offset(dynvox_alignment());
        Self { bytes, start, len }
    }

    pub fn at(&mut self, offset: usize) -> *mut u8 {
        self.bytes[self.start + offset..].as_mut_ptr()
    }
}

pub fn capacity() -> DynvoxCapacity {
    let mut capacity = unsafe { std::mem::zeroed() };
    assert_eq!(
        unsafe { dynvox_capacity_of_profile(DYNVOX_PROFILE_TINY, &raw mut capacity) },
        DynvoxStatus::Ok
    );
    capacity
}

pub fn set(config: &mut DynvoxConfig, key: &CStr, value: &CStr) -> DynvoxStatus {
    unsafe { dynvox_config_set(config, key.as_ptr(), value.as_ptr()) }
}

pub fn config() -> DynvoxConfig {
    let rig = DynvoxRig { focal_px: 100.0, center_u_px: 80.0, center_v_px: 32.0, baseline_m: 0.5 };
    let mut config = unsafe { std::mem::zeroed() };
    assert_eq!(unsafe { dynvox_config_default(&raw const rig, &raw mut config) }, DynvoxStatus::Ok);
    assert_eq!(set(&mut config, c"volume.voxel_size_m", c"0.1"), DynvoxStatus::Ok);
    config
}

pub fn create(
    buffer: &mut Buffer,
    config: &DynvoxConfig,
) -> Result<*mut DynvoxMapper, DynvoxStatus> {
    let (len, mut mapper) = (buffer.len, ptr::null_mut());
    let capacity = capacity();
    match unsafe { dynvox_create(&raw const capacity, config, buffer.at(0), len, &raw mut mapper) }
    {
        DynvoxStatus::Ok => Ok(mapper),
        status => Err(status),
    }
}

pub fn pixels() -> Vec<u8> {
    (0..WIDTH * HEIGHT)
        .map(|i| (i as u32).wrapping_mul(2_654_435_761).rotate_left(9) as u8)
        .collect()
}

pub fn frame(pixels: &[u8]) -> DynvoxFrame {
    let image = DynvoxImage { pixels: pixels.as_ptr(), stride: WIDTH };
    DynvoxFrame {
        width: WIDTH,
        height: HEIGHT,
        left: image,
        right: image,
        colour: DynvoxImage { pixels: ptr::null(), stride: 0 },
        detections: ptr::null(),
        detection_count: 0,
        t_world_camera: ptr::null(),
        time_ns: ptr::null(),
        disparity_q8: ptr::null(),
        inertial: ptr::null(),
        inertial_count: 0,
        layout: DYNVOX_SAMPLES_BYTES,
        ignored: DynvoxImage { pixels: ptr::null(), stride: 0 },
    }
}

pub fn step(mapper: *mut DynvoxMapper, frame: &DynvoxFrame) -> DynvoxStatus {
    unsafe { dynvox_step(mapper, frame, ptr::null(), ptr::null_mut()) }
}

pub extern "C" fn write(context: *mut c_void, bytes: *const u8, len: usize) -> bool {
    // SAFETY: the context is the test's snapshot, and there are as many bytes as the header
    // promises.
    unsafe {
        (*context.cast::<Vec<u8>>()).extend_from_slice(std::slice::from_raw_parts(bytes, len))
    };
    true
}

pub extern "C" fn read(context: *mut c_void, bytes: *mut u8, len: usize) -> bool {
    // SAFETY: the context is the test's rest of a snapshot, and there is space for as many bytes as
    // the header promises.
    unsafe {
        let rest = &mut *context.cast::<&[u8]>();
        let Some((front, behind)) = rest.split_at_checked(len) else { return false };
        std::slice::from_raw_parts_mut(bytes, len).copy_from_slice(front);
        *rest = behind;
    }
    true
}
