//! A mapper's state as bytes: what a drive needs to go on as if it had never stopped.
//!
//! Each part of the core describes its state once, as a walk over its fields (`Archive`); the same walk writes them and reads them back. All
//! numbers are little-endian and of a stated width, so the bytes are the same on every machine. What can be made anew is not stored: features of
//! the last pair, the block index. What only one frame needs is not stored either, so [`crate::Mapper::disparity_q8`] has nothing to show
//! before the next frame.
//!
//! | bytes | what |
//! |---|---|
//! | 8 | `DVXSTATE` |
//! | 4 | [`VERSION`] |
//! | 8, 8 | fingerprint of the capacity, of the configuration: a digest of their `Debug` text |
//! | 4, 4, 4 | frames taken, image width and height, px (0 before the first frame) |
//! | | the last pair, the camera, tracks, masks and objects, the static map |
//! | 8 | checksum of everything before |
//!
//! What the checksum notices: the walk hands over pieces, and each word of eight bytes of a piece goes into one word of state by steps that can be
//! undone. So a change within one such word, a flipped bit or a whole byte, ends in another checksum for certain, wherever it is, as long as
//! as many bytes are read; changes in several words do but for one chance in 2^64. A change that alters how many bytes are read, in a count,
//! has the walk end before or behind the checksum: the source ends too early, or other bytes are taken for the checksum, with the same
//! chance. A caller whose source knows its end makes that certain too by asking that nothing is left.
//!
//! Memory: none beside the mapper's. Bytes: about those of the blocks in use, and of what waits to be pruned.

use crate::{digest::Digest, mapper::NewError};
use core::fmt::{self, Write};

/// What a snapshot begins with.
pub const MAGIC: [u8; 8] = *b"DVXSTATE";
/// Version of the layout. Another one is refused: there is no conversion.
pub const VERSION: u32 = 3;

/// Why a mapper cannot be restored. There is no mapper then; the slab may be used again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RestoreError<E> {
    /// The slab or the configuration.
    New(NewError),
    /// The source ended too early or failed.
    Source(E),
    /// The bytes are no snapshot.
    Foreign,
    /// The snapshot is of another version of the layout.
    Version(u32),
    /// The snapshot is of a mapper with other bounds.
    Capacity,
    /// The snapshot is of a mapper that was told other things.
    Config,
    /// The bytes are not those that were written.
    Damaged,
}

/// A walk over values that writes them, reads them or hashes them.
///
/// A walk that failed goes on without effect; whoever began it asks in the end.
pub(crate) trait Archive {
    /// Writes the bytes, or replaces them by those that were written.
    fn raw(&mut self, bytes: &mut [u8]);

    /// Notes that what was read cannot be.
    fn refuse(&mut self);

    /// Visits values whose digest is kept up to date: hashing takes the digest and need not visit them.
    fn content(&mut self, _digest: u64, visit: impl FnOnce(&mut Self)) {
        visit(self);
    }

    fn u8(&mut self, value: &mut u8) {
        let mut bytes = [*value];
        self.raw(&mut bytes);
        [*value] = bytes;
    }

    fn u32(&mut self, value: &mut u32) {
        let mut bytes = value.to_le_bytes();
        self.raw(&mut bytes);
        *value = u32::from_le_bytes(bytes);
    }

    fn u64(&mut self, value: &mut u64) {
        let mut bytes = value.to_le_bytes();
        self.raw(&mut bytes);
        *value = u64::from_le_bytes(bytes);
    }

    fn i32(&mut self, value: &mut i32) {
        let mut bits = *value as u32;
        self.u32(&mut bits);
        *value = bits as i32;
    }

    fn f32(&mut self, value: &mut f32) {
        let mut bits = value.to_bits();
        self.u32(&mut bits);
        *value = f32::from_bits(bits);
    }

    fn f64(&mut self, value: &mut f64) {
        let mut bits = value.to_bits();
        self.u64(&mut bits);
        *value = f64::from_bits(bits);
    }

    fn f64s(&mut self, values: &mut [f64]) {
        values.iter_mut().for_each(|value| self.f64(value));
    }

    fn u32s(&mut self, values: &mut [u32]) {
        values.iter_mut().for_each(|value| self.u32(value));
    }

    fn u64s(&mut self, values: &mut [u64]) {
        values.iter_mut().for_each(|value| self.u64(value));
    }

    fn i16s(&mut self, values: &mut [i16]) {
        let mut bytes = [0; 128];
        for values in values.chunks_mut(64) {
            let Some(bytes) = bytes.get_mut(..2 * values.len()) else { return };
            for (pair, value) in bytes.chunks_exact_mut(2).zip(values.iter()) {
                pair.copy_from_slice(&value.to_le_bytes());
            }
            self.raw(bytes);
            for (pair, value) in bytes.as_chunks::<2>().0.iter().zip(values.iter_mut()) {
                *value = i16::from_le_bytes(*pair);
            }
        }
    }

    fn u16s(&mut self, values: &mut [u16]) {
        // The same size and alignment: it cannot fail.
        self.i16s(bytemuck::try_cast_slice_mut(values).unwrap_or(&mut []));
    }

    /// A count of at most `most`; a larger one is refused and is 0.
    fn count(&mut self, value: &mut usize, most: usize) {
        let mut bits = *value as u32;
        self.u32(&mut bits);
        *value = bits as usize;
        if *value > most {
            self.refuse();
            *value = 0;
        }
    }
}

/// Of the golden ratio: odd, so that multiplying by it can be undone.
const MULTIPLIER: u64 = 0x9E37_79B9_7F4A_7C15;

/// The checksum under way. Not a [`Digest`], whose steps cannot be undone: two states may become one there, if hardly ever.
struct Checksum(u64);

