//! Smoothing: an edge-preserving mean, and a median as an option.
//!
//! The adaptive mean averages nine pixels along the row, then nine along the column, each weighted by how near its disparity is to the
//! centre's: from full weight when equal to none at 4 px. All in 16-bit integers, but for one division per pixel in `f32`, whose operands
//! are integers below 2^15 and which is therefore the same everywhere.

use crate::part::part;

use super::dense::NONE;

/// Pixels to each side.
const REACH: usize = 4;
/// Differences are in 1/64 px; from here on a pixel has no weight. A little below 4 px, so that eight products stay within `i16`.
const CUT: i16 = 252;

/// Pixels worked on at once: their sums stay in the nearest cache.
const BLOCK: usize = 256;

/// The eight other pixels of each window.
type Taps<'a> = [&'a [i16]; 2 * REACH];

/// The weighted mean of each centre and its taps. Centre, taps and `to` are of one length.
///
/// One tap after the other for a block of pixels, so that each loop is short and runs on vectors.
fn mean(centre: &[i16], taps: Taps<'_>, to: &mut [i16]) {
    for (block, (centre, to)) in centre.chunks(BLOCK).zip(to.chunks_mut(BLOCK)).enumerate() {
        // At most 8 x 31 x 126 = 31,248 in the numerator; the centre alone makes the denominator 63.
        let (mut numerators, mut denominators) = ([0i16; BLOCK], [CUT >> 2; BLOCK]);
        for tap in taps {
            let tap = part(tap, block * BLOCK..);
            let sums = numerators.iter_mut().zip(&mut denominators);
            for ((numerator, denominator), (&tap, &centre)) in sums.zip(tap.iter().zip(centre)) {
                // Against NONE, and between what was measured and what was filled in, the difference is so large that nothing is left of the
                // weight.
                let difference = tap.saturating_sub(centre);
                let weight = (CUT - difference.max(difference.saturating_neg()).min(CUT)) >> 2;
                *numerator = numerator.wrapping_add(weight.wrapping_mul(difference));
                *denominator = denominator.wrapping_add(weight);
            }
        }
        for ((to, &centre), (&numerator, &denominator)) in to.iter_mut().zip(centre).zip(numerators.iter().zip(&denominators)) {
            // Adding 1.5 x 2^23 rounds to the nearest integer, halves to even, and leaves it in the low bits: no conversion, no check.
            let rounded = f32::from(numerator) / f32::from(denominator) + 12_582_912.0;
            let offset = rounded.to_bits() as i16;
            *to = if centre == NONE { NONE } else { centre.wrapping_add(offset) };
        }
    }
}

/// Smooths along the rows of `from` into `to`. Pixels nearer than four to an end stay as they are.
pub(super) fn mean_along_rows(from: &[i16], width: usize, to: &mut [i16]) {
    let width = width.max(1);
    for (from, to) in from.chunks_exact(width).zip(to.chunks_exact_mut(width)) {
        to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
        let n = width.saturating_sub(2 * REACH);
        let taps = window().map(|k| from.get(k..).and_then(|tap| tap.get(..n)).unwrap_or(&[]));
        if let (Some(centre), Some(to)) = (from.get(REACH..), to.get_mut(REACH..)) {
            mean(part(centre, ..n), taps, to.get_mut(..n).unwrap_or_default());
        }
    }
}

/// Smooths along the columns of `from`, whose row `first` is the first one of `to`.
pub(super) fn mean_along_columns(from: &[i16], width: usize, first: usize, to: &mut [i16]) {
    let width = width.max(1);
    let height = from.len() / width;
    for (v, to) in (first..).zip(to.chunks_exact_mut(width)) {
        let row = |v: usize| from.get(v * width..).and_then(|row| row.get(..width)).unwrap_or(&[]);
        if v < REACH || v + REACH >= height {
            to.iter_mut().zip(row(v)).for_each(|(to, from)| *to = *from);
        } else {
            mean(row(v), window().map(|k| row(v + k - REACH)), to);
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
        let (quotient, rest) = (numerator.div_euclid(denominator), numerator.rem_euclid(denominator));
        let up = 2 * rest > denominator || (2 * rest == denominator && quotient % 2 != 0);
        image[i] + (quotient + i64::from(up)) as i16
    }

    #[test]
    fn equals_wide_integers_on_edges_holes_and_noise() {
        let mut random = Random::new(41);
        for (width, height) in [(37, 21), (8, 8), (9, 9), (64, 5)].repeat(5) {
            let base = [0, 40 * 64, 255 * 64 - 400];
            let image: Vec<i16> = (0..width * height)
                .map(|i| match random.below(9) {
                    0 => NONE,
                    1 => (base[i % width / 7 % 3] + random.below(400) as i16) | FILLED,
                    _ => base[i % width / 7 % 3] + random.below(400) as i16,
                })
                .collect();
            let mut rows = vec![0; image.len()];
            mean_along_rows(&image, width, &mut rows);
            let mut columns = vec![0; image.len()];
            mean_along_columns(&image, width, 0, &mut columns);
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
            mean_along_rows(&row, 9, &mut out);
            assert!((out[4] - 8_000).abs() <= difference.abs(), "{difference}: {}", out[4]);
            assert_eq!(out[4], plain(&row, 1, 4, 4, 9));
        }
    }
}
