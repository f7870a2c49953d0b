//! A mapper in a caller's memory: one buffer, or two.
//!
//! The (first) buffer begins with a [`HandleHeader`], behind which, at the next multiple of the
//! alignment, lies the slab. A handle points to the header. The two never overlap, so the mapper's
//! exclusive hold on the slab and a handle's access to the header do not meet.

use crate::{
    DynvoxCapacity, DynvoxConfig, DynvoxStatus,
    capacity::given,
    given::{Owned, output, read},
};
use core::{mem::MaybeUninit, ptr, slice};
use dynvox_core::{
    Capacity, Config, Mapper,
    memory::{SLAB_ALIGN, Slabs, TwoSlabs},
};

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
    /// Addresses of the mapper's memory: head and slab, and the second slab if there is one.
    owned: [[usize; 2]; 2],
    /// Made here by the core: it is some kilobytes, which the stack need not hold.
    mapper: MaybeUninit<Option<Mapper<'static>>>,
}

/// Bytes of the (first) buffer before its slab.
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
        make(
            Order { capacity, config, memory: Memory { buffer, len, cold: None }, mapper },
            new_mapper,
        )
    }
}

pub fn new_mapper(
    slot: &mut Option<Mapper<'static>>,
    capacity: &Capacity,
    config: &Config,
    slabs: Slabs<'static>,
) -> Result<(), DynvoxStatus> {
    Mapper::new_into(slot, capacity, config, slabs).map_err(DynvoxStatus::from)
}

/// Memory for a mapper: a buffer that begins with its head, and one for cold regions if there is.
#[derive(Clone, Copy)]
pub struct Memory {
    pub buffer: *mut u8,
    pub len: usize,
    pub cold: Option<(*mut u8, usize)>,
}

impl Memory {
    /// Slabs for a mapper, behind the head, and the addresses of all of them.
    ///
    /// # Safety
    /// Buffers are null or as long as they say, and nothing else uses them.
    unsafe fn slabs(
        self,
        capacity: &Capacity,
    ) -> Result<(Slabs<'static>, [[usize; 2]; 2]), DynvoxStatus> {
        let hot_bytes = self.cold.map_or(capacity.bytes(), |_| capacity.hot_bytes());
        let needed = [HEAD_BYTES + hot_bytes, self.cold.map_or(0, |_| capacity.cold_bytes())];
        let buffers = [(self.buffer, self.len), self.cold.unwrap_or((self.buffer, 0))];
        for ((buffer, len), needed) in buffers.into_iter().zip(needed) {
            if buffer.is_null() {
                return Err(DynvoxStatus::Null);
            }
            if !(buffer as usize).is_multiple_of(SLAB_ALIGN) {
                return Err(DynvoxStatus::Misaligned);
            }
            if len < needed {
                return Err(DynvoxStatus::TooSmall);
            }
        }
        let [hot, cold] = buffers.map(|(buffer, _)| buffer);
        let owned = Owned {
            buffers: [
                [hot as usize, hot as usize + needed[0]],
                [cold as usize, cold as usize + needed[1]],
            ],
        };
        let [[hot_start, hot_end], [cold_start, cold_end]] = owned.buffers;
        if self.cold.is_some() && cold_start < hot_end && hot_start < cold_end {
            return Err(DynvoxStatus::Overlap);
        }
        // SAFETY: within the buffers, behind the head, and apart; nothing but the mapper made here
        // will use them until it is destroyed.
        let slabs = unsafe {
            let hot = slice::from_raw_parts_mut(hot.add(HEAD_BYTES), hot_bytes);
            match self.cold {
                None => Slabs::One(hot),
                Some(_) => {
                    let cold = slice::from_raw_parts_mut(cold, needed[1]);
                    Slabs::Two(TwoSlabs { hot, cold })
                }
            }
        };
        Ok((slabs, owned.buffers))
    }
}

/// Pointers that a caller gives for a mapper, and where its handle goes.
pub struct Order {
    pub capacity: *const DynvoxCapacity,
    pub config: *const DynvoxConfig,
    pub memory: Memory,
    pub mapper: *mut *mut DynvoxMapper,
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
    Order { capacity, config, memory, mapper }: Order,
    new: impl FnOnce(
        &mut Option<Mapper<'static>>,
        &Capacity,
        &Config,
        Slabs<'static>,
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
    // All arguments are checked before any memory is touched.
    // SAFETY: the caller's promise.
    let (slabs, owned) = match unsafe { memory.slabs(&capacity) } {
        Ok(placed) => placed,
        Err(status) => return status,
    };
    if let Err(error) = Mapper::check_slabs(&capacity, &config, &slabs) {
        return error.into();
    }
    let head = memory.buffer.cast::<HandleHeader>();
    // SAFETY: the buffer is aligned better than a head, and long enough; no reference into it lives
    // but those of the mapper under construction; the handle was checked.
    unsafe {
        ptr::addr_of_mut!((*head).alive).write(0);
        let slot = (*ptr::addr_of_mut!((*head).mapper)).write(None);
        if let Err(status) = new(slot, &capacity, &config, slabs) {
            return status;
        }
        ptr::addr_of_mut!((*head).own).write(head as usize);
        ptr::addr_of_mut!((*head).busy).write(false);
        ptr::addr_of_mut!((*head).owned).write(owned);
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
    work: impl FnOnce(&mut Mapper<'static>, &Owned) -> Result<(), DynvoxStatus>,
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
        let owned = Owned { buffers: ptr::addr_of!((*head).owned).read() };
        let done = match (*ptr::addr_of_mut!((*head).mapper)).assume_init_mut() {
            Some(mapper) => work(mapper, &owned),
            None => Err(DynvoxStatus::NoMapper),
        };
        ptr::addr_of_mut!((*head).busy).write(false);
        done
    };
    done.err().unwrap_or(DynvoxStatus::Ok)
}
