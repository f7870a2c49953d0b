//! A 64-bit digest of values, the same on every machine.
//!
//! Values go in as integers, never as bytes of memory, so byte order cannot matter; floats go in by their bits with NaN made canonical.
//! Not cryptographic: it notices a flipped bit, not an adversary.

const MULTIPLIER: u64 = 0x9E37_79B9_7F4A_7C15;

/// A digest under construction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Digest(u64);

impl Default for Digest {
    fn default() -> Self {
        Self(0x2545_F491_4F6C_DD1D)
    }
}

impl Digest {
    /// Takes in 64 bits.
    #[inline]
    pub fn u64(&mut self, value: u64) {
        self.0 = (self.0 ^ value).wrapping_mul(MULTIPLIER).rotate_left(29);
    }

    /// Takes in a float by its bits; all NaNs are one.
    pub fn f64(&mut self, value: f64) {
        self.u64(if value.is_nan() { f64::NAN.to_bits() & 0x7FFF_FFFF_FFFF_FFFF } else { value.to_bits() });
    }

    /// Takes in two floats at once by their bits; all NaNs are one.
    pub fn f32s(&mut self, values: [f32; 2]) {
        let [a, b] = values.map(|value| u64::from(if value.is_nan() { 0x7FC0_0000 } else { value.to_bits() }));
        self.u64(a << 32 | b);
    }

    /// Takes in bytes, eight at a time, in four lanes so that a processor need not wait for each product. The last, short group is
    /// filled up with zeros; the length goes in as well.
    pub fn bytes(&mut self, bytes: &[u8]) {
        let mut lanes = [self.0, self.0 ^ 1, self.0 ^ 2, self.0 ^ 3];
        let mut groups = bytes.chunks_exact(32);
        for group in &mut groups {
            for (lane, word) in lanes.iter_mut().zip(group.chunks_exact(8)) {
                *lane = mixed(*lane, word);
            }
        }
        for word in groups.remainder().chunks(8) {
            let mut padded = [0; 8];
            padded.iter_mut().zip(word).for_each(|(to, from)| *to = *from);
            lanes[0] = mixed(lanes[0], &padded);
        }
        lanes.iter().for_each(|&lane| self.u64(lane));
        self.u64(bytes.len() as u64);
    }

    /// Takes in 16-bit integers, four at a time, in four lanes. Whole groups of sixteen only: a remainder is taken one by one.
    pub fn i16s(&mut self, values: &[i16]) {
        let mut lanes = [self.0, self.0 ^ 1, self.0 ^ 2, self.0 ^ 3];
        let mut groups = values.chunks_exact(16);
        for group in &mut groups {
            for (lane, four) in lanes.iter_mut().zip(group.chunks_exact(4)) {
                let word = four.iter().rev().fold(0u64, |word, &value| word << 16 | u64::from(value as u16));
                *lane = (*lane ^ word).wrapping_mul(MULTIPLIER).rotate_left(29);
            }
        }
        lanes.iter().for_each(|&lane| self.u64(lane));
        groups.remainder().iter().for_each(|&value| self.u64(value as u64));
    }

    /// Takes in unsigned 16-bit integers, as [`Digest::i16s`] does.
    pub fn u16s(&mut self, values: &[u16]) {
        // The same size and alignment: it cannot fail.
        self.i16s(bytemuck::try_cast_slice(values).unwrap_or(&[]));
    }

    /// The 64 bits.
    pub fn finish(self) -> u64 {
        let mixed = (self.0 ^ (self.0 >> 32)).wrapping_mul(MULTIPLIER);
        mixed ^ (mixed >> 29)
    }
}

#[inline]
fn mixed(lane: u64, word: &[u8]) -> u64 {
    let word = word.iter().rev().fold(0u64, |word, &byte| word << 8 | u64::from(byte));
    (lane ^ word).wrapping_mul(MULTIPLIER).rotate_left(29)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(fill: impl Fn(&mut Digest)) -> u64 {
        let mut digest = Digest::default();
        fill(&mut digest);
        digest.finish()
    }

    #[test]
    fn notices_every_single_bit_of_a_block() {
        let mut bytes = [0u8; 512];
        let clean = of(|d| d.bytes(&bytes));
        for bit in 0..512 * 8 {
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert_ne!(of(|d| d.bytes(&bytes)), clean);
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
        let mut values = [0i16; 512];
        let clean = of(|d| d.i16s(&values));
        for bit in 0..512 * 16 {
            values[bit / 16] ^= 1 << (bit % 16);
            assert_ne!(of(|d| d.i16s(&values)), clean);
            values[bit / 16] ^= 1 << (bit % 16);
        }
    }

    #[test]
    fn tells_lengths_and_orders_apart_and_makes_nan_one() {
        assert_ne!(of(|d| d.bytes(&[1, 2, 3])), of(|d| d.bytes(&[1, 2, 3, 0])));
        assert_ne!(of(|d| d.bytes(&[1, 2, 3])), of(|d| d.bytes(&[3, 2, 1])));
        assert_eq!(of(|d| d.f64(f64::NAN)), of(|d| d.f64(-f64::NAN)));
        assert_eq!(of(|d| d.f32s([f32::NAN, 1.0])), of(|d| d.f32s([-f32::NAN, 1.0])));
        assert_ne!(of(|d| d.f64(0.0)), of(|d| d.f64(-0.0)));
    }
}
