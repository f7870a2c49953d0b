//! Arrangement of grey samples in the memory that a camera writes to.

use super::View;
use crate::slices::clipped;

/// Arrangement of the grey samples of a raw image in memory, as MIPI CSI-2 names them.
///
/// Sensors of 10 and 12 bits send packed rows: the upper eight bits of four (or two) neighbours as
/// a byte each, then one byte with the bits that are left. The mapper works on the upper eight
/// bits, where they lie; nothing is copied or unpacked.
///
/// ```
/// use dynvox_core::image::SampleLayout;
///
/// assert_eq!(SampleLayout::Bytes.row_bytes(640), 640);
/// assert_eq!(SampleLayout::Packed10.row_bytes(640), 800);
/// assert_eq!(SampleLayout::Packed12.row_bytes(640), 960);
/// assert_eq!(SampleLayout::Packed10.row_bytes(5), 10);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SampleLayout {
    /// A byte for each sample (RAW8).
    #[default]
    Bytes,
    /// Five bytes for four samples (RAW10).
    Packed10,
    /// Three bytes for two samples (RAW12).
    Packed12,
}

impl SampleLayout {
    /// Bytes of a row of so many samples, a last group that is not full included.
    pub const fn row_bytes(self, width: usize) -> usize {
        match self {
            Self::Bytes => width,
            Self::Packed10 => width.div_ceil(4) * 5,
            Self::Packed12 => width.div_ceil(2) * 3,
        }
    }

    /// Position of a column's upper eight bits within its row.
    #[inline(always)]
    pub(crate) const fn position(self, column: usize) -> usize {
        match self {
            Self::Bytes => column,
            Self::Packed10 => column + column / 4,
            Self::Packed12 => column + column / 2,
        }
    }

    /// Returns true if an image holds rows of this layout.
    pub(crate) fn fits(self, image: &View<'_, u8>) -> bool {
        let (data, stride) = image.strided();
        let row = self.row_bytes(image.width());
        let before_last = image.height().saturating_sub(1).checked_mul(stride);
        stride >= row && before_last.is_some_and(|before| data.len().saturating_sub(before) >= row)
    }

    /// The bytes of each row, from top to bottom.
    pub(crate) fn rows<'a>(self, image: &View<'a, u8>) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let (data, stride) = image.strided();
        let row = self.row_bytes(image.width());
        (0..image.height()).map(move |v| clipped(data, v * stride..v * stride + row))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn upper_bits_lie_where_the_standard_puts_them() {
        // Four samples in five bytes, the fifth with the lower bits of all.
        let ten = [0, 1, 2, 3, 5, 6, 7, 8, 10];
        assert!((0..9).all(|column| SampleLayout::Packed10.position(column) == ten[column]));
        let twelve = [0, 1, 3, 4, 6, 7];
        assert!((0..6).all(|column| SampleLayout::Packed12.position(column) == twelve[column]));
    }

    #[test]
    fn an_image_whose_rows_are_short_does_not_fit() {
        let bytes = [0u8; 2 * 100];
        let image = |stride| View::with_stride(&bytes, 80, 2, stride).unwrap();
        assert!(SampleLayout::Packed10.fits(&image(100)));
        // Rows overlap, or the last one ends outside the memory.
        assert!(!SampleLayout::Packed10.fits(&image(99)));
        assert!(!SampleLayout::Packed10.fits(&image(101)));
        assert!(SampleLayout::Bytes.fits(&image(101)) && !SampleLayout::Packed12.fits(&image(100)));
    }
}
