//! A mapper in a caller's buffer.
//!
//! The buffer begins with a [`HandleHeader`], behind which, at the next multiple of the alignment,
//! lies the slab. A handle points to the header. The two never overlap, so the mapper's exclusive
//! hold on the slab and a handle's access to the header do not meet.

use crate::{
    DynvoxCapacity, DynvoxConfig, DynvoxStatus,
    capacity::given,
    given::{output, read},
};
use core::{mem::MaybeUninit, ops::Range, ptr, slice};
use dynvox_core::{Capacity, Config, Mapper, memory::SLAB_ALIGN};

/// A mapper; only ever behind a pointer.
pub struct DynvoxMapper {
    _opaque: [u8; 0],
}

/// Stands in the head of a mapper that lives.
const ALIVE: u64 = 0x6479_6e76_6f78_2e31;

#[repr(C)]
struct HandleHeader {
    alive: u64,
    /// Address of this head: a copy of a buffer elsewhere is no mapper, because the mapper's
    /// references lead into the buffer it was made in.
    own: usize,
    busy: bool,
    /// Bytes of head and slab.
    bytes: usize,
    /// Made here by the core: it is some kilobytes, which the stack need not hold.
    mapper: MaybeUninit<Option<Mapper<'static>>>,
}

/// Bytes of a buffer before its slab.
pub const HEAD_BYTES: usize = size_of::<HandleHeader>().next_multiple_of(SLAB_ALIGN);

const fn bytes(capacity: &Capacity) -> usize {
    HEAD_BYTES + capacity.bytes()
}

/// Alignment of a mapper's buffer, bytes.
#[unsafe(no_mangle)]
pub extern "C" fn dynvox_alignment() -> usize {
    SLAB_ALIGN
}

/// Writes how many bytes of buffer a mapper of that capacity takes.
///
/// # Safety
/// `capacity` is null or points to a capacity, `bytes` is null or points to a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_bytes(
    capacity: *const DynvoxCapacity,
    bytes: *mut usize,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    match unsafe { (given(capacity), output(bytes)) } {
        (Ok(capacity), Ok(bytes)) => {
            // SAFETY: checked; of the right type by the caller's promise.
            unsafe { bytes.write(self::bytes(&capacity)) };
            DynvoxStatus::Ok
        }
        (Err(status), _) | (_, Err(status)) => status,
    }
}

/// Makes a mapper in `buffer` and writes its handle to `mapper`. The buffer is the mapper's until
/// dynvox_destroy: nothing else may read, write, move or free it. What it holds before does not
/// matter: a mapper that lived there ends, its handle is then the new one's. Takes less than 40 KiB
/// of stack, as a step does.
///
/// # Safety
/// `capacity` is null or points to a capacity, `config` is null or points to a configuration,
/// `buffer` is null or points to `len` bytes used by nothing else, `mapper` is null or points to a
/// pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_create(
    capacity: *const DynvoxCapacity,
    config: *const DynvoxConfig,
    buffer: *mut u8,
    len: usize,
    mapper: *mut *mut DynvoxMapper,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        make((capacity, config), (buffer, len), mapper, |slot, capacity, config, slab| {
            Mapper::new_into(slot, capacity, config, slab).map_err(DynvoxStatus::from)
        })
    }
}

