//! Segments of a map, between which no motion of the camera is known.

use bytemuck::{Pod, Zeroable};

/// First of the numbers that archived blocks have as a segment.
const ARCHIVES: u16 = 1 << 15;

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
        let next = self.0.checked_add(1).map(Self)?;
        (next.0 != ARCHIVES).then_some(next)
    }

    /// Segment of the archived blocks of a submap: those that the camera came back to later. They
    /// lie in the lattice of the segment that the submap was driven in.
    pub(crate) const fn from_archived_submap(submap: u16) -> Self {
        Self(ARCHIVES | submap)
    }

    /// Number of the submap whose archived blocks have this segment; `None` where it is one that
    /// the camera is or was in.
    ///
    /// ```
    /// use dynvox_core::geometry::MapSegment;
    ///
    /// assert_eq!(MapSegment::new(7).archived_submap(), None);
    /// assert_eq!(MapSegment::new(0x8007).archived_submap(), Some(7));
    /// ```
    pub const fn archived_submap(self) -> Option<u16> {
        if self.0 >= ARCHIVES { Some(self.0 - ARCHIVES) } else { None }
    }
}
