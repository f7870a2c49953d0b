//! Smoothing: an edge-preserving mean, and a median as an option.
//!
//! The adaptive mean averages nine pixels along the row, then nine along the column, each weighted
//! by how near its disparity is to the centre's: from full weight when equal to none at 4 px. All
//! in 16-bit integers, but for one division per pixel in `f32`, whose operands are integers below
//! 2^15 and which is therefore the same everywhere.

use crate::{
    geometry::scalar::rounded_i32,
    parallel::Work,
    slices::{clipped, clipped_mut},
};

use super::dense::NONE;

/// Pixels to each side.
const REACH: usize = 4;
/// Differences are in 1/64 px; from here on a pixel has no weight. A little below 4 px, so that
/// eight products stay within `i16`.
const CUT: i16 = 252;

/// Pixels worked on at once: their sums stay in the nearest cache.
const BLOCK: usize = 256;

/// The eight other pixels of each window.
type Taps<'a> = [&'a [i16]; 2 * REACH];

/// The weighted mean of each centre and its taps. Centre, taps and `to` are of one length.
///
/// For a block of pixels the sums first and then their quotients, which are twice as wide: each
/// loop has vectors of its own.
#[inline(always)]
fn mean(centre: &[i16], taps: Taps<'_>, to: &mut [i16]) {
    for (block, (centre, to)) in centre.chunks(BLOCK).zip(to.chunks_mut(BLOCK)).enumerate() {
        let (mut numerators, mut denominators) = ([0; BLOCK], [0; BLOCK]);
        let [a, b, c, d, e, f, g, h] = taps.map(|tap| clipped(tap, block * BLOCK..));
        let taps = a.iter().zip(b).zip(c.iter().zip(d)).zip(e.iter().zip(f).zip(g.iter().zip(h)));
        let sums = numerators.iter_mut().zip(&mut denominators);
        for ((numerator, denominator), (&centre, (((a, b), (c, d)), ((e, f), (g, h))))) in
            sums.zip(centre.iter().zip(taps))
        {
            // At most 8 x 31 x 126 = 31,248 in the numerator; the centre alone makes the
            // denominator 63.
            (*numerator, *denominator) = (0i16, CUT >> 2);
            for tap in [a, b, c, d, e, f, g, h] {
                // Against NONE, and between what was measured and what was filled in, the
                // difference is so large that nothing is left of the weight.
                let difference = tap.saturating_sub(centre);
                let weight = (CUT - difference.max(difference.saturating_neg()).min(CUT)) >> 2;
                *numerator = numerator.wrapping_add(weight.wrapping_mul(difference));
                *denominator = denominator.wrapping_add(weight);
            }
        }
        for ((to, &centre), (&numerator, &denominator)) in
            to.iter_mut().zip(centre).zip(numerators.iter().zip(&denominators))
        {
            let offset = rounded_i32(f32::from(numerator) / f32::from(denominator)) as i16;
            *to = if centre == NONE { NONE } else { centre.wrapping_add(offset) };
        }
    }
}

/// Direction of a window's pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Along {
    Rows,
    Columns,
}

/// Smooths rows `to` of the image `from`, from row `first` on. Pixels nearer than four to an end of
/// their row or column stay as they are.
pub(super) struct Smooth<'a> {
    pub from: &'a [i16],
    pub width: usize,
    pub along: Along,
    pub first: usize,
    pub to: &'a mut [i16],
}

impl Work for Smooth<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { from, width, along, first, to } = self;
        let width = width.max(1);
        let inner_rows = REACH..(from.len() / width).saturating_sub(REACH);
        for (v, to) in (first..).zip(to.chunks_exact_mut(width)) {
            let row = v * width;
            // Near the border the window does not fit: those pixels keep their values.
            to.iter_mut().zip(clipped(from, row..row + width)).for_each(|(to, from)| *to = *from);
            let (inner, stride) = match along {
                Along::Rows => (REACH..width.saturating_sub(REACH), 1),
                Along::Columns => (if inner_rows.contains(&v) { 0..width } else { 0..0 }, width),
            };
            if inner.is_empty() {
                continue;
            }
            let pixels = |first: usize| clipped(from, first..first + inner.len());
            let centre = row + inner.start;
            let taps = window().map(|k| pixels(centre + k * stride - REACH * stride));
            mean(pixels(centre), taps, clipped_mut(to, inner.clone()));
        }
    }
}

/// Places in the window but the centre.
fn window() -> [usize; 2 * REACH] {
    core::array::from_fn(|k| if k < REACH { k } else { k + 1 })
}

#[cfg(test)]
mod tests {
    use super::super::dense::FILLED;
    use super::*;
    use crate::random::Random;
    use std::{vec, vec::Vec};

    /// The twin: wide integers, one pixel at a time; division rounds halves to even.
    fn plain(image: &[i16], step: usize, at: usize, i: usize, length: usize) -> i16 {
        if at < REACH || at + REACH >= length || image[i] == NONE {
            return image[i];
        }
        let (mut numerator, mut denominator) = (0i64, 0i64);
        for k in 0..=2 * REACH {
            let difference = i64::from(image[i + k * step - REACH * step]) - i64::from(image[i]);
            let weight = (i64::from(CUT) - difference.abs().min(i64::from(CUT))) / 4;
            numerator += weight * difference;
            denominator += weight;
        }
        let (quotient, rest) =
            (numerator.div_euclid(denominator), numerator.rem_euclid(denominator));
        // Halves go to the even number.
        let up = 2 * rest > denominator || (2 * rest == denominator && quotient % 2 != 0);
        image[i] + (quotient + i64::from(up)) as i16
    }

    #[test]
    fn equals_wide_integers_on_edges_holes_and_noise() {
        let mut random = Random::new(41);
        for (width, height) in [(37, 21), (8, 8), (9, 9), (64, 5)].repeat(5) {
            // Three surfaces in columns of 7 px, the last one at the largest disparity.
            let base = [0, 40 * 64, 255 * 64 - 400];
            let image: Vec<i16> = (0..width * height)
                .map(|i| match random.below(9) {
                    0 => NONE,
                    1 => (base[i % width / 7 % 3] + random.below(400) as i16) | FILLED,
                    _ => base[i % width / 7 % 3] + random.below(400) as i16,
                })
                .collect();
            let mut rows = vec![0; image.len()];
            Smooth { from: &image, width, along: Along::Rows, first: 0, to: &mut rows }.run();
            let mut columns = vec![0; image.len()];
            Smooth { from: &image, width, along: Along::Columns, first: 0, to: &mut columns }.run();
            for i in 0..image.len() {
                let (u, v) = (i % width, i / width);
                assert_eq!(rows[i], plain(&image, 1, u, i, width));
                assert_eq!(columns[i], plain(&image, width, v, i, height));
            }
        }
    }

    #[test]
    fn the_extremes_of_a_step_do_not_overflow() {
        for difference in -600..=600i16 {
            let mut row = [8_000 + difference; 9];
            row[4] = 8_000;
            let mut out = [0; 9];
            Smooth { from: &row, width: 9, along: Along::Rows, first: 0, to: &mut out }.run();
            assert!((out[4] - 8_000).abs() <= difference.abs(), "{difference}: {}", out[4]);
            assert_eq!(out[4], plain(&row, 1, 4, 4, 9));
        }
    }
}
