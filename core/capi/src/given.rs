//! Reading a caller's pointers: every pointer is checked for null and alignment here, and nowhere
//! else.

use crate::DynvoxStatus;
use core::slice;

/// Most bytes a slice may have.
const MOST: usize = isize::MAX as usize;

/// Copies the value out.
///
/// # Safety
/// `pointer` is null, misaligned or points to a `T`.
pub unsafe fn read<T: Copy>(pointer: *const T) -> Result<T, DynvoxStatus> {
    if pointer.is_null() {
        Err(DynvoxStatus::Null)
    } else if !pointer.is_aligned() {
        Err(DynvoxStatus::Misaligned)
    } else {
        // SAFETY: not null and aligned; of the right type by the caller's promise.
        Ok(unsafe { *pointer })
    }
}

/// The pointer, when a value can be written there.
///
/// # Safety
/// The check itself has no condition; writing needs a pointer to a `T`.
pub unsafe fn output<T>(pointer: *mut T) -> Result<*mut T, DynvoxStatus> {
    if pointer.is_null() {
        Err(DynvoxStatus::Null)
    } else if pointer.is_aligned() {
        Ok(pointer)
    } else {
        Err(DynvoxStatus::Misaligned)
    }
}

/// Addresses of a mapper's own buffer, or of both where it has two.
#[derive(Clone, Debug)]
pub struct Owned {
    /// First address, and the one behind the last.
    pub buffers: [[usize; 2]; 2],
}

impl Owned {
    fn overlaps(&self, start: usize, end: usize) -> bool {
        self.buffers.iter().any(|&[first, behind]| start < behind && first < end)
    }
}

/// Items of a caller's that must not lie in `forbidden`, the mapper's own memory.
///
/// # Safety
/// `pointer` is null, misaligned or points to `len` items that nothing writes to for 'a.
pub unsafe fn items<'a, T>(
    pointer: *const T,
    len: usize,
    forbidden: &Owned,
) -> Result<&'a [T], DynvoxStatus> {
    if len == 0 {
        return Ok(&[]);
    }
    if pointer.is_null() {
        return Err(DynvoxStatus::Null);
    }
    if !pointer.is_aligned() {
        return Err(DynvoxStatus::Misaligned);
    }
    // No slice may be longer than isize::MAX bytes.
    let bytes =
        len.checked_mul(size_of::<T>()).filter(|&bytes| bytes <= MOST).ok_or(DynvoxStatus::Size)?;
    let start = pointer as usize;
    // Overlapping references would be undefined behaviour, hence the comparison of addresses.
    let end = start.checked_add(bytes).ok_or(DynvoxStatus::Size)?;
    if forbidden.overlaps(start, end) {
        return Err(DynvoxStatus::Overlap);
    }
    // SAFETY: not null, aligned, no longer than a slice can be; as long as it says, and left alone,
    // by the caller's promise.
    Ok(unsafe { slice::from_raw_parts(pointer, len) })
}

/// Borrows items like [`items`], for writing.
///
/// # Safety
/// `pointer` is null, misaligned or points to `len` items that nothing else reads or writes for 'a.
pub unsafe fn items_mut<'a, T>(
    pointer: *mut T,
    len: usize,
    forbidden: &Owned,
) -> Result<&'a mut [T], DynvoxStatus> {
    // SAFETY: the same promise, and more.
    unsafe { items(pointer.cast_const(), len, forbidden)? };
    if len == 0 {
        return Ok(&mut []);
    }
    // SAFETY: checked above; nothing else uses them by the caller's promise.
    Ok(unsafe { slice::from_raw_parts_mut(pointer, len) })
}
