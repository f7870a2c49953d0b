//! Segments of a map, between which no motion of the camera is known.

use bytemuck::{Pod, Zeroable};

/// Number of a segment of a map, from 0. A camera that was lost and is not found again begins
/// another segment, whose first camera is its origin. Poses and blocks of one segment lie in one
/// frame of reference; where that frame lies in another segment is not known.
///
/// ```
/// use dynvox_core::geometry::MapSegment;
///
/// let second = MapSegment::FIRST.next().unwrap();
/// assert_eq!((second.get(), second > MapSegment::default()), (1, true));
/// assert_eq!(MapSegment::new(u16::MAX).next(), None);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Pod, Zeroable)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(transparent))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(transparent)]
pub struct MapSegment(u16);

impl MapSegment {
    /// Segment that a map begins with.
    pub const FIRST: Self = Self(0);

    /// Segment of a number.
    pub const fn new(number: u16) -> Self {
        Self(number)
    }

    /// Number of the segment, from 0.
    pub const fn get(self) -> u16 {
        self.0
    }

    /// Segment that begins after this one; `None` where no number is left.
    pub fn next(self) -> Option<Self> {
        self.0.checked_add(1).map(Self)
    }
}
