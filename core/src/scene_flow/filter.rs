//! Gradients and the two feature filters, one pass over the image.
//!
//! Each row is summed down its columns first, which leaves every filter a short sum along the row:
//! all in `i16`, all contiguous.
//!
//! | filter | kernel | range |
//! |---|---|---|
//! | blob | 5x5: centre 8, ring 1, border -1 | ±4,080 |
//! | corner | 5x5: ±1 in the four 2x2 quadrants, 0 on the axes | ±2,040 |
//! | Sobel u, v | 3x3, divided by 4, held within ±127, plus 128 | `u8` |

use crate::image::View;

/// Rows and columns at the image's border without filter responses.
pub(super) const FILTER_MARGIN: usize = 2;
/// Rows of column sums that [`filter`] works on.
pub(super) const COLUMN_SUMS: usize = 5;

/// Buffers for one image's filter results; each as long as the image has pixels, rows `width`
/// apart.
pub(super) struct Responses<'a> {
    /// Sobel u in the low byte, Sobel v in the high byte.
    pub gradient: &'a mut [u16],
    /// Blob response, 0 at the border.
    pub blob: &'a mut [i16],
    /// Corner response, 0 at the border.
    pub corner: &'a mut [i16],
}

/// Filters a whole image. `sums` holds [`COLUMN_SUMS`] rows. Does nothing below 5 x 5 px.
#[inline(always)]
pub(super) fn filter(image: View<'_, u8>, out: Responses<'_>, sums: &mut [i16]) {
    let (width, height) = (image.width(), image.height());
    let Responses { gradient, blob, corner } = out;
    // The margin keeps a response of zero and an even gradient.
    blob.fill(0);
    corner.fill(0);
    gradient.fill(128 | 128 << 8);
    if width < 5 || height < 5 || sums.len() < COLUMN_SUMS * width {
        return;
    }
    let inner = FILTER_MARGIN..width - FILTER_MARGIN;
    let rows = gradient
        .chunks_exact_mut(width)
        .zip(blob.chunks_exact_mut(width))
        .zip(corner.chunks_exact_mut(width));
    for (v, ((gradient, blob), corner)) in
        rows.enumerate().take(height - FILTER_MARGIN).skip(FILTER_MARGIN)
    {
        let rows = [v - 2, v - 1, v, v + 1, v + 2].map(|v| image.row(v));
        sum_columns(rows, sums);
        let out = (
            gradient.get_mut(inner.clone()),
            blob.get_mut(inner.clone()),
            corner.get_mut(inner.clone()),
        );
        if let (Some(gradient), Some(blob), Some(corner)) = out {
            sum_rows(sums, image.row(v), gradient, blob, corner);
        }
    }
}

/// Sums each column's five pixels in the five ways the filters need. Nothing where the rows or
/// `sums` are too short.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "all slices are cut to the same length first")]
fn sum_columns(rows: [&[u8]; 5], sums: &mut [i16]) -> Option<()> {
    let [a, b, c, d, e] = rows;
    let width = a.len();
    let (five, rest) = sums.split_at_mut_checked(width)?;
    let (three, rest) = rest.split_at_mut_checked(width)?;
    let (halves, rest) = rest.split_at_mut_checked(width)?;
    let (smooth, rest) = rest.split_at_mut_checked(width)?;
    let step = rest.get_mut(..width)?;
    let (b, c, d, e) = (b.get(..width)?, c.get(..width)?, d.get(..width)?, e.get(..width)?);
    // Five bytes at most add up: 16 bits hold every sum.
    for u in 0..width {
        let [a, b, c, d, e] = [a[u], b[u], c[u], d[u], e[u]].map(i16::from);
        five[u] = a + b + c + d + e;
        three[u] = b + c + d;
        halves[u] = a + b - d - e;
        smooth[u] = b + 2 * c + d;
        step[u] = d - b;
    }
    Some(())
}

