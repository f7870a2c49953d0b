//! Small gaps between disparities are filled, along rows and then along columns, and marked so.
//!
//! If both ends are one surface the gap gets their mean. Otherwise it stays, or, as published, gets
//! the farther one's disparity: what is hidden from one camera is background. Memory: four bytes a
//! column. Time: two walks over the image.

use super::{
    GapEnds, MAX_IMAGE_SIZE,
    dense::{FILLED, NONE},
    rows::MatchedRows,
};
use crate::{
    flags::for_each_set,
    parallel::Work,
    slices::{clipped, clipped_mut},
};
use core::ops::Range;

/// Rules for filling a gap.
#[derive(Clone, Copy)]
pub(super) struct Filling {
    /// Widest gap, px.
    pub width: usize,
    /// Ends that differ by less are one surface, in the unit of the pixels.
    pub discontinuity: u16,
    /// Content of a gap between two surfaces.
    pub ends: GapEnds,
    /// Rows of the image that there are.
    pub rows: MatchedRows,
}

impl Filling {
    /// Returns the disparity that fills a gap between two ends; `None` leaves it.
    #[inline(always)]
    fn value(self, a: i16, b: i16) -> Option<i16> {
        // A gap along a column may end at what was filled along a row.
        let (a, b) = (a & !FILLED, b & !FILLED);
        // Both are disparities, at most 255 x 64: their sum fits.
        match self.ends {
            _ if a.abs_diff(b) < self.discontinuity => Some(((a + b) / 2) | FILLED),
            GapEnds::Surface => None,
            GapEnds::Farther => Some(a.min(b) | FILLED),
        }
    }
}

/// Fills the gaps of each of the rows, `width` pixels each; `edges` has a byte a column. Returns
/// the pixels filled.
pub(super) struct FillRows<'a> {
    pub rows: &'a mut [i16],
    pub width: usize,
    pub filling: Filling,
    pub edges: &'a mut [u8],
}

impl Work for FillRows<'_> {
    type Output = u32;

    #[inline(always)]
    fn run(self) -> u32 {
        let Self { rows, width, filling, edges } = self;
        let mut filled = 0;
        let width = width.max(1);
        let edges = clipped_mut(edges, ..width - 1);
        for row in rows.chunks_exact_mut(width) {
            // Edges between pixels with and without disparity take turns: a gap lies between two of
            // them.
            for (edge, (&a, &b)) in edges.iter_mut().zip(row.iter().zip(clipped(row, 1..))) {
                *edge = u8::from((a == NONE) != (b == NONE));
            }
            let mut start = None;
            for_each_set(edges, |before| {
                // A row that begins without disparity has a gap with one end only, which stays
                // open.
                start = match start {
                    None if row.get(before).is_some_and(|&d| d == NONE) => None,
                    None => Some(before + 1),
                    Some(gap) => {
                        filled += fill_gap(row, gap..before + 1, filling);
                        None
                    }
                };
            });
        }
        filled
    }
}

/// Fills a gap between two pixels of a row, if it is to be; returns the pixels filled.
#[inline(always)]
fn fill_gap(row: &mut [i16], gap: Range<usize>, filling: Filling) -> u32 {
    let length = gap.len();
    if length > filling.width {
        return 0;
    }
    let (Some(&a), Some(&b)) = (row.get(gap.start - 1), row.get(gap.end)) else { return 0 };
    match (filling.value(a, b), row.get_mut(gap)) {
        (Some(value), Some(pixels)) => {
            pixels.fill(value);
            length as u32
        }
        _ => 0,
    }
}

/// No row: farther from every row than the widest gap.
const NEVER: u16 = 1 << 15;
const _: () = assert!(2 * MAX_IMAGE_SIZE <= NEVER as usize);

/// Fills the gaps of each column of an image; `last_row` and `ends` have an entry a column. Returns
/// the pixels filled.
///
/// Columns are walked side by side, row by row: an image is read as it lies in memory.
pub(super) struct FillColumns<'a> {
    pub image: &'a mut [i16],
    pub width: usize,
    pub filling: Filling,
    pub last_row: &'a mut [u16],
    pub ends: &'a mut [u8],
}

