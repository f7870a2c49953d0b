//! A value that is no plain data, moved into a region of the slab.
//!
//! With the allocator of the block index the core's one exception to safe code
//! (docs/decisions/0002-one-shot-allocator.md).
#![expect(
    unsafe_code,
    reason = "bytes become a value of any type; docs/decisions/0002-one-shot-allocator.md"
)]

use core::mem::MaybeUninit;

/// Moves `value` to the first place of `region` that is aligned for it; nothing where it does not
/// fit. It is never dropped.
pub(super) fn in_place<T>(region: &mut [u8], value: T) -> Option<&mut T> {
    // SAFETY: any bytes, and none, are a valid `MaybeUninit<T>`, and the region stays borrowed for
    // as long as the value is: what was bytes is not read as bytes again.
    let (_, aligned, _) = unsafe { region.align_to_mut::<MaybeUninit<T>>() };
    aligned.first_mut().map(|first| first.write(value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::Slab;

    #[test]
    fn a_value_lies_aligned_in_its_region_and_none_where_it_does_not_fit() {
        let mut slab = std::boxed::Box::new(Slab([0u8; 128]));
        let bytes = slab.0.as_ptr_range();
        let value = in_place(&mut slab.0[1..], ("a", 7u64)).unwrap();
        assert_eq!(*value, ("a", 7));
        let at = core::ptr::from_ref(value);
        assert!(at.is_aligned() && bytes.contains(&at.cast()));
        assert!(in_place(&mut slab.0[..7], 7u64).is_none());
    }
}
