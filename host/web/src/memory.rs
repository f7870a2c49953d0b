//! The instance's linear memory. It grows, and nothing is given back: an instance maps one
//! recording.

use core::alloc::{GlobalAlloc, Layout};
use core::arch::wasm32::{memory_grow, memory_size};

/// Bytes of a page of WebAssembly.
const PAGE: usize = 65_536;

/// Address of so many new bytes, all 0; 0 when the memory cannot grow.
pub fn reserve(bytes: usize) -> usize {
    let before = memory_size::<0>();
    if memory_grow::<0>(bytes.div_ceil(PAGE)) == usize::MAX { 0 } else { before * PAGE }
}

/// True if the range lies within the memory and not at 0.
fn is_there(start: usize, len: usize) -> bool {
    let size = memory_size::<0>() * PAGE;
    start != 0 && start <= size && len <= size - start
}

/// Bytes at an address that [`reserve`] gave; none where the range is not in the memory.
pub fn bytes(start: usize, len: usize) -> &'static [u8] {
    if !is_there(start, len) {
        return &[];
    }
    // SAFETY: the range lies in the memory, is initialised, and is never freed. The page writes to
    // it only between calls.
    unsafe { core::slice::from_raw_parts(start as *const u8, len) }
}

/// Bytes at an address that [`reserve`] gave, to write to.
pub fn bytes_mut(start: usize, len: usize) -> &'static mut [u8] {
    if !is_there(start, len) {
        return &mut [];
    }
    // SAFETY: as above; the page gives each range one use.
    unsafe { core::slice::from_raw_parts_mut(start as *mut u8, len) }
}

/// An allocator without memory: the core's containers name one and take theirs from the slab.
struct NoHeap;

// SAFETY: it gives out nothing.
unsafe impl GlobalAlloc for NoHeap {
    unsafe fn alloc(&self, _: Layout) -> *mut u8 {
        core::ptr::null_mut()
    }

    unsafe fn dealloc(&self, _: *mut u8, _: Layout) {}
}

#[global_allocator]
static HEAP: NoHeap = NoHeap;
