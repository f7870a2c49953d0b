//! The descriptor of a pixel: 16 gradient samples of the 5 x 5 window about it, and distances
//! between descriptors.
//!
//! Descriptors are never kept for a whole image (16 bytes a pixel): a row of them is built from the
//! gradients when it is matched.

use super::gradient::FLAT;
use crate::{
    lanes::{Eight, LANES},
    sad::distance,
    slices::clipped,
};

pub(super) use crate::sad::Descriptor;

/// Stereo's descriptors have eleven samples of the horizontal gradient, which tells disparities
/// apart, and five of the vertical one:
///
/// ```text
/// horizontal: . . . . .   vertical: . . . . .
///             . x x x .             . . x . .
///             x x x x x             . x x x .
///             . x x x .             . . x . .
///             . . . . .             . . . . .
/// ```
///
/// Neighbours lie together so that few loads fetch them all.
impl Descriptor {
    /// Descriptor of a pixel without gradients around it.
    pub const UNTEXTURED: Self = Self([FLAT; 16]);
}

/// Eight descriptors without texture.
pub(super) const UNTEXTURED: Eight<Descriptor> = [Descriptor::UNTEXTURED; LANES];

/// Columns and rows at the image's rim that have no descriptor: two for the window, one because the
/// outermost pixels have no gradient.
pub(super) const MARGIN: usize = 3;

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

impl<'a> Gradients<'a> {
    /// Builds the descriptors of row `v` into `out`, which is as wide as the image. Those in the
    /// margin are left as they are; returns whether the row has descriptors at all.
    #[inline(always)]
    pub fn describe_row(&self, v: usize, out: &mut [Descriptor]) -> bool {
        let row = |image: &'a [u8], v: usize| clipped(image, v * self.width..(v + 1) * self.width);
        if v < MARGIN
            || v + MARGIN >= self.height
            || self.width < 2 * MARGIN
            || out.len() < self.width
        {
            return false;
        }
        let rows = SampledRows {
            du: [row(self.du, v - 1), row(self.du, v), row(self.du, v + 1)],
            dv: [row(self.dv, v - 1), row(self.dv, v), row(self.dv, v + 1)],
        };
        // Words cover all but the row's end, whose pixels are read byte by byte.
        let done = rows.describe_most(out);
        for (u, out) in out.iter_mut().enumerate().take(self.width - MARGIN).skip(done.max(MARGIN))
        {
            *out = rows.describe(u);
        }
        true
    }
}

