//! Code that must not be reachable: the heap and panics. Both end in undefined functions, so that a
//! program that could come to one of them cannot be linked.

#[cfg(feature = "hashbrown")]
use core::alloc::{GlobalAlloc, Layout};
use core::panic::PanicInfo;

unsafe extern "C" {
    #[cfg(feature = "hashbrown")]
    fn dynvox_the_heap_is_forbidden() -> *mut u8;
    #[cfg(not(feature = "panics_allowed"))]
    fn dynvox_a_panic_is_forbidden() -> !;
}

#[cfg(feature = "hashbrown")]
struct NoHeap;

#[cfg(feature = "hashbrown")]
// SAFETY: no call to it can be linked.
unsafe impl GlobalAlloc for NoHeap {
    unsafe fn alloc(&self, _: Layout) -> *mut u8 {
        // SAFETY: cannot be linked.
        unsafe { dynvox_the_heap_is_forbidden() }
    }

    unsafe fn dealloc(&self, _: *mut u8, _: Layout) {
        // SAFETY: cannot be linked.
        let _ = unsafe { dynvox_the_heap_is_forbidden() };
    }
}

// hashbrown names the alloc crate, which names an allocator; the core's table gets its memory from
// the slab.
#[cfg(feature = "hashbrown")]
#[global_allocator]
static HEAP: NoHeap = NoHeap;

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    #[cfg(not(feature = "panics_allowed"))]
    // SAFETY: cannot be linked.
    unsafe {
        dynvox_a_panic_is_forbidden()
    }
    #[cfg(feature = "panics_allowed")]
    loop {}
}
