//! A 64-bit digest of values, the same on every machine.
//!
//! Values go in as integers, never as bytes of memory, so byte order cannot matter; floats go in by
//! their bits with NaN made canonical. Not cryptographic: it notices a flipped bit, not an
//! adversary.
//!
//! Single values are chained through one word of state, runs of values through eight such words,
//! the lanes, 64 bytes at a time. A word takes 64 bits in by `x = word ^ bits`,
//!
//! `word = low half of x * high half of x + x with its halves swapped`
//!
//! Where only one half of x differs the outcome does, so no flipped bit is lost on its way in; what
//! it does depends on the other half, so that a second flip does not undo it but by chance. The
//! product is the widest that processors without 64-bit ones have, and with the sum one instruction
//! on a Cortex-M7.

/// The fraction of the golden ratio, in 1/2^64.
const MULTIPLIER: u64 = 0x9E37_79B9_7F4A_7C15;
/// Lanes of a run.
const LANES: usize = 8;
/// Bytes that all lanes take in at once.
const STRIPE_BYTES: usize = 8 * LANES;
/// Start values and final factors of the lanes: odd numbers without a pattern.
const KEYS: [u64; LANES] = [
    finished(MULTIPLIER) | 1,
    finished(MULTIPLIER.wrapping_mul(2)) | 1,
    finished(MULTIPLIER.wrapping_mul(3)) | 1,
    finished(MULTIPLIER.wrapping_mul(4)) | 1,
    finished(MULTIPLIER.wrapping_mul(5)) | 1,
    finished(MULTIPLIER.wrapping_mul(6)) | 1,
    finished(MULTIPLIER.wrapping_mul(7)) | 1,
    finished(MULTIPLIER.wrapping_mul(8)) | 1,
];

/// A digest under construction.
///
/// ```
/// use dynvox_core::digest::Digest;
///
/// let of = |values: &[u64]| {
///     let mut digest = Digest::default();
///     values.iter().for_each(|&value| digest.u64(value));
///     digest.finish()
/// };
/// assert!(of(&[1, 2]) == of(&[1, 2]) && of(&[1, 2]) != of(&[2, 1]));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Digest {
    state: u64,
    lanes: [u64; LANES],
}

impl Default for Digest {
    fn default() -> Self {
        Self { state: 0x2545_F491_4F6C_DD1D, lanes: KEYS }
    }
}

impl Digest {
    /// Takes in 64 bits.
    ///
    /// ```
    /// use dynvox_core::digest::Digest;
    ///
    /// let of = |values: [u64; 2]| {
    ///     let mut digest = Digest::default();
    ///     values.into_iter().for_each(|value| digest.u64(value));
    ///     digest.finish()
    /// };
    /// assert_ne!(of([1, 2]), of([2, 1]), "the order counts");
    /// ```
    #[inline]
    pub fn u64(&mut self, value: u64) {
        self.state = mixed(self.state ^ value);
    }

    /// Takes in a float by its bits; all NaNs are one.
    ///
    /// ```
    /// use dynvox_core::digest::Digest;
    ///
    /// let of = |value: f64| {
    ///     let mut digest = Digest::default();
    ///     digest.f64(value);
    ///     digest.finish()
    /// };
    /// assert_eq!(of(f64::NAN), of(-f64::NAN), "all NaNs are one");
    /// assert_ne!(of(1.0), of(1.0 + f64::EPSILON));
    /// ```
    pub fn f64(&mut self, value: f64) {
        self.u64(if value.is_nan() {
            f64::NAN.to_bits() & 0x7FFF_FFFF_FFFF_FFFF
        } else {
            value.to_bits()
        });
    }

    /// Takes in two floats at once by their bits; all NaNs are one.
    pub fn f32s(&mut self, values: [f32; 2]) {
        let [a, b] = values
            .map(|value| u64::from(if value.is_nan() { 0x7FC0_0000 } else { value.to_bits() }));
        self.u64(a << 32 | b);
    }

    /// Takes in a run of bytes. Its last stripe is filled up with zeros; the length goes in as
    /// well.
    ///
    /// ```
    /// use dynvox_core::digest::Digest;
    ///
    /// let of = |bytes: &[u8]| {
    ///     let mut digest = Digest::default();
    ///     digest.bytes(bytes);
    ///     digest.finish()
    /// };
    /// assert_eq!(of(b"map"), of(b"map"));
    /// assert_ne!(of(b"map"), of(b"map\0"), "the length counts");
    /// ```
    pub fn bytes(&mut self, bytes: &[u8]) {
        let (stripes, rest) = bytes.as_chunks();
        self.stripes(stripes);
        if !rest.is_empty() {
            let mut stripe = [0; STRIPE_BYTES];
            stripe.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
            self.stripes(&[stripe]);
        }
        self.end_run(bytes.len());
    }

