//! Positions of the bits set in a word, where a word stands for 64 pixels or slots.

/// Positions of the bits set in `word`, lowest first.
#[inline]
pub(crate) fn set_bits(mut word: u64) -> impl Iterator<Item = u32> + Clone {
    core::iter::from_fn(move || {
        let bit = word.trailing_zeros();
        word &= word.wrapping_sub(1);
        (bit < 64).then_some(bit)
    })
}

#[cfg(test)]
mod tests {
    use super::set_bits;
    use std::vec::Vec;

    #[test]
    fn bits_come_from_the_lowest_to_the_highest() {
        assert_eq!(set_bits(1 << 63 | 1 << 5 | 1).collect::<Vec<_>>(), [0, 5, 63]);
        assert_eq!(set_bits(0).count(), 0);
        assert!(set_bits(u64::MAX).eq(0..64));
    }
}
