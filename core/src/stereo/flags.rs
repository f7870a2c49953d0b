//! Flags of a row, a byte each. Few are set: eight are looked at at once.

/// Eight flags, each 0 or 1, or as many as there are.
#[inline(always)]
pub(super) fn word(flags: &[u8]) -> u64 {
    match flags.first_chunk() {
        Some(eight) => u64::from_le_bytes(*eight),
        None => last_word(flags),
    }
}

/// As [`word`], where fewer than eight are left.
#[cold]
#[inline(never)]
fn last_word(flags: &[u8]) -> u64 {
    flags.iter().rev().fold(0, |word, &flag| word << 8 | u64::from(flag))
}

/// Calls `each` with the position of every flag that is set, in ascending order.
#[inline(always)]
pub(super) fn for_each_set(flags: &[u8], mut each: impl FnMut(usize)) {
    for (i, eight) in flags.chunks(8).enumerate() {
        let mut rest = word(eight);
        while rest != 0 {
            each(8 * i + rest.trailing_zeros() as usize / 8);
            rest &= rest - 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::vec::Vec;

    #[test]
    fn every_set_flag_is_found_once_and_in_order() {
        let mut random = Random::new(17);
        for (length, of) in [(0, 2), (1, 1), (7, 2), (8, 3), (41, 1), (64, 9), (100, 30)] {
            let flags: Vec<u8> = (0..length).map(|_| u8::from(random.below(of) == 0)).collect();
            let mut found = Vec::new();
            for_each_set(&flags, |position| found.push(position));
            assert_eq!(found, (0..length).filter(|&i| flags[i] != 0).collect::<Vec<_>>());
        }
    }
}
