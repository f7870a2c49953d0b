//! Smoothing: an edge-preserving mean, and a median as an option.
//!
//! The adaptive mean averages nine pixels along the row, then nine along the column, each weighted by how near its disparity is to the
//! centre's: from full weight when equal to none at 4 px. All in 16-bit integers, but for one division per pixel in `f32`, whose operands
//! are integers below 2^15 and which is therefore the same everywhere.

use super::dense::NONE;

/// Pixels to each side.
const REACH: usize = 4;
/// Differences are in 1/64 px; from here on a pixel has no weight. A little below 4 px, so that eight products stay within `i16`.
const CUT: i16 = 252;

/// The weighted mean of `taps` about `centre`. At most 8 x 31 x 126 = 31,248 in the numerator; the centre alone makes the denominator 63.
#[inline(always)]
fn mean(centre: i16, taps: [i16; 2 * REACH + 1]) -> i16 {
    let (mut numerator, mut denominator) = (0i16, 0i16);
    for tap in taps {
        // Against NONE the difference is at most 2^15 - 64: no overflow, no weight.
        let difference = tap.wrapping_sub(centre);
        let weight = (CUT - difference.wrapping_abs().min(CUT)) >> 2;
        numerator = numerator.wrapping_add(weight.wrapping_mul(difference));
        denominator = denominator.wrapping_add(weight);
    }
    // Rounded to the nearest by truncating a positive number.
    let offset = (f32::from(numerator) / f32::from(denominator) + 512.5) as i32 - 512;
    if centre == NONE { NONE } else { centre.wrapping_add(offset as i16) }
}

/// Smooths along the rows of `from` into `to`.
#[expect(clippy::indexing_slicing, reason = "each of the nine slices is cut to n = width - 8 items, and i < n")]
pub(super) fn mean_along_rows(from: &[i16], width: usize, to: &mut [i16]) {
    for (from, to) in from.chunks_exact(width).zip(to.chunks_exact_mut(width)) {
        to.copy_from_slice(from);
        let Some(n) = width.checked_sub(2 * REACH) else { continue };
        let taps: [&[i16]; 2 * REACH + 1] = core::array::from_fn(|k| &from[k..][..n]);
        for (i, to) in to[REACH..][..n].iter_mut().enumerate() {
            *to = mean(taps[REACH][i], taps.map(|tap| tap[i]));
        }
    }
}

/// Smooths along the columns of `from`, whose row `first` is the first one of `to`.
#[expect(clippy::indexing_slicing, reason = "rows first + i - 4 ..= first + i + 4 are in the image, each cut to its width")]
pub(super) fn mean_along_columns(from: &[i16], width: usize, first: usize, to: &mut [i16]) {
    let height = from.len() / width;
    for (i, to) in to.chunks_exact_mut(width).enumerate() {
        let v = first + i;
        if v < REACH || v + REACH >= height {
            to.copy_from_slice(&from[v * width..][..width]);
            continue;
        }
        let taps: [&[i16]; 2 * REACH + 1] = core::array::from_fn(|k| &from[(v + k - REACH) * width..][..width]);
        for (u, to) in to.iter_mut().enumerate() {
            *to = mean(taps[REACH][u], taps.map(|tap| tap[u]));
        }
    }
}
