//! Images cut into four bands of rows, at places that depend on their height alone.

use crate::executor::{Executor, join4};

/// First rows of the four bands, and the end.
#[derive(Clone, Copy)]
pub(super) struct Bands([usize; 5]);

impl Bands {
    /// Cuts `rows` rows.
    pub fn of(rows: usize) -> Self {
        Self([0, rows / 4, rows / 2, rows / 2 + rows / 4, rows])
    }

    /// First row of each band.
    pub fn first(self) -> [usize; 4] {
        let [a, b, c, d, _] = self.0;
        [a, b, c, d]
    }

    /// The bands of an image whose rows are `stride` items.
    pub fn split<T>(self, image: &mut [T], stride: usize) -> [&mut [T]; 4] {
        let [_, b, c, d, end] = self.0.map(|row| row * stride);
        let (image, _) = halves(image, end);
        let (upper, lower) = halves(image, c);
        let (first, second) = halves(upper, b);
        let (third, fourth) = halves(lower, d - c);
        [first, second, third, fourth]
    }
}

/// Does the work of four bands.
pub(super) fn each<E: Executor, J: Send>(executor: &E, [a, b, c, d]: [J; 4], work: impl Fn(J) + Sync) {
    join4(executor, || work(a), || work(b), || work(c), || work(d));
}

/// Splits at `at`, or at the end where there is less.
fn halves<T>(items: &mut [T], at: usize) -> (&mut [T], &mut [T]) {
    items.split_at_mut(at.min(items.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_cover_every_row_once() {
        for rows in 0..40 {
            let mut image: std::vec::Vec<usize> = (0..rows * 3 + 5).collect();
            let bands = Bands::of(rows);
            let firsts = bands.first();
            let parts = bands.split(&mut image, 3);
            assert_eq!(parts.iter().map(|part| part.len()).sum::<usize>(), rows * 3);
            for (part, first) in parts.iter().zip(firsts) {
                assert!(part.first().is_none_or(|&item| item == first * 3));
            }
        }
    }
}
