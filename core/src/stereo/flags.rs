//! Flags of a row, a byte each, of which few are set.

/// Calls `each` with the position of every flag that is set, in ascending order: eight are looked at at once.
#[inline(always)]
pub(super) fn for_each_set(flags: &[u8], mut each: impl FnMut(usize)) {
    let (eights, rest) = flags.as_chunks::<8>();
    for (i, eight) in eights.iter().enumerate() {
        // Bytes are 0 or 1.
        let mut word = u64::from_le_bytes(*eight);
        while word != 0 {
            each(8 * i + word.trailing_zeros() as usize / 8);
            word &= word - 1;
        }
    }
    for (i, _) in rest.iter().enumerate().filter(|(_, flag)| **flag != 0) {
        each(8 * eights.len() + i);
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
