//! Small values in tables that are plain bytes.

use bytemuck::{Pod, Zeroable};
use core::num::NonZeroU32;

/// The position of an entry of another table, or none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(crate) struct OptionalIndex(Option<NonZeroU32>);

impl OptionalIndex {
    /// No position.
    pub const NONE: Self = Self(None);

    /// A position.
    pub fn some(index: usize) -> Self {
        debug_assert!(index < u32::MAX as usize, "tables are short");
        Self(NonZeroU32::new((index as u32).wrapping_add(1)))
    }

    /// The position.
    pub fn get(self) -> Option<usize> {
        Some(self.0?.get() as usize - 1)
    }

    pub fn is_some(self) -> bool {
        self.0.is_some()
    }

    /// Returns the value in snapshots and digests: the position plus 1, 0 for none.
    pub fn to_bits(self) -> u32 {
        self.0.map_or(0, NonZeroU32::get)
    }

    /// See [`OptionalIndex::to_bits`].
    pub fn from_bits(bits: u32) -> Self {
        Self(NonZeroU32::new(bits))
    }
}

/// Yes or no.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(crate) struct Flag(u32);

impl Flag {
    pub fn get(self) -> bool {
        self.0 != 0
    }

    /// Returns the value in snapshots and digests, for writing.
    pub fn bits_mut(&mut self) -> &mut u32 {
        &mut self.0
    }
}

impl From<bool> for Flag {
    fn from(yes: bool) -> Self {
        Self(u32::from(yes))
    }
}
