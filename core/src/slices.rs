//! Parts of slices that the core itself says are there: the used entries of a buffer, a row of an
//! image.
//!
//! A part that is missing is an internal fault. A test stops at it; every other build goes on with
//! an empty part, so that the core never panics.

use core::slice::SliceIndex;

const MISSING: &str = "internal fault: a part of a slice is missing";

/// The entries of `slice` in `range`.
#[inline]
#[track_caller]
pub(crate) fn clipped<T, R: SliceIndex<[T], Output = [T]>>(slice: &[T], range: R) -> &[T] {
    let found = slice.get(range);
    debug_assert!(found.is_some(), "{MISSING}");
    found.unwrap_or(&[])
}

/// The entries of `slice` in `range`, to be written.
#[inline]
#[track_caller]
pub(crate) fn clipped_mut<T, R: SliceIndex<[T], Output = [T]>>(
    slice: &mut [T],
    range: R,
) -> &mut [T] {
    let found = slice.get_mut(range);
    debug_assert!(found.is_some(), "{MISSING}");
    found.unwrap_or(&mut [])
}

/// `N` entries of `row` from `start` on, after `skip` times `none`; those beyond the row are
/// `none`.
#[inline(always)]
pub(crate) fn padded<T: Copy, const N: usize>(
    row: &[T],
    start: usize,
    skip: usize,
    none: T,
) -> [T; N] {
    match row.get(start..).and_then(|rest| rest.first_chunk()) {
        Some(all) if skip == 0 => *all,
        _ => padded_at_border(row, start, skip, none),
    }
}

/// Pads like [`padded`], if a border of the row is among the items.
#[cold]
#[inline(never)]
fn padded_at_border<T: Copy, const N: usize>(
    row: &[T],
    start: usize,
    skip: usize,
    none: T,
) -> [T; N] {
    let mut entries = [none; N];
    entries.iter_mut().skip(skip).zip(row.iter().skip(start)).for_each(|(to, from)| *to = *from);
    entries
}

/// Writes entries of `row` from `start` on, those within it.
#[inline(always)]
pub(crate) fn store<T: Copy, const N: usize>(row: &mut [T], start: usize, entries: [T; N]) {
    let rest = row.get_mut(start..).unwrap_or_default();
    match rest.first_chunk_mut() {
        Some(all) => *all = entries,
        None => rest.iter_mut().zip(entries).for_each(|(to, from)| *to = from),
    }
}

/// Moves the items behind `at` up by one; the last stays where it is.
pub(crate) fn remove_at<T: Copy>(items: &mut [T], at: usize) {
    let Some(behind) = items.get_mut(at..) else { return };
    let Some(mut carried) = behind.last().copied() else { return };
    behind.iter_mut().rev().for_each(|slot| core::mem::swap(slot, &mut carried));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_what_its_range_says() {
        let mut numbers = [1, 2, 3, 4];
        assert_eq!((clipped(&numbers, 1..3), clipped(&numbers, 4..)), (&[2, 3][..], &[][..]));
        clipped_mut(&mut numbers, ..2).fill(0);
        assert_eq!(numbers, [0, 0, 3, 4]);
    }

    #[test]
    fn what_lies_beyond_a_row_is_padded() {
        let row = [1, 2, 3, 4, 5];
        assert_eq!(padded(&row, 1, 0, 0), [2, 3, 4]);
        assert_eq!(padded(&row, 3, 0, 0), [4, 5, 0]);
        assert_eq!(padded(&row, 0, 2, 9), [9, 9, 1]);
        assert_eq!(padded(&row, 4, 1, 0), [0, 5, 0]);
        assert_eq!((padded(&row, 5, 0, 7), padded(&row, 8, 0, 7)), ([7; 3], [7; 3]));
    }

    #[test]
    fn what_lies_beyond_a_row_is_not_stored() {
        let mut row = [1, 2, 3, 4, 5];
        store(&mut row, 1, [8, 9]);
        store(&mut row, 4, [7, 6]);
        store(&mut row, 6, [0, 0]);
        assert_eq!(row, [1, 8, 9, 4, 7]);
    }

    #[test]
    #[should_panic(expected = "internal fault")]
    fn a_missing_part_stops_a_test() {
        clipped(&[1, 2, 3], 2..5);
    }

    #[test]
    #[should_panic(expected = "internal fault")]
    fn so_does_one_to_be_written() {
        clipped_mut(&mut [1, 2, 3], ..4);
    }
}
