//! An allocator that serves one request, out of the slab, for ever.
//!
//! The block index is a `hashbrown::HashTable`, which wants an allocator. This one owns a region of
//! the slab and hands it out once; any further request is refused, which the table reports as a
//! failed reservation and the index as `Full`. Together with a table of at least twice the entries
//! it will ever hold (so that deletion debris is cleaned in place) no second request is ever
//! needed.
//!
//! These few lines are the core's one exception to safe code
//! (docs/decisions/0002-one-shot-allocator.md).
#![expect(
    unsafe_code,
    reason = "an allocator cannot be written without; docs/decisions/0002-one-shot-allocator.md"
)]

use allocator_api2::alloc::{AllocError, Allocator, Layout};
use core::{
    marker::PhantomData,
    ptr::NonNull,
    sync::atomic::{AtomicBool, Ordering},
};

/// The allocator: a region of the slab and whether it has been handed out.
#[derive(Debug)]
pub(crate) struct OneShot<'s> {
    start: NonNull<u8>,
    len: usize,
    taken: AtomicBool,
    region: PhantomData<&'s mut [u8]>,
}

// SAFETY: the region is borrowed exclusively for 's and handed out at most once, which the atomic
// flag guards across threads.
unsafe impl Send for OneShot<'_> {}
// SAFETY: as above; a shared reference can only race on the flag.
unsafe impl Sync for OneShot<'_> {}

impl<'s> OneShot<'s> {
    /// Takes over a region of the slab.
    pub(crate) fn new(region: &'s mut [u8]) -> Self {
        Self {
            len: region.len(),
            start: NonNull::from(region).cast(),
            taken: AtomicBool::new(false),
            region: PhantomData,
        }
    }
}

// SAFETY: the block handed out is valid for 's, which outlives the allocator; it does not move with
// the allocator; it is handed out once, so it is never aliased; and it is never taken back.
unsafe impl Allocator for OneShot<'_> {
    fn allocate(&self, layout: Layout) -> Result<NonNull<[u8]>, AllocError> {
        let aligned = (self.start.as_ptr() as usize).is_multiple_of(layout.align());
        if !aligned || layout.size() > self.len || self.taken.swap(true, Ordering::Relaxed) {
            return Err(AllocError);
        }
        Ok(NonNull::slice_from_raw_parts(self.start, layout.size()))
    }

    unsafe fn deallocate(&self, _: NonNull<u8>, _: Layout) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::Slab;

    #[test]
    fn serves_one_request_and_refuses_the_next() {
        let mut slab = std::boxed::Box::new(Slab([0u8; 128]));
        let shot = OneShot::new(&mut slab.0);
        let layout = Layout::from_size_align(64, 16).unwrap();
        assert!(
            shot.allocate(Layout::from_size_align(129, 16).unwrap()).is_err(),
            "more than there is"
        );
        assert_eq!(shot.allocate(layout).unwrap().len(), 64);
        assert!(shot.allocate(layout).is_err(), "a second time");
    }
}
