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
///
/// Written as larger less smaller in bytes: where one descriptor stays the same throughout a loop, the compiler would widen it once
/// before the loop and so lose the one instruction that x86 has for such sums.
#[inline(always)]
pub(super) fn distance(a: &Descriptor, b: &Descriptor) -> u32 {
    let mut differences = [0u8; 16];
    for (difference, (&a, &b)) in differences.iter_mut().zip(a.iter().zip(b)) {
        *difference = a.max(b) - a.min(b);
    }
    differences.iter().map(|&difference| u32::from(difference)).sum()
}

/// Sum of the distances of four pairs of descriptors, at most 16,320.
#[inline(always)]
pub(super) fn distance_of_four(a: &[Descriptor; 4], b: [&Descriptor; 4]) -> u32 {
    let wide =
        |a: &Descriptor, b: &Descriptor| -> u32 { a.iter().zip(b).map(|(&a, &b)| (i32::from(a) - i32::from(b)).unsigned_abs()).sum() };
    // Hidden from the optimiser, `a` is not widened ahead of the loop this stands in, nor that loop turned inside out.
    a_opaque(a, b, wide)
}

#[inline(always)]
fn a_opaque(a: &[Descriptor; 4], [e, f, g, h]: [&Descriptor; 4], wide: impl Fn(&Descriptor, &Descriptor) -> u32) -> u32 {
    let [a, b, c, d] = core::hint::black_box(a);
    wide(a, e) + wide(b, f) + wide(c, g) + wide(d, h)
}

/// Texture of a descriptor: the sum of its gradients' magnitudes.
#[inline(always)]
pub(super) fn texture(a: &Descriptor) -> u32 {
    distance(a, &[FLAT; 16])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn distances_are_sums_of_absolute_differences() {
        let mut random = Random::new(5);
        let mut descriptor = |bound: u32| [(); 16].map(|()| (random.below(bound) * (256 / bound)) as u8);
        for bound in [2, 16, 256].repeat(50) {
            let [a, b, c, d] = [(); 4].map(|()| descriptor(bound));
            let plain = |a: &Descriptor, b: &Descriptor| -> u32 { a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b))).sum() };
            assert_eq!(distance(&a, &b), plain(&a, &b));
            let four = plain(&a, &b) + plain(&b, &c) + plain(&c, &d) + plain(&d, &a);
            assert_eq!(distance_of_four(&[a, b, c, d], [&b, &c, &d, &a]), four);
        }
        assert_eq!(distance(&[0; 16], &[255; 16]), 4_080);
    }
}
