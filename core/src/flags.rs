//! Flags of a row or of a layer of voxels, a byte each: many are looked at at once.

/// Eight flags, each 0 or 1, or as many as there are.
#[inline(always)]
pub(crate) fn word(flags: &[u8]) -> u64 {
    match flags.first_chunk() {
        Some(eight) => u64::from_le_bytes(*eight),
        None => last_word(flags),
    }
}

/// Packs flags like [`word`], if fewer than eight are left.
#[cold]
#[inline(never)]
fn last_word(flags: &[u8]) -> u64 {
    flags.iter().rev().fold(0, |word, &flag| word << 8 | u64::from(flag))
}

/// Eight flags as bits, the first lowest.
#[inline(always)]
fn bits_of_word(word: u64) -> u64 {
    // The factor moves byte i to bit 56 + i; no two products meet in one bit, so nothing carries.
    word.wrapping_mul(0x0102_0408_1020_4080) >> 56
}

/// At most 64 flags as bits, the first lowest.
#[inline(always)]
pub(crate) fn bits(flags: &[u8]) -> u64 {
    (0u32..8)
        .zip(flags.chunks(8))
        .fold(0, |bits, (i, eight)| bits | bits_of_word(word(eight)) << (8 * i))
}

/// Calls `each` with the position of every flag that is set, in ascending order.
#[inline(always)]
pub(crate) fn for_each_set(flags: &[u8], mut each: impl FnMut(usize)) {
    // How many are set no processor foresees: it errs once in 64 flags.
    for (i, flags) in flags.chunks(64).enumerate() {
        let mut rest = bits(flags);
        while rest != 0 {
            each(64 * i + rest.trailing_zeros() as usize);
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
        for (length, of) in [(0, 2), (1, 1), (7, 2), (8, 3), (41, 1), (64, 9), (100, 30), (200, 1)]
        {
            let flags: Vec<u8> = (0..length).map(|_| u8::from(random.below(of) == 0)).collect();
            let mut found = Vec::new();
            for_each_set(&flags, |position| found.push(position));
            assert_eq!(found, (0..length).filter(|&i| flags[i] != 0).collect::<Vec<_>>());
        }
    }
}
