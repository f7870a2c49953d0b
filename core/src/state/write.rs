//! Writing state to a sink.

use super::{Visitor, checksum::Checksum};

/// Writes what it visits, piece by piece.
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
    ///
    /// # Errors
    /// The sink's first one.
    pub fn finish(mut self) -> Result<(), E> {
        let mut checksum = self.checksum.0;
        self.u64(&mut checksum);
        self.failure.map_or(Ok(()), Err)
    }
}

impl<F: FnMut(&[u8]) -> Result<(), E>, E> Visitor for Writer<'_, F, E> {
    fn bytes(&mut self, bytes: &mut [u8]) {
        if self.failure.is_none() {
            self.checksum.take(bytes);
            self.failure = (self.sink)(bytes).err();
        }
    }
}