/// Builds the descriptors of rows, each of an image into its own output. Returns whether all have
/// any.
#[inline(always)]
pub(super) fn describe_rows<const N: usize>(
    rows: [(Gradients<'_>, usize, &mut [Descriptor]); N],
) -> bool {
    let mut described = true;
    // Not by `all`, whose closure is compiled for the baseline.
    for (image, v, out) in rows {
        described &= image.describe_row(v, out);
    }
    described
}

/// The gradients of the rows above, at and below the one described.
struct SampledRows<'a> {
    du: [&'a [u8]; 3],
    dv: [&'a [u8]; 3],
}

impl<'a> SampledRows<'a> {
    /// Describes pixels from column 2 on, by words, until the words would reach beyond the row;
    /// returns where it stopped.
    #[inline(always)]
    fn describe_most(&self, out: &mut [Descriptor]) -> usize {
        let ([du_above, du_here, du_below], [dv_above, dv_here, dv_below]) = (self.du, self.dv);
        let from = |row: &'a [u8], column: usize| clipped(row, column..);
        // Sixteen samples: of du five in the row and three each above and below; of dv three in the
        // row and one each above and below.
        let words = du_here.array_windows::<8>();
        let threes = [du_above, du_below, dv_here].map(|row| from(row, 1).array_windows::<4>());
        let ones = [dv_above, dv_below].map(|row| from(row, 2).iter());
        let ([above, below, beside], [up, down]) = (threes, ones);
        let mut end = 2;
        for (((out, five), (above, below)), (beside, (up, down))) in
            out.iter_mut().skip(2).zip(words).zip(above.zip(below)).zip(beside.zip(up.zip(down)))
        {
            // Little-endian on every machine, so that bytes have the order that `describe` gives
            // them.
            let three = |bytes: &[u8; 4]| u64::from(u32::from_le_bytes(*bytes) & 0xFF_FFFF);
            let low = (u64::from_le_bytes(*five) & 0xFF_FFFF_FFFF) | three(above) << 40;
            let high =
                three(below) | three(beside) << 24 | u64::from(*up) << 48 | u64::from(*down) << 56;
            *out = Descriptor(bytemuck::cast([low.to_le_bytes(), high.to_le_bytes()]));
            end += 1;
        }
        end
    }

    /// Describes one pixel, two columns or more from either end of the row.
    #[inline(never)]
    fn describe(&self, u: usize) -> Descriptor {
        let ([du_above, du_here, du_below], [dv_above, dv_here, dv_below]) = (self.du, self.dv);
        // Rows are as long as the image: columns two from an end are always there.
        let at = |row: &[u8], u: usize| row.get(u).copied().unwrap_or(FLAT);
        let (l, r) = (u - 1, u + 1);
        Descriptor([
            at(du_here, u - 2),
            at(du_here, l),
            at(du_here, u),
            at(du_here, r),
            at(du_here, u + 2),
            at(du_above, l),
            at(du_above, u),
            at(du_above, r),
            at(du_below, l),
            at(du_below, u),
            at(du_below, r),
            at(dv_here, l),
            at(dv_here, u),
            at(dv_here, r),
            at(dv_above, u),
            at(dv_below, u),
        ])
    }
}

/// Texture of a descriptor: the sum of its gradients' magnitudes.
#[inline(always)]
pub(super) fn texture(a: &Descriptor) -> u32 {
    distance(a, &Descriptor::UNTEXTURED)
}

/// Eight descriptors from column `at` on. Those beyond the row are taken from `spare`, which is
/// filled for the purpose.
#[inline(always)]
pub(super) fn eight<'r>(
    row: &'r [Descriptor],
    at: usize,
    spare: &'r mut Eight<Descriptor>,
) -> &'r Eight<Descriptor> {
    match row.get(at..).and_then(|row| row.first_chunk()) {
        Some(all) => all,
        None => copy_within(row, at, spare),
    }
}

/// Copies those of the columns from `at` on that are within the row; a column left of it has
/// wrapped around.
#[cold]
#[inline(never)]
fn copy_within<'r>(
    row: &[Descriptor],
    at: usize,
    spare: &'r mut Eight<Descriptor>,
) -> &'r Eight<Descriptor> {
    for (lane, to) in spare.iter_mut().enumerate() {
        *to = row.get(at.wrapping_add(lane)).copied().unwrap_or(Descriptor::UNTEXTURED);
    }
    spare
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn distances_are_sums_of_absolute_differences() {
        let mut random = Random::new(5);
        let mut descriptor =
            |bound: u32| Descriptor([(); 16].map(|()| (random.below(bound) * (256 / bound)) as u8));
        for bound in [2, 16, 256].repeat(50) {
            let [a, b] = [(); 2].map(|()| descriptor(bound));
            let plain = |a: &Descriptor, b: &Descriptor| -> u32 {
                a.0.iter().zip(b.0).map(|(a, b)| u32::from(a.abs_diff(b))).sum()
            };
            assert_eq!(distance(&a, &b), plain(&a, &b));
        }
        assert_eq!(distance(&Descriptor([0; 16]), &Descriptor([255; 16])), 4_080);
    }

    #[test]
    fn a_row_of_descriptors_holds_each_pixels_samples() {
        let mut random = Random::new(6);
        let (width, height) = (45, 9);
        let [du, dv] = [(); 2].map(|()| -> std::vec::Vec<u8> {
            (0..width * height).map(|_| random.below(256) as u8).collect()
        });
        let gradients = Gradients { du: &du, dv: &dv, width, height };
        let mut row = std::vec![Descriptor([0; 16]); width];
        // Rows nearer to the border than the samples reach are refused.
        assert!(!gradients.describe_row(2, &mut row) && !gradients.describe_row(6, &mut row));
        assert!(gradients.describe_row(4, &mut row));
        let at = |image: &[u8], u: usize, v: usize| image[v * width + u];
        for (u, got) in row.iter().enumerate().take(width - MARGIN).skip(MARGIN) {
            let horizontal = [
                (u - 2, 4),
                (u - 1, 4),
                (u, 4),
                (u + 1, 4),
                (u + 2, 4),
                (u - 1, 3),
                (u, 3),
                (u + 1, 3),
                (u - 1, 5),
                (u, 5),
                (u + 1, 5),
            ];
            let vertical = [(u - 1, 4), (u, 4), (u + 1, 4), (u, 3), (u, 5)];
            assert_eq!(got.0[..11], horizontal.map(|(u, v)| at(&du, u, v)));
            assert_eq!(got.0[11..], vertical.map(|(u, v)| at(&dv, u, v)));
        }
    }
}
