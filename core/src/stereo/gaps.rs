//! Small gaps between disparities are filled, along rows and then along columns, and marked so.
//!
//! If both ends are one surface the gap gets their mean. Otherwise it stays, or, as published, gets the farther one's disparity: what is
//! hidden from one camera is background. Memory: four bytes a column. Time: two walks over the image.

use super::{
    GapEnds,
    dense::{FILLED, NONE},
};

/// What fills a gap.
#[derive(Clone, Copy)]
pub(super) struct Filling {
    /// Widest gap, px.
    pub width: usize,
    /// Ends that differ by less are one surface, in the unit of the pixels.
    pub discontinuity: u16,
    /// What fills a gap between two surfaces.
    pub ends: GapEnds,
}

impl Filling {
    /// What fills a gap between two ends; `None` leaves it.
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

/// Fills the gaps of each row; returns the pixels filled.
pub(super) fn fill_rows(disparity: &mut [i16], width: usize, filling: Filling) -> u32 {
    let mut filled = 0;
    for row in disparity.chunks_exact_mut(width.max(1)) {
        let mut start = 0;
        // Runs of pixels with and without disparity take turns.
        while let Some(gap) = row.get(start..).and_then(|rest| rest.iter().position(|&d| d == NONE)).map(|i| start + i) {
            let Some(length) = row.get(gap..).and_then(|rest| rest.iter().position(|&d| d != NONE)) else { break };
            start = gap + length;
            if gap == 0 || length > filling.width {
                continue;
            }
            let (Some(&a), Some(&b)) = (row.get(gap - 1), row.get(start)) else { continue };
            if let (Some(value), Some(pixels)) = (filling.value(a, b), row.get_mut(gap..start)) {
                pixels.fill(value);
                filled += length as u32;
            }
        }
    }
    filled
}

/// Fills the gaps of each column; `last_row` has an entry a column. Returns the pixels filled.
///
/// Columns are walked side by side, row by row: an image is read as it lies in memory.
pub(super) fn fill_columns(disparity: &mut [i16], width: usize, filling: Filling, last_row: &mut [u32]) -> u32 {
    let Some(last_row) = last_row.get_mut(..width) else { return 0 };
    let never = u32::MAX;
    last_row.fill(never);
    let mut filled = 0;
    let width = width.max(1);
    for v in 0..disparity.len() / width {
        let (above, here) = disparity.split_at_mut_checked(v * width).unwrap_or_default();
        for (u, (&here, last)) in here.iter().zip(last_row.iter_mut()).enumerate() {
            if here == NONE {
                continue;
            }
            let last = core::mem::replace(last, v as u32);
            if last == never || last as usize + 1 == v || v - last as usize - 1 > filling.width {
                continue;
            }
            // This column of the rows above, from the last one with a disparity on.
            let mut column = above.get_mut(last as usize * width + u..).unwrap_or_default().iter_mut().step_by(width);
            let Some(value) = column.next().and_then(|end| filling.value(*end, here)) else { continue };
            for pixel in column {
                *pixel = value;
                filled += 1;
            }
        }
    }
    filled
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
        for (i, (width, height, none)) in [(40, 23, 2), (17, 60, 5), (1, 30, 3), (30, 1, 3)].repeat(6).into_iter().enumerate() {
            let ends = if i % 3 == 0 { GapEnds::Farther } else { GapEnds::Surface };
            let filling = Filling { width: random.below(9) as usize, discontinuity: 192, ends };
            let pixel = |random: &mut Random| if random.below(none) > 0 { NONE } else { random.below(500) as i16 };
            let image: Vec<i16> = (0..width * height).map(|_| pixel(&mut random)).collect();

            let mut rows = image.clone();
            let filled = fill_rows(&mut rows, width, filling);
            assert!(rows == image.chunks(width).flat_map(|row| plain(row, filling)).collect::<Vec<_>>());
            assert_eq!(filled as usize, image.iter().zip(&rows).filter(|(a, b)| a != b).count());

            let mut columns = rows.clone();
            fill_columns(&mut columns, width, filling, &mut vec![0; width]);
            for u in 0..width {
                let column = |image: &[i16]| image.iter().skip(u).step_by(width).copied().collect::<Vec<_>>();
                assert!(column(&columns) == plain(&column(&rows), filling));
            }
        }
    }

    #[test]
    fn one_surface_gets_the_mean_and_two_nothing_or_the_farther() {
        let filling = Filling { width: 3, discontinuity: 192, ends: GapEnds::Farther };
        let image = [640, NONE, NONE, 700, NONE, 100, NONE, NONE, NONE, NONE, 100, NONE];
        let [surface, farther] = [670, 100].map(|disparity| disparity | FILLED);
        let mut row = image;
        assert_eq!(fill_rows(&mut row, 12, filling), 3);
        assert_eq!(row, [640, surface, surface, 700, farther, 100, NONE, NONE, NONE, NONE, 100, NONE]);
        let mut row = image;
        assert_eq!(fill_rows(&mut row, 12, Filling { ends: GapEnds::Surface, ..filling }), 2);
        assert_eq!(row, [640, surface, surface, 700, NONE, 100, NONE, NONE, NONE, NONE, 100, NONE]);
    }
}
