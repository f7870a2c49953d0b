//! Neighbours worked on at once, in loops that compilers turn into vectors.

/// How many: as many numbers of 32 bits as the widest vector holds.
pub(crate) const LANES: usize = 8;
/// One value for each of them.
pub(crate) type Eight<T> = [T; LANES];

/// Sets one lane's figures.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "lanes are below their number")]
pub(crate) fn set<T: Copy, const N: usize>(all: &mut [Eight<T>; N], lane: usize, one: &[T; N]) {
    for i in 0..N {
        all[i][lane] = one[i];
    }
}

/// One lane's figures.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "lanes are below their number")]
pub(crate) fn at_lane<T: Copy + Default, const N: usize>(all: &[Eight<T>; N], lane: usize) -> [T; N] {
    let mut one = [T::default(); N];
    for i in 0..N {
        one[i] = all[i][lane];
    }
    one
}
