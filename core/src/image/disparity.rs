//! One pixel of disparity.

use super::View;
use bytemuck::{Pod, TransparentWrapper, Zeroable};

/// One pixel of disparity in the core's unit: 1/256 px in `u16`, as in KITTI's 16-bit PNGs. 0 means
/// none.
pub const DISPARITY_ONE_PX: u16 = 256;

/// The disparity of a pixel of an image in 1/256 px, px; `None` where none is known.
pub(crate) fn disparity_px(disparity_q8: View<'_, u16>, [u, v]: [usize; 2]) -> Option<f64> {
    let q8 = disparity_q8.get(u, v).filter(|q8| *q8 > 0)?;
    Some(f64::from(q8) / f64::from(DISPARITY_ONE_PX))
}

/// A disparity in 1/256 px, 0 none, as it is stored in an image of `u16`.
///
/// The core's own matcher works in 1/16 px, so its measurements are even. The lowest bit marks what
/// it filled in between them, and may be taken as part of the number: 1/256 px is far below what
/// any matcher resolves. In disparities from elsewhere the bit is part of the number and marks
/// nothing.
///
/// ```
/// use dynvox_core::image::DisparityQ8;
///
/// let (measured, filled) = (DisparityQ8::new(10 * 256), DisparityQ8::new(10 * 256 + 1));
/// assert!(!measured.is_filled() && filled.is_filled());
/// assert_eq!(measured.px(), 10.0);
/// assert!(!DisparityQ8::NONE.is_known());
/// ```
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Pod,
    Zeroable,
    TransparentWrapper,
)]
#[repr(transparent)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DisparityQ8(u16);

impl DisparityQ8 {
    /// No disparity is known.
    pub const NONE: Self = Self(0);
    /// The mark of what was filled in.
    const FILLED: u16 = 1;

    /// A disparity of so many 1/256 px.
    ///
    /// ```
    /// use dynvox_core::image::{DISPARITY_ONE_PX, DisparityQ8};
    ///
    /// assert_eq!(DisparityQ8::new(3 * DISPARITY_ONE_PX).px(), 3.0);
    /// ```
    pub const fn new(units: u16) -> Self {
        Self(units)
    }

    /// The disparity in 1/256 px, with its mark.
    pub const fn get(self) -> u16 {
        self.0
    }

    /// The disparity, px; 0 where none is known.
    ///
    /// ```
    /// use dynvox_core::image::DisparityQ8;
    ///
    /// assert_eq!(DisparityQ8::new(640).px(), 2.5);
    /// assert_eq!(DisparityQ8::NONE.px(), 0.0);
    /// ```
    pub fn px(self) -> f32 {
        f32::from(self.0) / f32::from(DISPARITY_ONE_PX)
    }

    /// Returns true if there is a disparity.
    ///
    /// ```
    /// use dynvox_core::image::DisparityQ8;
    ///
    /// assert!(DisparityQ8::new(512).is_known() && !DisparityQ8::NONE.is_known());
    /// ```
    pub const fn is_known(self) -> bool {
        self.0 != 0
    }

    /// Returns true if the core's own matcher filled this one in between measured ones.
    ///
    /// ```
    /// use dynvox_core::image::DisparityQ8;
    ///
    /// assert!(DisparityQ8::new(513).is_filled(), "the lowest bit is the mark");
    /// assert!(!DisparityQ8::new(512).is_filled());
    /// ```
    pub const fn is_filled(self) -> bool {
        self.0 & Self::FILLED != 0
    }

    /// Marks the disparity as filled in; none stays none.
    #[must_use]
    pub(crate) const fn filled(self) -> Self {
        if self.is_known() { Self(self.0 | Self::FILLED) } else { self }
    }

    /// Another value with the mark of this one; none where either is none.
    #[inline(always)]
    #[must_use]
    pub(crate) const fn with_value(self, units: u16) -> Self {
        let (value, mark) = (units & !Self::FILLED, self.0 & Self::FILLED);
        if (self.0 == 0) | (value == 0) { Self::NONE } else { Self(value | mark) }
    }
}

#[cfg(test)]
mod tests {
    use super::DisparityQ8;

    #[test]
    fn a_new_value_keeps_the_mark_and_none_stays_none() {
        let filled = DisparityQ8::new(512).filled();
        assert_eq!(filled.with_value(301).get(), 301);
        assert_eq!(DisparityQ8::new(512).with_value(301).get(), 300);
        assert_eq!(filled.with_value(1), DisparityQ8::NONE);
        assert_eq!(DisparityQ8::NONE.with_value(300), DisparityQ8::NONE);
        assert_eq!(DisparityQ8::NONE.filled(), DisparityQ8::NONE);
    }
}
