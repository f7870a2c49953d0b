//! The checksum at the end of a snapshot.
//!
//! A visit hands over pieces, and each word of eight bytes of a piece goes into one word of state
//! by steps that can be undone. So a change within one such word, a flipped bit or a whole byte,
//! ends in another checksum for certain, wherever it is, as long as as many bytes are read; changes
//! in several words do but for one chance in 2^64. A change that alters how many bytes are read, in
//! a count, has the visit end before or after the checksum: the source ends too early, or other
//! bytes are taken for the checksum, with the same chance. A caller whose source knows its end
//! makes that certain too by asking that nothing is left.

/// The fraction of the golden ratio, in 1/2^64: odd, so that multiplying by it can be undone.
const MULTIPLIER: u64 = 0x9E37_79B9_7F4A_7C15;

/// The checksum so far. Not a [`crate::digest::Digest`], whose steps cannot be undone: two states
/// may become one there, if hardly ever.
pub(super) struct Checksum(pub u64);

impl Checksum {
    pub const fn new() -> Self {
        Self(MULTIPLIER)
    }

    /// Takes in a piece; its last word is filled up with zeros.
    pub fn take(&mut self, piece: &[u8]) {
        let (words, rest) = piece.as_chunks();
        words.iter().for_each(|word| self.step(u64::from_le_bytes(*word)));
        if !rest.is_empty() {
            self.step(rest.iter().rev().fold(0, |word, &byte| word << 8 | u64::from(byte)));
        }
    }

    fn step(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(MULTIPLIER).rotate_left(29);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Returns the multiplier's inverse: each round doubles the number of right bits.
    fn inverse() -> u64 {
        (0..6).fold(MULTIPLIER, |inverse, _| {
            inverse.wrapping_mul(2u64.wrapping_sub(MULTIPLIER.wrapping_mul(inverse)))
        })
    }

    #[test]
    fn a_step_of_the_checksum_can_be_undone() {
        // An odd multiplier has an inverse, so that no two states become one.
        assert_eq!(MULTIPLIER.wrapping_mul(inverse()), 1);
        let mut random = Random::new(3);
        let mut any =
            || u64::from(random.below(u32::MAX)) << 32 | u64::from(random.below(u32::MAX));
        for _ in 0..10_000 {
            let (state, word) = (any(), any());
            let mut sum = Checksum(state);
            sum.step(word);
            // Backwards: first the rotation, then the product.
            let undone = sum.0.rotate_right(29).wrapping_mul(inverse());
            assert_eq!(
                (undone ^ word, undone ^ state),
                (state, word),
                "the state from the word, and the word from the state"
            );
        }
    }

    #[test]
    fn every_bit_of_a_piece_of_any_length_counts() {
        let bytes: [u8; 67] = core::array::from_fn(|at| (at * 37) as u8);
        // Lengths around the word of eight bytes, which is taken whole.
        for len in [1, 7, 8, 9, 64, 67] {
            let of = |piece: &[u8]| {
                let mut sum = Checksum::new();
                sum.take(piece);
                // A suffix: the difference must not be lost in what follows.
                sum.take(&bytes);
                sum.0
            };
            let clean = of(&bytes[..len]);
            for bit in 0..8 * len {
                let mut flipped = bytes;
                flipped[bit / 8] ^= 1 << (bit % 8);
                assert_ne!(of(&flipped[..len]), clean, "bit {bit} of {len} bytes");
            }
        }
    }
}
