//! Owner of a match: the instance that it lies on.

use crate::tracking::instances::MAX_DETECTIONS;
use bytemuck::{Pod, Zeroable};

/// Owner of a match.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MatchOwner {
    /// The background.
    None,
    /// The instance at that position.
    Instance(usize),
    /// It may lie on either of two instances.
    Ambiguous,
}

/// A [`MatchOwner`] in a byte.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(crate) struct OwnerCode(u8);

impl OwnerCode {
    const AMBIGUOUS: u8 = u8::MAX;

    pub fn get(self) -> MatchOwner {
        match self.0 {
            0 => MatchOwner::None,
            Self::AMBIGUOUS => MatchOwner::Ambiguous,
            code => MatchOwner::Instance(usize::from(code) - 1),
        }
    }

    /// Returns true if the owner is that instance.
    pub fn is_instance(self, index: usize) -> bool {
        usize::from(self.0) == index + 1
    }
}

impl From<MatchOwner> for OwnerCode {
    fn from(match_owner: MatchOwner) -> Self {
        Self(match match_owner {
            MatchOwner::None => 0,
            MatchOwner::Instance(index) => {
                debug_assert!(index < MAX_DETECTIONS);
                index as u8 + 1
            }
            MatchOwner::Ambiguous => Self::AMBIGUOUS,
        })
    }
}
