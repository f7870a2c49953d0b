//! Four bands of a run of items, cut at places that depend on the number of items alone.

use super::Executor;

/// Bands there are.
pub(crate) const BANDS: usize = 4;

/// First items of the bands, and the end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bands([usize; BANDS + 1]);

impl Bands {
    /// Cuts `items` items.
    pub(crate) fn new(items: usize) -> Self {
        Self([0, items / 4, items / 2, items / 2 + items / 4, items])
    }

    /// First item of each band.
    pub(crate) fn first(self) -> [usize; BANDS] {
        let [a, b, c, d, _] = self.0;
        [a, b, c, d]
    }

    /// The bands of items of `stride` values each; what is beyond the items is left out.
    pub(crate) fn split<T>(self, values: &[T], stride: usize) -> [&[T]; BANDS] {
        let mut rest = values;
        self.lens(stride).map(|len| rest.split_off(..len.min(rest.len())).unwrap_or_default())
    }

    /// Splits like [`Bands::split`], for writing.
    pub(crate) fn split_mut<T>(self, values: &mut [T], stride: usize) -> [&mut [T]; BANDS] {
        let mut rest = values;
        self.lens(stride).map(|len| rest.split_off_mut(..len.min(rest.len())).unwrap_or_default())
    }

    /// Values in each band.
    fn lens(self, stride: usize) -> [usize; BANDS] {
        let [a, b, c, d, end] = self.0;
        [b - a, c - b, d - c, end - d].map(|items| items * stride)
    }
}

/// Does the work of all bands. The first two are done together, and the last two.
///
/// ```
/// use dynvox_core::{Serial, parallel::each};
///
/// assert_eq!(each(&Serial, [1, 2, 3, 4], |job| 10 * job), [10, 20, 30, 40]);
/// ```
pub fn each<E: Executor, J: Send, R: Send>(
    executor: &E,
    [a, b, c, d]: [J; BANDS],
    work: impl Fn(J) -> R + Sync,
) -> [R; BANDS] {
    let ((a, b), (c, d)) = executor
        .join(|| executor.join(|| work(a), || work(b)), || executor.join(|| work(c), || work(d)));
    [a, b, c, d]
}

/// Two arrays as one of pairs.
pub(crate) fn zip2<A, B>([a, b, c, d]: [A; BANDS], [e, f, g, h]: [B; BANDS]) -> [(A, B); BANDS] {
    [(a, e), (b, f), (c, g), (d, h)]
}

/// Three arrays as one of triples.
pub(crate) fn zip3<A, B, C>(
    [a, b, c, d]: [A; BANDS],
    [e, f, g, h]: [B; BANDS],
    [i, j, k, l]: [C; BANDS],
) -> [(A, B, C); BANDS] {
    [(a, e, i), (b, f, j), (c, g, k), (d, h, l)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Serial, parallel::TwoThreads};

    #[test]
    fn bands_cover_every_item_once() {
        for items in 0..40 {
            let mut values: std::vec::Vec<usize> = (0..items * 3 + 5).collect();
            let bands = Bands::new(items);
            assert_eq!(bands.split(&values, 3).concat(), values[..items * 3]);
            for (part, first) in bands.split_mut(&mut values, 3).iter().zip(bands.first()) {
                assert!(part.first().is_none_or(|&value| value == first * 3));
            }
        }
    }

    #[test]
    fn fewer_values_than_items_leave_the_last_bands_short() {
        assert_eq!(Bands::new(8).split(&[1, 2, 3, 4, 5], 1).map(<[i32]>::len), [2, 2, 1, 0]);
    }

    #[test]
    fn results_come_back_in_the_order_of_the_jobs() {
        assert_eq!(each(&Serial, [1, 2, 3, 4], |job| 10 * job), [10, 20, 30, 40]);
        assert_eq!(each(&TwoThreads, [1, 2, 3, 4], |job| 10 * job), [10, 20, 30, 40]);
    }
}