impl Work for FillColumns<'_> {
    type Output = u32;

    #[inline(always)]
    fn run(self) -> u32 {
        let Self { image, width, filling, last_row, ends } = self;
        let (Some(last_row), Some(ends)) = (last_row.get_mut(..width), ends.get_mut(..width))
        else {
            return 0;
        };
        // Rows are walked once: each column remembers its last row with a disparity.
        last_row.fill(NEVER);
        let mut filled = 0;
        let (width, widest) = (width.max(1), (filling.width / filling.rows.step.max(1)) as u16);
        for v in 0..image.len() / width {
            let (above, here) = image.split_at_mut_checked(v * width).unwrap_or_default();
            for ((end, &last), &here) in ends.iter_mut().zip(&*last_row).zip(&*here) {
                // No gap is one of 0 px: less one that wraps to the most there can be.
                let gap = (v as u16).wrapping_sub(last).wrapping_sub(1);
                *end = u8::from(here != NONE) & u8::from(gap.wrapping_sub(1) < widest);
            }
            for_each_set(ends, |u| {
                let (Some(&last), Some(&end)) = (last_row.get(u), here.get(u)) else { return };
                // This column of the rows above, from the last one with a disparity on.
                let mut column = above
                    .get_mut(usize::from(last) * width + u..)
                    .unwrap_or_default()
                    .iter_mut()
                    .step_by(width);
                let Some(value) = column.next().and_then(|start| filling.value(*start, end)) else {
                    return;
                };
                for pixel in column {
                    *pixel = value;
                    filled += 1;
                }
            });
            // This row becomes the upper end of the gaps below it.
            for (last, &here) in last_row.iter_mut().zip(&*here) {
                *last = if here == NONE { *last } else { v as u16 };
            }
        }
        filled
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::{vec, vec::Vec};

    /// The twin, on one line.
    fn plain(line: &[i16], filling: Filling) -> Vec<i16> {
        let mut out = line.to_vec();
        let known: Vec<usize> = (0..line.len()).filter(|&i| line[i] != NONE).collect();
        for ends in known.windows(2).filter(|ends| ends[1] - ends[0] - 1 <= filling.width) {
            let (a, b) = (line[ends[0]] & !FILLED, line[ends[1]] & !FILLED);
            let far = (i32::from(a) - i32::from(b)).abs() >= i32::from(filling.discontinuity);
            if !far || filling.ends == GapEnds::Farther {
                out[ends[0] + 1..ends[1]].fill(FILLED | if far { a.min(b) } else { (a + b) / 2 });
            }
        }
        out
    }

    #[test]
    fn rows_and_columns_equal_their_plain_twin() {
        let mut random = Random::new(31);
        // Rows of one pixel, columns of one pixel, and usual images; with few holes and with many.
        for (i, (width, height, none)) in
            [(40, 23, 2), (17, 60, 5), (1, 30, 3), (30, 1, 3)].repeat(6).into_iter().enumerate()
        {
            let ends = if i % 3 == 0 { GapEnds::Farther } else { GapEnds::Surface };
            let rows = MatchedRows { step: 1, count: height };
            let filling =
                Filling { width: random.below(9) as usize, discontinuity: 192, ends, rows };
            let pixel = |random: &mut Random| {
                if random.below(none) > 0 { NONE } else { random.below(500) as i16 }
            };
            let image: Vec<i16> = (0..width * height).map(|_| pixel(&mut random)).collect();

            let mut rows = image.clone();
            let filled =
                FillRows { rows: &mut rows, width, filling, edges: &mut vec![0; width] }.run();
            assert!(
                rows == image.chunks(width).flat_map(|row| plain(row, filling)).collect::<Vec<_>>()
            );
            assert_eq!(filled as usize, image.iter().zip(&rows).filter(|(a, b)| a != b).count());

            // The columns are filled after the rows, as the matcher does it.
            let mut columns = rows.clone();
            FillColumns {
                image: &mut columns,
                width,
                filling,
                last_row: &mut vec![0; width],
                ends: &mut vec![0; width],
            }
            .run();
            for u in 0..width {
                let column = |image: &[i16]| {
                    image.iter().skip(u).step_by(width).copied().collect::<Vec<_>>()
                };
                assert!(column(&columns) == plain(&column(&rows), filling));
            }
        }
    }

    #[test]
    fn one_surface_gets_the_mean_and_two_nothing_or_the_farther() {
        // 640 and 700 differ by less than the discontinuity and are one surface; 700 and 100 are
        // two.
        let rows = MatchedRows { step: 1, count: 1 };
        let filling = Filling { width: 3, discontinuity: 192, ends: GapEnds::Farther, rows };
        // Gaps of two, of one, of four, and one that reaches the end.
        let image = [640, NONE, NONE, 700, NONE, 100, NONE, NONE, NONE, NONE, 100, NONE];
        let [surface, farther] = [670, 100].map(|disparity| disparity | FILLED);
        let fill = |rows: &mut [i16], ends| {
            FillRows { rows, width: 12, filling: Filling { ends, ..filling }, edges: &mut [0; 12] }
                .run()
        };
        let mut row = image;
        assert_eq!(fill(&mut row, GapEnds::Farther), 3);
        assert_eq!(
            row,
            [640, surface, surface, 700, farther, 100, NONE, NONE, NONE, NONE, 100, NONE]
        );
        let mut row = image;
        assert_eq!(fill(&mut row, GapEnds::Surface), 2);
        assert_eq!(row, [640, surface, surface, 700, NONE, 100, NONE, NONE, NONE, NONE, 100, NONE]);
    }

    #[test]
    fn a_gap_along_a_column_is_as_wide_as_its_rows_of_the_image() {
        let gap = |step: usize, width: usize| {
            let rows = MatchedRows { step, count: 5 };
            let filling = Filling { width, discontinuity: 192, ends: GapEnds::Surface, rows };
            let mut image = [640, NONE, NONE, NONE, 700];
            FillColumns { image: &mut image, width: 1, filling, last_row: &mut [0], ends: &mut [0] }
                .run()
        };
        assert_eq!([gap(1, 2), gap(1, 3)], [0, 3]);
        assert_eq!([gap(2, 5), gap(2, 6)], [0, 3], "three of every second row span five to seven");
    }
}
