//! Confidence of each pixel's disparity: how many of the pixels about it were measured.
//!
//! What both images agree on is dense where a surface can be matched, and sparse where planes,
//! gaps and chance made it up: the number of measured pixels, neither filled in nor without a
//! disparity, in the 16 x 16 about a pixel tells wrong disparities from right ones better than
//! costs, margins and texture (docs/decisions/0106-confidence-by-density.md). Pixels at the rim
//! have fewer about them, and less confidence.
//!
//! Memory: that of the gradients, which are done with. Time: one walk over the image, in integers.

use crate::{
    image::DisparityQ8,
    parallel::Work,
    slices::{clipped, padded},
};

/// Side of the window, px: it has 256 pixels. A power of two, so that sums double.
const SIDE: usize = 16;
/// Pixels of the window above and left of its own.
const BEFORE: usize = SIDE / 2;
/// Pixels of a row worked on at once.
const BLOCK: usize = 64;
/// Columns of their windows.
const AROUND: usize = BLOCK + SIDE;

/// Measures the confidences of rows `first..` of an image, as many as `out` holds: 0 where there
/// is no disparity, else one more than the number of measured pixels about it, at most 255.
pub(super) struct MeasureConfidence<'a> {
    /// Disparities of the image, 1/256 px, 0 none.
    pub disparity_q8: &'a [u16],
    pub width: usize,
    pub first: usize,
    /// A byte a column: measured pixels of each column of the window.
    pub counts: &'a mut [u8],
    pub out: &'a mut [u8],
}

impl Work for MeasureConfidence<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { disparity_q8, width, first, counts, out } = self;
        let width = width.max(1);
        let (height, Some(counts)) = (disparity_q8.len() / width, counts.get_mut(..width)) else {
            return;
        };
        let row = |v: usize| clipped(disparity_q8, v * width..(v + 1) * width);
        counts.fill(0);
        // The window of the first row, without the row that each one adds.
        for v in first.saturating_sub(BEFORE)..height.min(first + BEFORE - 1) {
            count(counts, row(v), |count, measured| count + measured);
        }
        for (v, out) in (first..height).zip(out.chunks_exact_mut(width)) {
            let next = v + BEFORE - 1;
            if next < height {
                count(counts, row(next), |count, measured| count + measured);
            }
            measure_row(row(v), counts, out);
            if let Some(last) = v.checked_sub(BEFORE) {
                count(counts, row(last), |count, measured| count - measured);
            }
        }
    }
}

/// Updates the counts of columns by the measured pixels of a row.
#[inline(always)]
fn count(counts: &mut [u8], row: &[u16], update: impl Fn(u8, u8) -> u8) {
    for (count, &disparity) in counts.iter_mut().zip(row) {
        let disparity = DisparityQ8::new(disparity);
        *count = update(*count, u8::from(disparity.is_known() & !disparity.is_filled()));
    }
}

/// Confidences of a row from the counts of its window's columns.
#[inline(always)]
fn measure_row(row: &[u16], counts: &[u8], out: &mut [u8]) {
    for ((start, row), out) in
        (0usize..).step_by(BLOCK).zip(row.chunks(BLOCK)).zip(out.chunks_mut(BLOCK))
    {
        let skip = BEFORE - BEFORE.min(start);
        let around: [u8; AROUND] = padded(counts, start.saturating_sub(BEFORE), skip, 0);
        // Sums of 2, 4, 8 and 16 columns from each one on; at most 256.
        let mut sums = around.map(u16::from);
        double::<1>(&mut sums);
        double::<2>(&mut sums);
        double::<4>(&mut sums);
        double::<8>(&mut sums);
        for (out, (&sum, &disparity)) in out.iter_mut().zip(sums.iter().zip(row)) {
            let sum = if sum < 254 { sum } else { 254 };
            *out = if disparity == 0 { 0 } else { sum as u8 + 1 };
        }
    }
}

/// Adds to each sum the one `STEP` columns on.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "the loop ends STEP before the end")]
fn double<const STEP: usize>(sums: &mut [u16; AROUND]) {
    for i in 0..AROUND - STEP {
        sums[i] += sums[i + STEP];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::{vec, vec::Vec};

    /// The twin: each pixel by itself.
    fn plain(disparity: &[u16], width: usize, i: usize) -> u8 {
        let (u, v) = ((i % width) as i32, (i / width) as i32);
        let window = (v - 8..v + 8).flat_map(|y| (u - 8..u + 8).map(move |x| (x, y)));
        let inside = window.filter(|&(x, _)| (0..width as i32).contains(&x));
        let measured = inside
            .filter_map(|(x, y)| disparity.get(usize::try_from(y * width as i32 + x).ok()?))
            .filter(|&&d| d > 0 && d % 2 == 0)
            .count();
        if disparity[i] == 0 { 0 } else { measured.min(254) as u8 + 1 }
    }

    #[test]
    fn equals_counting_the_pixels_of_each_window_in_any_bands() {
        let mut random = Random::new(71);
        for (width, height) in [(1, 1), (5, 40), (16, 16), (64, 20), (130, 33), (200, 9)] {
            for none in [0, 2, 9] {
                let disparity: Vec<u16> = (0..width * height)
                    .map(|_| if random.below(10) < none { 0 } else { random.below(999) as u16 })
                    .collect();
                for rows in [height, 1, 7] {
                    let (mut counts, mut out) = (vec![9; width], vec![9; disparity.len()]);
                    for (i, out) in out.chunks_mut(rows * width).enumerate() {
                        let (first, counts) = (i * rows, &mut counts[..]);
                        let disparity_q8 = &disparity;
                        MeasureConfidence { disparity_q8, width, first, counts, out }.run();
                    }
                    for (i, &found) in out.iter().enumerate() {
                        assert_eq!(found, plain(&disparity, width, i), "{i} of {width}");
                    }
                }
            }
        }
    }
}
