//! The descriptor of a pixel: 16 gradient samples of the 5 x 5 window about it, and distances between descriptors.
//!
//! Descriptors are never kept for a whole image (16 bytes a pixel): a row of them is built from the gradients when it is matched.

use super::gradient::FLAT;
use bytemuck::{Pod, Zeroable};

/// 12 samples of the horizontal gradient, then 4 of the vertical one. Aligned, so that it is loaded as one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C, align(16))]
pub(super) struct Descriptor(pub [u8; 16]);

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
        let samples: [&[u8]; 16] = core::array::from_fn(|k| if k < 12 { a[k] } else { b[k - 12] });
        let out = &mut out[2..][..n];
        let mut i = 0;
        while i + 16 <= n {
            transpose(samples.map(|sample| bytes_16(&sample[i..])), &mut out[i..i + 16]);
            i += 16;
        }
        for i in i..n {
            out[i] = Descriptor(samples.map(|sample| sample[i]));
        }
        true
    }
}

/// The first 16 bytes of a slice that has them.
#[inline(always)]
fn bytes_16(bytes: &[u8]) -> [u8; 16] {
    bytes.first_chunk().copied().unwrap_or([0; 16])
}

/// Turns 16 samples of 16 pixels each into 16 descriptors, by interleaving halves four times.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "k < 8, i < 16")]
fn transpose(mut samples: [[u8; 16]; 16], out: &mut [Descriptor]) {
    let interleave =
        |a: &[u8; 16], b: &[u8; 16], half: usize| core::array::from_fn(|i| if i % 2 == 0 { a[half + i / 2] } else { b[half + i / 2] });
    for _ in 0..4 {
        let mut next = [[0; 16]; 16];
        for k in 0..8 {
            next[2 * k] = interleave(&samples[k], &samples[k + 8], 0);
            next[2 * k + 1] = interleave(&samples[k], &samples[k + 8], 8);
        }
        samples = next;
    }
    for (out, bytes) in out.iter_mut().zip(samples) {
        out.0 = bytes;
    }
}

/// Sum of absolute differences of two descriptors, at most 4,080.
///
/// Written as larger less smaller in bytes: where one descriptor stays the same throughout a loop, the compiler would widen it once
/// before the loop and so lose the one instruction that x86 has for such sums.
#[inline(always)]
pub(super) fn distance(a: &Descriptor, b: &Descriptor) -> u32 {
    let mut differences = [0u8; 16];
    for (difference, (&a, &b)) in differences.iter_mut().zip(a.0.iter().zip(&b.0)) {
        *difference = a.max(b) - a.min(b);
    }
    differences.iter().map(|&difference| u32::from(difference)).sum()
}

/// Sum of the distances of four pairs of descriptors, at most 16,320.
#[inline(always)]
pub(super) fn distance_of_four(a: &[Descriptor; 4], [e, f, g, h]: [&Descriptor; 4]) -> u32 {
    let wide =
        |a: &Descriptor, b: &Descriptor| -> u32 { a.0.iter().zip(&b.0).map(|(&a, &b)| (i32::from(a) - i32::from(b)).unsigned_abs()).sum() };
    // Hidden from the optimiser, `a` is not widened ahead of the loop this stands in, nor that loop turned inside out.
    let [a, b, c, d] = core::hint::black_box(a);
    wide(a, e) + wide(b, f) + wide(c, g) + wide(d, h)
}

/// Texture of a descriptor: the sum of its gradients' magnitudes.
#[inline(never)]
pub(super) fn texture(a: &Descriptor) -> u32 {
    distance(a, &Descriptor([FLAT; 16]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn distances_are_sums_of_absolute_differences() {
        let mut random = Random::new(5);
        let mut descriptor = |bound: u32| Descriptor([(); 16].map(|()| (random.below(bound) * (256 / bound)) as u8));
        for bound in [2, 16, 256].repeat(50) {
            let [a, b, c, d] = [(); 4].map(|()| descriptor(bound));
            let plain = |a: &Descriptor, b: &Descriptor| -> u32 { a.0.iter().zip(b.0).map(|(a, b)| u32::from(a.abs_diff(b))).sum() };
            assert_eq!(distance(&a, &b), plain(&a, &b));
            let four = plain(&a, &b) + plain(&b, &c) + plain(&c, &d) + plain(&d, &a);
            assert_eq!(distance_of_four(&[a, b, c, d], [&b, &c, &d, &a]), four);
        }
        assert_eq!(distance(&Descriptor([0; 16]), &Descriptor([255; 16])), 4_080);
    }

    #[test]
    fn a_row_of_descriptors_holds_each_pixels_samples() {
        let mut random = Random::new(6);
        let (width, height) = (45, 9);
        let [du, dv] = [(); 2].map(|()| -> std::vec::Vec<u8> { (0..width * height).map(|_| random.below(256) as u8).collect() });
        let gradients = Gradients { du: &du, dv: &dv, width, height };
        let mut row = std::vec![Descriptor([0; 16]); width];
        assert!(!gradients.describe_row(2, &mut row) && !gradients.describe_row(6, &mut row));
        assert!(gradients.describe_row(4, &mut row));
        for u in MARGIN..width - MARGIN {
            let at = |image: &[u8], (du, dv): (usize, usize)| image[(4 + dv - 2) * width + u + du - 2];
            assert_eq!(row[u].0[..12], DU.map(|offset| at(&du, offset)));
            assert_eq!(row[u].0[12..], DV.map(|offset| at(&dv, offset)));
        }
    }
}
