//! Matched rows spread over an image, and the rows between them.
//!
//! Memory: none. Time: one walk over the image.

use super::{
    dense::{FILLED, NONE, WORKING_ONE_PX},
    rows::MatchedRows,
};
use crate::parallel::Work;

/// Largest difference of rows two apart that have their mean between them, in working units; other
/// pixels get the farther disparity.
const SAME_SURFACE: i16 = 3 * WORKING_ONE_PX / 2;

/// Spreads matched rows, which lie one behind the other, over an image: in place.
pub(super) struct SpreadRows<'a> {
    /// The image, with the matched rows at its beginning.
    pub image: &'a mut [i16],
    /// Width of the image, px.
    pub width: usize,
    /// Rows that were matched.
    pub rows: MatchedRows,
}

impl Work for SpreadRows<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { image, width, rows } = self;
        let MatchedRows { step, count } = rows;
        if step < 2 {
            return;
        }
        // From the last row on, so that none is overwritten before it is read.
        for i in (0..count).rev() {
            let (matched, rest) = image.split_at_mut_checked((i + 1) * width).unwrap_or_default();
            let above = rows.row(i) - (i + 1);
            let rest = rest.get_mut(above * width..).unwrap_or_default();
            let Some((own, rest)) = rest.split_at_mut_checked(width) else { return };
            for (to, from) in own.iter_mut().zip(matched.iter().skip(i * width)) {
                *to = *from;
            }
            match rest.split_at_mut_checked((step - 1) * width) {
                Some((between, next)) if !next.is_empty() && rows.is_sparse() => {
                    fill_sparse(own, next, between, rows);
                }
                Some((between, next)) if !next.is_empty() => fill_between(own, next, between),
                // Below the last matched row there is no descriptor.
                _ => rest.fill(NONE),
            }
        }
        image.get_mut(..(step - 1) * width).unwrap_or_default().fill(NONE);
    }
}

/// Fills the rows between two others that lie farther apart than two: evenly from one to the other
/// where both are one surface. Elsewhere nothing is known of what lies between.
#[inline(always)]
fn fill_sparse(above: &[i16], below: &[i16], between: &mut [i16], rows: MatchedRows) {
    let (most, step) = (rows.widened(SAME_SURFACE).unsigned_abs(), (rows.step as i32).max(1));
    for (row, at) in between.chunks_exact_mut(above.len().max(1)).zip(1..) {
        for (to, (&a, &b)) in row.iter_mut().zip(above.iter().zip(below)) {
            let (up, down) = (a & !FILLED, b & !FILLED);
            let is_one = a != NONE && b != NONE && up.abs_diff(down) <= most;
            let even = i32::from(up) + (i32::from(down) - i32::from(up)) * at / step;
            *to = if is_one { even as i16 | FILLED } else { NONE };
        }
    }
}

/// Fills the row between two others: with their mean where both are one surface, else with the
/// farther disparity, or the only one.
#[inline(always)]
fn fill_between(above: &[i16], below: &[i16], out: &mut [i16]) {
    for (to, (&a, &b)) in out.iter_mut().zip(above.iter().zip(below)) {
        // NONE becomes the least number there is, which no disparity is near.
        let (up, down) = (a & !FILLED, b & !FILLED);
        let mean = up.wrapping_add(down.wrapping_sub(up) >> 1) | ((a | b) & FILLED);
        let is_above = (up < down) != ((a == NONE) | (b == NONE));
        let one = if is_above { a } else { b };
        *to = if up.abs_diff(down) <= SAME_SURFACE.unsigned_abs() { mean } else { one };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::{vec, vec::Vec};

    /// The twin: from a copy, pixel by pixel.
    fn plain(matched: &[i16], width: usize, height: usize) -> Vec<i16> {
        let at = |row: usize, u: usize| matched.get(row * width + u).copied();
        let pixel = |i: usize| {
            let (u, v) = (i % width, i / width);
            let (Some(row), true) = (v.checked_sub(1), v / 2 < height / 2 || v % 2 == 1) else {
                return NONE;
            };
            let (Some(a), Some(b)) = (at(row / 2, u), at(v / 2, u)) else { return NONE };
            let [up, down] = [a, b].map(|d| i32::from(d & !FILLED));
            match (a, b) {
                _ if v % 2 == 1 => a,
                (NONE, other) | (other, NONE) => other,
                _ if (up - down).abs() <= 96 => {
                    (up + down).div_euclid(2) as i16 | (a & FILLED) | (b & FILLED)
                }
                _ if up < down => a,
                _ => b,
            }
        };
        (0..width * height).map(pixel).collect()
    }

    #[test]
    fn rows_between_get_the_mean_of_a_surface_or_the_farther_disparity() {
        let mut random = Random::new(59);
        for (width, height) in [(1, 2), (7, 9), (40, 16), (33, 21)].repeat(6) {
            let rows = MatchedRows { step: 2, count: height / 2 };
            let mut image: Vec<i16> = (0..width * height)
                .map(|_| match random.below(5) {
                    0 => NONE,
                    1 => random.below(200) as i16 | FILLED,
                    2 => 255 * 64 - random.below(200) as i16,
                    _ => 100 + random.below(200) as i16,
                })
                .collect();
            let expected = plain(&image[..width * rows.count], width, height);
            SpreadRows { image: &mut image, width, rows }.run();
            assert_eq!(image, expected, "{width} x {height}");
        }
    }

    #[test]
    fn rows_far_apart_are_joined_where_they_are_one_surface() {
        let rows = MatchedRows { step: 4, count: 2 };
        // A slope of 0.5 px a row, a step of 4 px, a hole.
        let mut image = vec![640, 640, NONE, 768, 896, 640];
        image.extend([7; 3 * 10 - 6]);
        SpreadRows { image: &mut image, width: 3, rows }.run();
        let of = |v: usize| &image[3 * v..3 * v + 3];
        assert!([0, 1, 2, 8, 9].iter().all(|&v| of(v) == [NONE; 3]), "{image:?}");
        assert_eq!([of(3), of(7)], [[640, 640, NONE], [768, 896, 640]]);
        for (v, even) in [(4, 672), (5, 704), (6, 736)] {
            assert_eq!(of(v), [even | FILLED, NONE, NONE], "row {v}");
        }
    }

    #[test]
    fn a_row_is_spread_by_hand() {
        // Two rows: a slope, an edge, a hole, a filled pixel.
        let mut image = vec![100, 900, 300, 80, 150, 200, NONE, 81 | FILLED];
        image.extend([7; 12]);
        let rows = MatchedRows { step: 2, count: 2 };
        SpreadRows { image: &mut image, width: 4, rows }.run();
        let between = [125, 200, 300, 80 | FILLED];
        assert_eq!(image[..4], [NONE; 4], "nothing lies above the first row");
        assert_eq!(image[4..8], [100, 900, 300, 80]);
        assert_eq!(image[8..12], between);
        assert_eq!(image[12..16], [150, 200, NONE, 81 | FILLED]);
        assert_eq!(image[16..], [NONE; 4], "nothing lies below the last one");
    }
}