/// Makes a mapper by `new` in a caller's buffer.
///
/// Nothing is written before everything that is given was checked. Then the mapper that lived in
/// the buffer ends, so that its handle cannot reach a slab that is no longer its own, also if
/// the new one is never made; a callback of `new` cannot reach it either.
///
/// # Safety
/// The promises of [`dynvox_create`].
pub unsafe fn make(
    (capacity, config): (*const DynvoxCapacity, *const DynvoxConfig),
    (buffer, len): (*mut u8, usize),
    mapper: *mut *mut DynvoxMapper,
    new: impl FnOnce(
        &mut Option<Mapper<'static>>,
        &Capacity,
        &Config,
        &'static mut [u8],
    ) -> Result<(), DynvoxStatus>,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    let given = unsafe {
        (given(capacity), read(config).and_then(|config| config.resolved()), output(mapper))
    };
    let (capacity, config, handle) = match given {
        (Ok(capacity), Ok(config), Ok(handle)) => (capacity, config, handle),
        (Err(status), ..) | (_, Err(status), _) | (_, _, Err(status)) => return status,
    };
    if buffer.is_null() {
        return DynvoxStatus::Null;
    }
    if !(buffer as usize).is_multiple_of(SLAB_ALIGN) {
        return DynvoxStatus::Misaligned;
    }
    // All arguments are checked before the buffer is touched.
    if len < bytes(&capacity) {
        return DynvoxStatus::TooSmall;
    }
    // SAFETY: within the buffer, behind the head, which nothing but the mapper made here will use
    // until it is destroyed.
    let slab: &'static mut [u8] =
        unsafe { slice::from_raw_parts_mut(buffer.add(HEAD_BYTES), capacity.bytes()) };
    if let Err(error) = Mapper::check(&capacity, &config, slab) {
        return error.into();
    }
    let head = buffer.cast::<HandleHeader>();
    // SAFETY: the buffer is aligned better than a head, and long enough; no reference into it lives
    // but those of the mapper under construction; the handle was checked.
    unsafe {
        ptr::addr_of_mut!((*head).alive).write(0);
        let slot = (*ptr::addr_of_mut!((*head).mapper)).write(None);
        if let Err(status) = new(slot, &capacity, &config, slab) {
            return status;
        }
        ptr::addr_of_mut!((*head).own).write(head as usize);
        ptr::addr_of_mut!((*head).busy).write(false);
        ptr::addr_of_mut!((*head).bytes).write(bytes(&capacity));
        ptr::addr_of_mut!((*head).alive).write(ALIVE);
        handle.write(head.cast());
    }
    DynvoxStatus::Ok
}

/// Ends a mapper; its buffer is the caller's again. Read the map out before.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_destroy(mapper: *mut DynvoxMapper) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    let head = match unsafe { head(mapper) } {
        Ok(head) => head,
        Err(status) => return status,
    };
    // SAFETY: alive, hence written in whole by dynvox_create, and not borrowed, as it is not busy.
    unsafe {
        (*head).mapper.assume_init_drop();
        ptr::addr_of_mut!((*head).alive).write(0);
    }
    DynvoxStatus::Ok
}

/// The head of a mapper that lives and is not at work.
///
/// # Safety
/// `mapper` is null, misaligned or points to a head's memory.
unsafe fn head(mapper: *mut DynvoxMapper) -> Result<*mut HandleHeader, DynvoxStatus> {
    let head = mapper.cast::<HandleHeader>();
    // SAFETY: only looked at.
    unsafe { output(head)? };
    // SAFETY: not null, aligned, a head's memory by the caller's promise; no reference to any of
    // these fields is ever made.
    let (alive, own, busy) = unsafe {
        (
            ptr::addr_of!((*head).alive).read(),
            ptr::addr_of!((*head).own).read(),
            ptr::addr_of!((*head).busy).cast::<u8>().read(),
        )
    };
    if alive != ALIVE || own != head as usize {
        Err(DynvoxStatus::NoMapper)
    } else if busy != 0 {
        Err(DynvoxStatus::Busy)
    } else {
        Ok(head)
    }
}

/// Does `work` with the mapper and the addresses of its buffer, while no callback can.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it.
pub unsafe fn with(
    mapper: *mut DynvoxMapper,
    work: impl FnOnce(&mut Mapper<'static>, &Range<usize>) -> Result<(), DynvoxStatus>,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    let head = match unsafe { head(mapper) } {
        Ok(head) => head,
        Err(status) => return status,
    };
    // SAFETY: alive, hence written in whole; the one reference made is to the mapper alone, and
    // busy keeps a second one from being made.
    let done = unsafe {
        ptr::addr_of_mut!((*head).busy).write(true);
        let buffer = head as usize..head as usize + ptr::addr_of!((*head).bytes).read();
        let done = match (*ptr::addr_of_mut!((*head).mapper)).assume_init_mut() {
            Some(mapper) => work(mapper, &buffer),
            None => Err(DynvoxStatus::NoMapper),
        };
        ptr::addr_of_mut!((*head).busy).write(false);
        done
    };
    done.err().unwrap_or(DynvoxStatus::Ok)
}