/// Finishes the filters along one row, border columns excluded. Nothing where a row is too short.
#[inline(always)]
#[expect(
    clippy::indexing_slicing,
    reason = "the outputs are 4 shorter than a row of sums; all slices are cut to their length \
              first"
)]
fn sum_rows(
    sums: &[i16],
    pixels: &[u8],
    gradient: &mut [u16],
    blob: &mut [i16],
    corner: &mut [i16],
) -> Option<()> {
    let n = gradient.len();
    let width = n + 2 * FILTER_MARGIN;
    let at = |row: usize, shift: usize| sums.get(row * width + shift..)?.get(..n);
    let five = [at(0, 0)?, at(0, 1)?, at(0, 2)?, at(0, 3)?, at(0, 4)?];
    let three = [at(1, 1)?, at(1, 2)?, at(1, 3)?];
    let halves = [at(2, 0)?, at(2, 1)?, at(2, 3)?, at(2, 4)?];
    let smooth = [at(3, 1)?, at(3, 3)?];
    let step = [at(4, 1)?, at(4, 2)?, at(4, 3)?];
    let (pixels, blob, corner) =
        (pixels.get(FILTER_MARGIN..)?.get(..n)?, blob.get_mut(..n)?, corner.get_mut(..n)?);
    // The kernels' extremes fit 16 bits: 16 x 255 for blobs, 8 x 255 for corners.
    for u in 0..n {
        let square = five[0][u] + five[1][u] + five[2][u] + five[3][u] + five[4][u];
        blob[u] = 2 * (three[0][u] + three[1][u] + three[2][u]) - square + 7 * i16::from(pixels[u]);
        corner[u] = halves[2][u] + halves[3][u] - halves[0][u] - halves[1][u];
        let along = (smooth[1][u] - smooth[0][u]) >> 2;
        let down = (step[0][u] + 2 * step[1][u] + step[2][u]) >> 2;
        // Bytes around 128, along the row in the low one.
        gradient[u] =
            (along.clamp(-127, 127) + 128) as u16 | ((down.clamp(-127, 127) + 128) as u16) << 8;
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::{vec, vec::Vec};

    #[test]
    fn equals_the_kernels_written_out_on_noise() {
        let (width, height) = (37, 23);
        let mut random = Random::new(1);
        let pixels: Vec<u8> = (0..width * height)
            .map(|_| if random.below(3) == 0 { 255 } else { random.below(256) as u8 })
            .collect();
        let image = View::new(&pixels, width, height).unwrap();
        let (mut gradient, mut blob, mut corner) =
            (vec![0; width * height], vec![0; width * height], vec![0; width * height]);
        let out = Responses { gradient: &mut gradient, blob: &mut blob, corner: &mut corner };
        filter(image, out, &mut vec![0; COLUMN_SUMS * width]);

        // The blob and corner filters of StereoScan, and Sobel's in the middle of 5 x 5.
        let blob_kernel = [
            [-1, -1, -1, -1, -1],
            [-1, 1, 1, 1, -1],
            [-1, 1, 8, 1, -1],
            [-1, 1, 1, 1, -1],
            [-1, -1, -1, -1, -1],
        ];
        let corner_kernel =
            [[-1, -1, 0, 1, 1], [-1, -1, 0, 1, 1], [0; 5], [1, 1, 0, -1, -1], [1, 1, 0, -1, -1]];
        let u_kernel = [[0; 5], [0, -1, 0, 1, 0], [0, -2, 0, 2, 0], [0, -1, 0, 1, 0], [0; 5]];
        let v_kernel = [[0; 5], [0, -1, -2, -1, 0], [0; 5], [0, 1, 2, 1, 0], [0; 5]];
        for v in 2..height - 2 {
            for u in 2..width - 2 {
                let apply = |kernel: [[i32; 5]; 5]| -> i32 {
                    let at = |i: usize| i32::from(pixels[(v + i / 5 - 2) * width + u + i % 5 - 2]);
                    (0..25).map(|i| kernel[i / 5][i % 5] * at(i)).sum()
                };
                // A quarter of Sobel's response, cut to 8 bits around 128.
                let byte = |kernel| ((apply(kernel) >> 2).clamp(-127, 127) + 128) as u16;
                let i = v * width + u;
                assert_eq!(i32::from(blob[i]), apply(blob_kernel));
                assert_eq!(i32::from(corner[i]), apply(corner_kernel));
                assert_eq!(gradient[i], byte(u_kernel) | byte(v_kernel) << 8);
            }
        }
    }

    #[test]
    fn leaves_images_below_five_pixels_flat() {
        let image = View::new(&[9u8; 16], 4, 4).unwrap();
        let (mut gradient, mut blob, mut corner) = ([1; 16], [1; 16], [1; 16]);
        filter(
            image,
            Responses { gradient: &mut gradient, blob: &mut blob, corner: &mut corner },
            &mut [0; 20],
        );
        assert_eq!((blob, corner, gradient), ([0; 16], [0; 16], [0x8080; 16]));
    }
}
