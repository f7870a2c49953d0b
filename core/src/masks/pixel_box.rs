//! Boxes of pixels.

use crate::state::Visitor;
use bytemuck::{Pod, Zeroable};

/// Largest side of the box of a detection, px.
pub(crate) const MAX_SIDE: u32 = 1 << 15;
/// Farthest that a side of a box lies from the image's corner, px: more than a track's box moves
/// while it is not seen.
const BOX_FARTHEST_PX: i32 = 1 << 29;

/// A box of pixels: it holds columns `left .. left + width` and rows `top .. top + height`. It may
/// lie partly or wholly beside the image.
///
/// ```
/// use dynvox_core::masks::PixelBox;
///
/// let car = PixelBox { left: 10, top: 20, width: 40, height: 30 };
/// assert!(car.contains(10, 20) && !car.contains(50, 20));
/// assert_eq!((car.area(), car.overlap(&car)), (1_200, 1.0));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Pod, Zeroable)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PixelBox {
    /// First column, px.
    pub left: i32,
    /// First row, px.
    pub top: i32,
    /// Columns, px.
    pub width: i32,
    /// Rows, px.
    pub height: i32,
}

impl PixelBox {
    /// Visits every field. What is read lies near enough that no sum of sides overflows.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { left, top, width, height } = self;
        let mut sides = [left, top, width, height];
        visitor.i32s(sides.iter_mut().map(|side| &mut **side));
        let most = BOX_FARTHEST_PX;
        if sides.iter().any(|side| !(-most..=most).contains(*side)) {
            visitor.refuse();
            *self = Self::default();
        }
    }

    /// Pixels in the box.
    ///
    /// ```
    /// use dynvox_core::masks::PixelBox;
    ///
    /// assert_eq!(PixelBox { left: 10, top: 5, width: 4, height: 3 }.area(), 12);
    /// ```
    pub fn area(&self) -> i64 {
        i64::from(self.width.max(0)) * i64::from(self.height.max(0))
    }

    /// Returns true if the box contains a pixel.
    ///
    /// ```
    /// use dynvox_core::masks::PixelBox;
    ///
    /// let pixels = PixelBox { left: 10, top: 5, width: 4, height: 3 };
    /// assert!(pixels.contains(13, 7) && !pixels.contains(14, 7));
    /// ```
    pub fn contains(&self, u: i32, v: i32) -> bool {
        u >= self.left && v >= self.top && u - self.left < self.width && v - self.top < self.height
    }

    /// Returns the part that both boxes cover; of width or height 0 if they do not meet.
    ///
    /// ```
    /// use dynvox_core::masks::PixelBox;
    ///
    /// let one = PixelBox { left: 0, top: 0, width: 4, height: 4 };
    /// let other = PixelBox { left: 2, top: 3, width: 4, height: 4 };
    /// assert_eq!(one.intersection(&other).area(), 2);
    /// ```
    pub fn intersection(&self, other: &Self) -> Self {
        let (left, top) = (self.left.max(other.left), self.top.max(other.top));
        let right = (self.left + self.width).min(other.left + other.width);
        let bottom = (self.top + self.height).min(other.top + other.height);
        Self { left, top, width: (right - left).max(0), height: (bottom - top).max(0) }
    }

    /// Intersection over union.
    ///
    /// ```
    /// use dynvox_core::masks::PixelBox;
    ///
    /// let pixels = PixelBox { left: 0, top: 0, width: 4, height: 4 };
    /// assert_eq!(pixels.overlap(&pixels), 1.0);
    /// assert_eq!(pixels.overlap(&pixels.moved([4, 0])), 0.0);
    /// ```
    pub fn overlap(&self, other: &Self) -> f32 {
        share(self.intersection(other).area(), self.area(), other.area())
    }

    /// The box moved.
    ///
    /// ```
    /// use dynvox_core::masks::PixelBox;
    ///
    /// let moved = PixelBox { left: 1, top: 2, width: 4, height: 4 }.moved([10, -2]);
    /// assert_eq!([moved.left, moved.top], [11, 0]);
    /// ```
    pub fn moved(&self, [u, v]: [i32; 2]) -> Self {
        Self { left: self.left + u, top: self.top + v, ..*self }
    }

    /// The box scaled about its centre: the new width is `width * permille / 1000` cut to whole
    /// pixels, half the excess on either side, the odd pixel right and below (as in the published
    /// code).
    pub(crate) fn scaled(&self, permille: u32) -> Self {
        let of = |side: i32| (i64::from(side) * i64::from(permille) / 1000) as i32;
        let (width, height) = (of(self.width), of(self.height));
        // Down, so that the odd pixel lies to the right and below also where the box shrinks.
        let half = |excess: i32| excess.div_euclid(2);
        Self {
            left: self.left - half(width - self.width),
            top: self.top - half(height - self.height),
            width,
            height,
        }
    }
}

/// Returns the common part of two areas, as a share of their union; 0 if that is empty.
pub(super) fn share(common: i64, a: i64, b: i64) -> f32 {
    let union = a + b - common;
    if union > 0 { common as f32 / union as f32 } else { 0.0 }
}