    /// Digests whole stripes like [`Digest::bytes`], to be compiled for its caller's vectors.
    #[inline(always)]
    pub(crate) fn whole_bytes<const N: usize>(&mut self, bytes: &[u8; N]) {
        const { assert!(N.is_multiple_of(STRIPE_BYTES)) }
        self.stripes(bytes.as_chunks().0);
        self.end_run(N);
    }

    /// Digests whole stripes like [`Digest::i16s`], to be compiled for its caller's vectors.
    #[inline(always)]
    pub(crate) fn whole_i16s<const N: usize>(&mut self, values: &[i16; N]) {
        const { assert!(N.is_multiple_of(STRIPE_BYTES / 2)) }
        self.i16_stripes(values.as_chunks().0);
        self.end_run(2 * N);
    }

    #[inline(always)]
    fn stripes(&mut self, stripes: &[[u8; STRIPE_BYTES]]) {
        // A copy, so that lanes stay in registers from stripe to stripe.
        let mut lanes = self.lanes;
        for stripe in stripes {
            take(&mut lanes, stripe);
        }
        self.lanes = lanes;
    }

    #[inline(always)]
    fn i16_stripes(&mut self, stripes: &[[i16; STRIPE_BYTES / 2]]) {
        let mut lanes = self.lanes;
        for stripe in stripes {
            take(&mut lanes, &low_bytes_first(stripe));
        }
        self.lanes = lanes;
    }

    /// Takes in a run of 16-bit integers: as one of bytes, two for each integer, the low one first.
    pub fn i16s(&mut self, values: &[i16]) {
        let (stripes, rest) = values.as_chunks();
        self.i16_stripes(stripes);
        if !rest.is_empty() {
            let mut stripe = [0; STRIPE_BYTES / 2];
            stripe.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
            self.i16_stripes(&[stripe]);
        }
        self.end_run(2 * values.len());
    }

    /// Takes in a run of unsigned 16-bit integers, as [`Digest::i16s`] does.
    ///
    /// ```
    /// use dynvox_core::digest::Digest;
    ///
    /// let mut digest = Digest::default();
    /// digest.u16s(&[1, 2, 3]);
    /// let before = digest.finish();
    /// digest.u16s(&[4]);
    /// assert_ne!(before, digest.finish());
    /// ```
    pub fn u16s(&mut self, values: &[u16]) {
        // The same size and alignment: it cannot fail.
        self.i16s(bytemuck::try_cast_slice(values).unwrap_or(&[]));
    }

    /// Ends a run. Its length tells where among the single values it stood; its bits are turned so
    /// that no value is taken for one.
    fn end_run(&mut self, bytes: usize) {
        self.u64(!(bytes as u64));
    }

    /// The 64 bits.
    pub fn finish(self) -> u64 {
        let sum = self.lanes.iter().zip(KEYS).fold(self.state, |sum, (&lane, key)| {
            sum.wrapping_add((lane ^ lane >> 32).wrapping_mul(key))
        });
        finished(sum)
    }
}

/// A stripe of 16-bit integers as bytes. Where memory is laid out that way already, compilers leave
/// nothing of it.
#[inline(always)]
fn low_bytes_first(values: &[i16; STRIPE_BYTES / 2]) -> [u8; STRIPE_BYTES] {
    let mut stripe = [0; STRIPE_BYTES];
    stripe.as_chunks_mut().0.iter_mut().zip(values).for_each(|(to, from)| *to = from.to_le_bytes());
    stripe
}

/// Takes a stripe into the lanes.
#[inline(always)]
fn take(lanes: &mut [u64; LANES], stripe: &[u8; STRIPE_BYTES]) {
    for (lane, &word) in lanes.iter_mut().zip(stripe.as_chunks().0) {
        *lane = mixed(*lane ^ u64::from_le_bytes(word));
    }
}

/// The product of both halves, and the halves swapped. Two shifts instead of one rotation: that,
/// compilers put into vectors.
#[inline(always)]
const fn mixed(x: u64) -> u64 {
    let (low, high) = (x & 0xFFFF_FFFF, x >> 32);
    low.wrapping_mul(high).wrapping_add(high | x << 32)
}

/// Spreads every bit over all others, and back no two into one (the finisher of `SplitMix64`).
const fn finished(bits: u64) -> u64 {
    let bits = (bits ^ bits >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let bits = (bits ^ bits >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    bits ^ bits >> 31
}

#[cfg(test)]
mod tests;
