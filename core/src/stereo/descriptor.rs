//! The descriptor of a pixel: 16 gradient samples of the 5 x 5 window about it, and distances between descriptors.
//!
//! Descriptors are never kept for a whole image (16 bytes a pixel): a row of them is built from the gradients when it is matched.

use super::gradient::FLAT;

/// 12 samples of the horizontal gradient, then 4 of the vertical one.
pub(super) type Descriptor = [u8; 16];

/// Columns and rows at the image's rim that have no descriptor: two for the window, one because the outermost pixels have no gradient.
pub(super) const MARGIN: usize = 3;

/// Where the horizontal gradient is sampled, (column, row) from the pixel: it tells disparities apart, so it has most samples.
const DU: [(usize, usize); 12] = [(2, 0), (1, 1), (3, 1), (0, 2), (1, 2), (2, 2), (2, 2), (3, 2), (4, 2), (1, 3), (3, 3), (2, 4)];
/// Where the vertical gradient is sampled.
const DV: [(usize, usize); 4] = [(2, 1), (1, 2), (3, 2), (2, 3)];

/// The gradients of one image.
#[derive(Clone, Copy)]
pub(super) struct Gradients<'a> {
    /// Horizontal gradient, row-major, `width` apart.
    pub du: &'a [u8],
    /// Vertical gradient.
    pub dv: &'a [u8],
    /// Width of the image, px.
    pub width: usize,
    /// Height of the image, px.
    pub height: usize,
}

impl Gradients<'_> {
    /// Builds the descriptors of row `v` into `out`, which is as wide as the image. Those in the margin are left as they are; returns
    /// whether the row has descriptors at all.
    #[expect(clippy::indexing_slicing, reason = "rows v - 2 ..= v + 2 exist; every slice is cut to n = width - 4 items, and i < n")]
    pub fn describe_row(&self, v: usize, out: &mut [Descriptor]) -> bool {
        let (w, Some(n)) = (self.width, self.width.checked_sub(4)) else { return false };
        if v < MARGIN || v + MARGIN >= self.height || out.len() < w {
            return false;
        }
        let a: [&[u8]; 12] = DU.map(|(du, dv)| &self.du[(v + dv - 2) * w + du..][..n]);
        let b: [&[u8]; 4] = DV.map(|(du, dv)| &self.dv[(v + dv - 2) * w + du..][..n]);
        let [a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11] = a;
        let [b0, b1, b2, b3] = b;
        for (i, out) in out[2..][..n].iter_mut().enumerate() {
            *out = [a0[i], a1[i], a2[i], a3[i], a4[i], a5[i], a6[i], a7[i], a8[i], a9[i], a10[i], a11[i], b0[i], b1[i], b2[i], b3[i]];
        }
        true
    }
}

/// Sum of absolute differences of two descriptors, at most 4,080.
#[inline(always)]
pub(super) fn distance(a: &Descriptor, b: &Descriptor) -> u32 {
    a.iter().zip(b).map(|(&a, &b)| u32::from(a.abs_diff(b))).sum()
}

/// Texture of a descriptor: the sum of its gradients' magnitudes.
#[inline(always)]
pub(super) fn texture(a: &Descriptor) -> u32 {
    distance(a, &[FLAT; 16])
}
