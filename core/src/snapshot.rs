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
//! | 8 | digest of everything before |
//!
//! Memory: none beside the mapper's. Bytes: about those of the blocks in use, and of what waits to be pruned.

use crate::{digest::Digest, mapper::NewError};
use core::fmt::{self, Write};

/// What a snapshot begins with.
pub const MAGIC: [u8; 8] = *b"DVXSTATE";
/// Version of the layout. Another one is refused: there is no conversion.
pub const VERSION: u32 = 1;

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

/// A walk over values that writes them or reads them.
///
/// A walk that failed goes on without effect; whoever began it asks in the end.
pub(crate) trait Archive {
    /// Writes the bytes, or replaces them by those that were written.
    fn raw(&mut self, bytes: &mut [u8]);

    /// Notes that what was read cannot be.
    fn refuse(&mut self);

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

/// Writes.
pub(crate) struct Writer<'f, F, E> {
    sink: &'f mut F,
    digest: Digest,
    failure: Option<E>,
}

impl<'f, F: FnMut(&[u8]) -> Result<(), E>, E> Writer<'f, F, E> {
    pub fn new(sink: &'f mut F) -> Self {
        Self { sink, digest: Digest::default(), failure: None }
    }

    /// Writes the digest of all that was written.
    pub fn finish(mut self) -> Result<(), E> {
        let mut digest = self.digest.finish();
        self.u64(&mut digest);
        self.failure.map_or(Ok(()), Err)
    }
}

impl<F: FnMut(&[u8]) -> Result<(), E>, E> Archive for Writer<'_, F, E> {
    fn raw(&mut self, bytes: &mut [u8]) {
        if self.failure.is_none() {
            self.digest.bytes(bytes);
            self.failure = (self.sink)(bytes).err();
        }
    }

    /// What is written is what there is.
    fn refuse(&mut self) {}
}

/// Reads.
pub(crate) struct Reader<'f, F, E> {
    source: &'f mut F,
    digest: Digest,
    failure: Option<RestoreError<E>>,
}

impl<'f, F: FnMut(&mut [u8]) -> Result<(), E>, E> Reader<'f, F, E> {
    pub fn new(source: &'f mut F) -> Self {
        Self { source, digest: Digest::default(), failure: None }
    }

    /// Fails with `failure` unless `holds`, or with what failed before.
    pub fn require(&mut self, holds: bool, failure: RestoreError<E>) -> Result<(), RestoreError<E>> {
        match self.failure.take() {
            Some(before) => Err(before),
            None if holds => Ok(()),
            None => Err(failure),
        }
    }

    /// Compares the digest of all that was read with the one that follows.
    pub fn finish(mut self) -> Result<(), RestoreError<E>> {
        let (expected, mut digest) = (self.digest.finish(), 0);
        self.u64(&mut digest);
        self.require(digest == expected, RestoreError::Damaged)
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
        self.digest.bytes(bytes);
    }

    fn refuse(&mut self) {
        if self.failure.is_none() {
            self.failure = Some(RestoreError::Damaged);
        }
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
