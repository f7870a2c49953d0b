//! Parts of slices that the core itself says are there: the used entries of a buffer, a row of an image.
//!
//! A part that is missing is an internal fault. A test stops at it; every other build goes on with an
//! empty part, so that the core never panics.

use core::slice::SliceIndex;

const MISSING: &str = "internal fault: a part of a slice is missing";

/// The entries of `slice` in `range`.
#[inline]
#[track_caller]
pub(crate) fn part<T, R: SliceIndex<[T], Output = [T]>>(slice: &[T], range: R) -> &[T] {
    let found = slice.get(range);
    debug_assert!(found.is_some(), "{MISSING}");
    found.unwrap_or(&[])
}

/// The entries of `slice` in `range`, to be written.
#[inline]
#[track_caller]
pub(crate) fn part_mut<T, R: SliceIndex<[T], Output = [T]>>(slice: &mut [T], range: R) -> &mut [T] {
    let found = slice.get_mut(range);
    debug_assert!(found.is_some(), "{MISSING}");
    found.unwrap_or(&mut [])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_what_its_range_says() {
        let mut numbers = [1, 2, 3, 4];
        assert_eq!((part(&numbers, 1..3), part(&numbers, 4..)), (&[2, 3][..], &[][..]));
        part_mut(&mut numbers, ..2).fill(0);
        assert_eq!(numbers, [0, 0, 3, 4]);
    }

    #[test]
    #[should_panic(expected = "internal fault")]
    fn a_missing_part_stops_a_test() {
        part(&[1, 2, 3], 2..5);
    }

    #[test]
    #[should_panic(expected = "internal fault")]
    fn so_does_one_to_be_written() {
        part_mut(&mut [1, 2, 3], ..4);
    }
}
