//! Matched rows spread over an image, and the rows between them.
//!
//! Memory: none. Time: one walk over the image.

use super::{
    dense::{FILLED, NONE, WORKING_ONE_PX},
    rows::MatchedRows,
};
use crate::parallel::Work;

/// Largest difference of rows that have their mean between them, in working units; other pixels get
/// the farther disparity.
const SAME_SURFACE: u16 = 3 * WORKING_ONE_PX.unsigned_abs() / 2;

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
        let Self { image, width, rows: MatchedRows { step, count } } = self;
        if step < 2 {
            return;
        }
        // From the last row on, so that none is overwritten before it is read.
        for i in (0..count).rev() {
            let (matched, rest) = image.split_at_mut_checked((i + 1) * width).unwrap_or_default();
            let mut places = rest.get_mut(i * width..).unwrap_or_default().chunks_mut(width.max(1));
            let (Some(own), between) = (places.next(), places.next()) else { return };
            for (to, from) in own.iter_mut().zip(matched.iter().skip(i * width)) {
                *to = *from;
            }
            match (between, places.next()) {
                (Some(between), Some(next)) => fill_between(own, next, between),
                // Below the last matched row there is no descriptor.
                (Some(last), None) => last.fill(NONE),
                _ => (),
            }
        }
        if let Some(first) = image.get_mut(..width) {
            first.fill(NONE);
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
        *to = if up.abs_diff(down) <= SAME_SURFACE { mean } else { one };
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
