//! Saving a mapper and restoring it.

use crate::{
    DynvoxCapacity, DynvoxConfig, DynvoxMapper, DynvoxStatus,
    handle::{Memory, Order, make, with},
};
use core::ffi::c_void;
use dynvox_core::{Mapper, RestoreError};

/// Takes the next bytes of a snapshot; false when it cannot. Must not call the same mapper.
pub type DynvoxWrite =
    Option<extern "C" fn(context: *mut c_void, bytes: *const u8, len: usize) -> bool>;

/// Fills `bytes` with the next `len` bytes of a snapshot; false when there are not as many.
pub type DynvoxRead =
    Option<extern "C" fn(context: *mut c_void, bytes: *mut u8, len: usize) -> bool>;

/// Writes the whole state of a mapper, but for blocks that a store holds. The mapper continues as
/// before. DYNVOX_STATUS_CALLBACK when `write` refused.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_save(
    mapper: *mut DynvoxMapper,
    write: DynvoxWrite,
    context: *mut c_void,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, _| {
            let write = write.ok_or(DynvoxStatus::Null)?;
            mapper.save(&mut |bytes: &[u8]| {
                if write(context, bytes.as_ptr(), bytes.len()) {
                    Ok(())
                } else {
                    Err(DynvoxStatus::Callback)
                }
            })
        })
    }
}

/// Creates a mapper like dynvox_create, in the state in which dynvox_save was called: capacity and
/// configuration must be those of the saved one. From a damaged or foreign snapshot
/// (DYNVOX_STATUS_SNAPSHOT), or when `read` refused (DYNVOX_STATUS_CALLBACK), no mapper is made;
/// then `mapper` is as it was, and the buffer holds no mapper at all: one that lived there has
/// ended, and its handle answers DYNVOX_STATUS_NO_MAPPER.
///
/// # Safety
/// As dynvox_create.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_restore(
    capacity: *const DynvoxCapacity,
    config: *const DynvoxConfig,
    buffer: *mut u8,
    len: usize,
    read: DynvoxRead,
    context: *mut c_void,
    mapper: *mut *mut DynvoxMapper,
) -> DynvoxStatus {
    let memory = Memory { buffer, len, cold: None };
    // SAFETY: the caller's promise.
    unsafe { restore(Order { capacity, config, memory, mapper }, read, context) }
}

/// Restores a mapper in a caller's memory.
///
/// # Safety
/// The promises of [`dynvox_restore`].
pub unsafe fn restore(order: Order, read: DynvoxRead, context: *mut c_void) -> DynvoxStatus {
    let Some(read) = read else { return DynvoxStatus::Null };
    let mut source = |bytes: &mut [u8]| {
        if read(context, bytes.as_mut_ptr(), bytes.len()) {
            Ok(())
        } else {
            Err(DynvoxStatus::Callback)
        }
    };
    // SAFETY: the caller's promise.
    unsafe {
        make(order, |slot, capacity, config, slabs| {
            Mapper::restore_into(slot, capacity, config, slabs, &mut source).map_err(|error| {
                match error {
                    RestoreError::New(error) => error.into(),
                    RestoreError::Source(status) => status,
                    _ => DynvoxStatus::Snapshot,
                }
            })
        })
    }
}
