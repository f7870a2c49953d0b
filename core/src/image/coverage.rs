//! Coverage of an image: the pixels that show anything.

use super::View;
use crate::{bits::set_bits, slices::clipped};

/// Pixels a word has bits for.
const WORD: usize = 64;

/// One bit a pixel, set where the pixel is not to be used. Rows begin at words.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InvalidPixels<'a> {
    words: &'a [u64],
    width: usize,
}

impl<'a> InvalidPixels<'a> {
    /// Words a row of `width` pixels takes.
    pub(crate) const fn words_a_row(width: usize) -> usize {
        width.div_ceil(WORD)
    }

    /// Views `words` as bits of `width` x `height` pixels; `None` when there are too few.
    pub(crate) fn new(words: &'a [u64], width: usize, height: usize) -> Option<Self> {
        let words = words.get(..Self::words_a_row(width).checked_mul(height)?)?;
        Some(Self { words, width })
    }

    /// Returns true if pixel (u, v) is invalid; pixels outside the image are.
    pub(crate) fn contains(&self, u: usize, v: usize) -> bool {
        if u >= self.width {
            return true;
        }
        let word = self.words.get(v * Self::words_a_row(self.width) + u / WORD);
        word.is_none_or(|word| word >> (u % WORD) & 1 == 1)
    }

    /// The columns of row `v` that are not to be used, from left to right.
    pub(crate) fn in_row(&self, v: usize) -> impl Iterator<Item = usize> + use<'a> {
        let row = Self::words_a_row(self.width);
        let words = clipped(self.words, v * row..(v + 1) * row);
        let columns = |(at, &word)| set_bits(word).map(move |bit| at * WORD + bit as usize);
        words.iter().enumerate().flat_map(columns)
    }
}

/// The pixels of a pair that are not to be used.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InvalidPair<'a> {
    /// Pixels of the left image.
    pub left: InvalidPixels<'a>,
    /// Pixels of the right image; `None` where all are used.
    pub right: Option<InvalidPixels<'a>>,
}

/// A grey pair with the pixels of it that are not to be used.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MaskedPair<'a> {
    /// Left image.
    pub left: View<'a, u8>,
    /// Right image.
    pub right: View<'a, u8>,
    /// Pixels not to be used; `None` where all are.
    pub invalid: Option<&'a InvalidPair<'a>>,
    /// True if the right image's rows are moved otherwise than in the pair before.
    pub right_moved: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_of_a_row_come_from_left_to_right_and_outside_is_invalid() {
        // Two words a row of 70 pixels.
        let words = [1 << 3 | 1 << 63, 1, 0, 0];
        let invalid = InvalidPixels::new(&words, 70, 2).unwrap();
        assert_eq!(invalid.in_row(0).collect::<std::vec::Vec<_>>(), [3, 63, 64]);
        assert_eq!(invalid.in_row(1).count(), 0);
        assert!(
            invalid.contains(64, 0)
                && !invalid.contains(65, 0)
                && invalid.contains(70, 0)
                && invalid.contains(0, 2)
        );
        assert!(InvalidPixels::new(&words, 70, 3).is_none());
    }
}