impl Checksum {
    const fn new() -> Self {
        Self(MULTIPLIER)
    }

    /// Takes in a piece; its last word is filled up with zeros.
    fn take(&mut self, piece: &[u8]) {
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

/// Writes.
pub(crate) struct Writer<'f, F, E> {
    sink: &'f mut F,
    checksum: Checksum,
    failure: Option<E>,
}

impl<'f, F: FnMut(&[u8]) -> Result<(), E>, E> Writer<'f, F, E> {
    pub fn new(sink: &'f mut F) -> Self {
        Self { sink, checksum: Checksum::new(), failure: None }
    }

    /// Writes the checksum of all that was written.
    pub fn finish(mut self) -> Result<(), E> {
        let mut checksum = self.checksum.0;
        self.u64(&mut checksum);
        self.failure.map_or(Ok(()), Err)
    }
}

impl<F: FnMut(&[u8]) -> Result<(), E>, E> Archive for Writer<'_, F, E> {
    fn raw(&mut self, bytes: &mut [u8]) {
        if self.failure.is_none() {
            self.checksum.take(bytes);
            self.failure = (self.sink)(bytes).err();
        }
    }

    /// What is written is what there is.
    fn refuse(&mut self) {}
}

/// Reads.
pub(crate) struct Reader<'f, F, E> {
    source: &'f mut F,
    checksum: Checksum,
    failure: Option<RestoreError<E>>,
}

impl<'f, F: FnMut(&mut [u8]) -> Result<(), E>, E> Reader<'f, F, E> {
    pub fn new(source: &'f mut F) -> Self {
        Self { source, checksum: Checksum::new(), failure: None }
    }

    /// Fails with `failure` unless `holds`, or with what failed before.
    pub fn require(&mut self, holds: bool, failure: RestoreError<E>) -> Result<(), RestoreError<E>> {
        match self.failure.take() {
            Some(before) => Err(before),
            None if holds => Ok(()),
            None => Err(failure),
        }
    }

    /// Compares the checksum of all that was read with the one that follows.
    pub fn finish(mut self) -> Result<(), RestoreError<E>> {
        let (expected, mut checksum) = (self.checksum.0, 0);
        self.u64(&mut checksum);
        self.require(checksum == expected, RestoreError::Damaged)
    }
}

impl<F: FnMut(&mut [u8]) -> Result<(), E>, E> Archive for Reader<'_, F, E> {
    fn raw(&mut self, bytes: &mut [u8]) {
        if self.failure.is_none() {
            self.failure = (self.source)(bytes).err().map(RestoreError::Source);
        }
        if self.failure.is_some() {
            bytes.fill(0);
        }
        self.checksum.take(bytes);
    }

    fn refuse(&mut self) {
        if self.failure.is_none() {
            self.failure = Some(RestoreError::Damaged);
        }
    }
}

/// Hashes.
#[derive(Default)]
pub(crate) struct Hasher(pub Digest);

impl Archive for Hasher {
    fn raw(&mut self, bytes: &mut [u8]) {
        self.0.bytes(bytes);
    }

    /// What is hashed is what there is.
    fn refuse(&mut self) {}

    fn content(&mut self, digest: u64, _visit: impl FnOnce(&mut Self)) {
        self.0.u64(digest);
    }

    fn u8(&mut self, value: &mut u8) {
        self.0.u64(u64::from(*value));
    }

    fn u32(&mut self, value: &mut u32) {
        self.0.u64(u64::from(*value));
    }

    fn u64(&mut self, value: &mut u64) {
        self.0.u64(*value);
    }

    fn f32(&mut self, value: &mut f32) {
        self.0.f64(f64::from(*value));
    }

    fn f64(&mut self, value: &mut f64) {
        self.0.f64(*value);
    }

    fn i16s(&mut self, values: &mut [i16]) {
        self.0.i16s(values);
    }
}

/// A digest of a value's `Debug` text: no field can be forgotten, and floats are written to the last bit.
pub(crate) fn fingerprint(value: &impl fmt::Debug) -> u64 {
    struct Text(Digest);
    impl Write for Text {
        fn write_str(&mut self, text: &str) -> fmt::Result {
            // Byte by byte: how a formatter cuts its text must not matter.
            text.bytes().for_each(|byte| self.0.u64(u64::from(byte)));
            Ok(())
        }
    }
    let mut text = Text(Digest::default());
    // Writing into a digest cannot fail.
    let _ = write!(text, "{value:?}");
    text.0.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// What the multiplier is undone by: each round doubles the bits that are right.
    fn inverse() -> u64 {
        (0..6).fold(MULTIPLIER, |inverse, _| inverse.wrapping_mul(2u64.wrapping_sub(MULTIPLIER.wrapping_mul(inverse))))
    }

    #[test]
    fn a_step_of_the_checksum_can_be_undone_so_that_one_changed_word_is_never_lost() {
        assert_eq!(MULTIPLIER.wrapping_mul(inverse()), 1);
        let mut random = Random::new(3);
        let mut any = || u64::from(random.below(u32::MAX)) << 32 | u64::from(random.below(u32::MAX));
        for _ in 0..10_000 {
            let (state, word) = (any(), any());
            let mut sum = Checksum(state);
            sum.step(word);
            let undone = sum.0.rotate_right(29).wrapping_mul(inverse());
            assert_eq!((undone ^ word, undone ^ state), (state, word), "the state from the word, and the word from the state");
        }
    }

    #[test]
    fn every_bit_of_a_piece_of_any_length_counts() {
        let bytes: [u8; 67] = core::array::from_fn(|at| (at * 37) as u8);
        for len in [1, 7, 8, 9, 64, 67] {
            let of = |piece: &[u8]| {
                let mut sum = Checksum::new();
                sum.take(piece);
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
