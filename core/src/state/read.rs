//! Reading state from a source.

use super::{Visitor, checksum::Checksum};

/// Reason why a reading failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ReadError<E> {
    /// The source ended too early or failed.
    Source(E),
    /// The bytes are not those that were written.
    Damaged,
}

/// Reads what it visits; zeros from the first failure on.
pub(crate) struct Reader<'f, F, E> {
    source: &'f mut F,
    checksum: Checksum,
    failure: Option<ReadError<E>>,
}

impl<'f, F: FnMut(&mut [u8]) -> Result<(), E>, E> Reader<'f, F, E> {
    pub fn new(source: &'f mut F) -> Self {
        Self { source, checksum: Checksum::new(), failure: None }
    }

    /// Checks that everything was read without an error.
    ///
    /// # Errors
    /// The first failure.
    pub fn check(&mut self) -> Result<(), ReadError<E>> {
        self.failure.take().map_or(Ok(()), Err)
    }

    /// Compares the checksum of all that was read with the one that follows.
    ///
    /// # Errors
    /// The first failure.
    pub fn finish(mut self) -> Result<(), ReadError<E>> {
        let (expected, mut checksum) = (self.checksum.0, 0);
        self.u64(&mut checksum);
        self.check()?;
        if checksum == expected { Ok(()) } else { Err(ReadError::Damaged) }
    }
}

impl<F: FnMut(&mut [u8]) -> Result<(), E>, E> Visitor for Reader<'_, F, E> {
    fn bytes(&mut self, bytes: &mut [u8]) {
        if self.failure.is_none() {
            self.failure = (self.source)(bytes).err().map(ReadError::Source);
        }
        if self.failure.is_some() {
            bytes.fill(0);
        }
        self.checksum.take(bytes);
    }

    fn refuse(&mut self) {
        if self.failure.is_none() {
            self.failure = Some(ReadError::Damaged);
        }
    }
}
