//! A mapper in two buffers of its caller's: a fast one on the chip, and a large one outside.

use crate::{
    DynvoxCapacity, DynvoxConfig, DynvoxMapper, DynvoxRead, DynvoxStatus,
    capacity::given,
    given::{output, read},
    handle::{HEAD_BYTES, Memory, Order, make, new_mapper},
    snapshot::restore,
};
use core::ffi::c_void;

/// Memory of two kinds for one mapper; both buffers begin at a multiple of dynvox_alignment(), and
/// they do not overlap.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxTwoBuffers {
    /// Fast memory, for what each frame works on.
    pub hot: *mut u8,
    /// Bytes of `hot`.
    pub hot_len: usize,
    /// Large memory, for the map.
    pub cold: *mut u8,
    /// Bytes of `cold`.
    pub cold_len: usize,
}

impl DynvoxTwoBuffers {
    const fn memory(self) -> Memory {
        Memory { buffer: self.hot, len: self.hot_len, cold: Some((self.cold, self.cold_len)) }
    }
}

/// Writes how many bytes of two buffers a mapper of that capacity takes.
///
/// # Safety
/// `capacity` is null or points to a capacity, `hot` and `cold` are null or point to a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_bytes_in_two(
    capacity: *const DynvoxCapacity,
    hot: *mut usize,
    cold: *mut usize,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    match unsafe { (given(capacity), output(hot), output(cold)) } {
        (Ok(capacity), Ok(hot), Ok(cold)) => {
            // SAFETY: checked; of the right type by the caller's promise.
            unsafe {
                hot.write(HEAD_BYTES + capacity.hot_bytes());
                cold.write(capacity.cold_bytes());
            }
            DynvoxStatus::Ok
        }
        (Err(status), ..) | (_, Err(status), _) | (_, _, Err(status)) => status,
    }
}

/// Makes a mapper like dynvox_create in two buffers, with the same results. Both are the mapper's
/// until dynvox_destroy.
///
/// # Safety
/// `capacity` is null or points to a capacity, `config` is null or points to a configuration,
/// `buffers` is null or points to two buffers that are as long as it says and used by nothing else,
/// `mapper` is null or points to a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_create_in_two(
    capacity: *const DynvoxCapacity,
    config: *const DynvoxConfig,
    buffers: *const DynvoxTwoBuffers,
    mapper: *mut *mut DynvoxMapper,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        match read(buffers) {
            Ok(two) => make(Order { capacity, config, memory: two.memory(), mapper }, new_mapper),
            Err(status) => status,
        }
    }
}

/// Restores a mapper like dynvox_restore in two buffers, wherever the saved one lay.
///
/// # Safety
/// `capacity` is null or points to a capacity, `config` is null or points to a configuration,
/// `buffers` is null or points to two buffers that are as long as it says and used by nothing else,
/// `mapper` is null or points to a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_restore_in_two(
    capacity: *const DynvoxCapacity,
    config: *const DynvoxConfig,
    buffers: *const DynvoxTwoBuffers,
    source: DynvoxRead,
    context: *mut c_void,
    mapper: *mut *mut DynvoxMapper,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        match read(buffers) {
            Ok(two) => {
                restore(Order { capacity, config, memory: two.memory(), mapper }, source, context)
            }
            Err(status) => status,
        }
    }
}
