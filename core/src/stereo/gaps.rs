//! Small gaps between disparities are filled, along rows and then along columns.
//!
//! If both ends are one surface the gap gets their mean, otherwise the farther one's disparity: what is hidden from one camera is background.
//! Memory: four bytes a column. Time: two walks over the image.

use super::dense::NONE;

/// What fills a gap.
#[derive(Clone, Copy)]
pub(super) struct Filling {
    /// Widest gap, px.
    pub width: usize,
    /// Ends that differ by less are one surface, in the unit of the pixels.
    pub discontinuity: u16,
}

impl Filling {
    fn value(self, a: i16, b: i16) -> i16 {
        // Both are disparities, at most 255 x 64: their sum fits.
        if a.abs_diff(b) < self.discontinuity { (a + b) / 2 } else { a.min(b) }
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
            if gap > 0 && length <= filling.width {
                let ends = (row.get(gap - 1).copied(), row.get(start).copied());
                if let ((Some(a), Some(b)), Some(pixels)) = (ends, row.get_mut(gap..start)) {
                    pixels.fill(filling.value(a, b));
                    filled += length as u32;
                }
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
            let Some(end) = column.next() else { continue };
            let value = filling.value(*end, here);
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
            out[ends[0] + 1..ends[1]].fill(filling.value(line[ends[0]], line[ends[1]]));
        }
        out
    }

    #[test]
    fn rows_and_columns_equal_their_plain_twin() {
        let mut random = Random::new(31);
        for (width, height, none) in [(40, 23, 2), (17, 60, 5), (1, 30, 3), (30, 1, 3)].repeat(6) {
            let filling = Filling { width: random.below(9) as usize, discontinuity: 192 };
            let pixel = |random: &mut Random| if random.below(none) > 0 { NONE } else { random.below(500) as i16 };
            let image: Vec<i16> = (0..width * height).map(|_| pixel(&mut random)).collect();

            let mut rows = image.clone();
            let filled = fill_rows(&mut rows, width, filling);
            assert!(rows == image.chunks(width).flat_map(|row| plain(row, filling)).collect::<Vec<_>>());
            assert_eq!(filled as usize, image.iter().zip(&rows).filter(|(a, b)| a != b).count());

            let mut columns = image.clone();
            fill_columns(&mut columns, width, filling, &mut vec![0; width]);
            for u in 0..width {
                let column = |image: &[i16]| image.iter().skip(u).step_by(width).copied().collect::<Vec<_>>();
                assert!(column(&columns) == plain(&column(&image), filling));
            }
        }
    }

    #[test]
    fn one_surface_gets_the_mean_and_two_the_farther() {
        let filling = Filling { width: 3, discontinuity: 192 };
        let mut row = [640, NONE, NONE, 700, NONE, 100, NONE, NONE, NONE, NONE, 100, NONE];
        assert_eq!(fill_rows(&mut row, 12, filling), 3);
        assert_eq!(row, [640, 670, 670, 700, 100, 100, NONE, NONE, NONE, NONE, 100, NONE]);
    }
}
