//! Neighbours worked on at once, in loops that compilers turn into vectors.

/// Number of lanes: as many numbers of 32 bits as the widest vector has.
pub(crate) const LANES: usize = 8;
/// One value for each of them.
pub(crate) type Eight<T> = [T; LANES];

/// All bits of eight lanes, and none of eight more. Read from memory, for what is known of single
/// lanes keeps compilers from vectors.
static BITS: [i16; 2 * LANES] = [-1, -1, -1, -1, -1, -1, -1, -1, 0, 0, 0, 0, 0, 0, 0, 0];

/// All bits of the first `count` lanes, and none of the others.
#[inline(always)]
pub(crate) fn first(count: usize) -> &'static Eight<i16> {
    let beyond = LANES - count.min(LANES);
    BITS.get(beyond..).and_then(|bits| bits.first_chunk()).unwrap_or(&[0; LANES])
}

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
pub(crate) fn at_lane<T: Copy + Default, const N: usize>(
    all: &[Eight<T>; N],
    lane: usize,
) -> [T; N] {
    let mut one = [T::default(); N];
    for i in 0..N {
        one[i] = all[i][lane];
    }
    one
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_lanes_have_all_bits_and_the_others_none() {
        for count in 0..=2 * LANES {
            for (lane, &bits) in first(count).iter().enumerate() {
                assert_eq!(bits, if lane < count { -1 } else { 0 }, "{lane} of {count}");
            }
        }
    }
}
