//! Pixels of the left image that no stage uses: those the caller ignores, and with them those that
//! no raw pixel covers.
//!
//! **Memory.** A bit a pixel. **Time.** A read of each pixel in frames that bring a mask, nothing
//! in others.

use crate::{
    Capacity,
    image::{InvalidPair, InvalidPixels, View},
    memory::{Carver, region_bytes},
    state::Visitor,
};

/// Pixels a word has bits for.
const WORD: usize = 64;

/// The ignored pixels of the last frame. They outlive it, because features of its images are found
/// anew when a mapper is restored.
#[derive(Debug)]
pub(super) struct IgnoredPixels<'s> {
    words: &'s mut [u64],
    /// Pixels that the caller ignores in the last frame.
    count: u32,
}

/// Words for the largest image.
const fn words(capacity: &Capacity) -> usize {
    InvalidPixels::words_a_row(capacity.image_width) * capacity.image_height
}

impl<'s> IgnoredPixels<'s> {
    /// Bytes of the slab.
    pub const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<u64>(words(capacity))
    }

    /// Allocates the bits. Nothing is ignored until [`IgnoredPixels::update`].
    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self { words: carver.alloc("ignored", words(capacity)), count: 0 }
    }

    /// Visits the bits, if there are any, of images of that size.
    pub fn visit(&mut self, [width, height]: [usize; 2], visitor: &mut impl Visitor) {
        let Self { words, count } = self;
        visitor.u32(count);
        if *count > 0 {
            let used = InvalidPixels::words_a_row(width) * height;
            visitor.u64s(words.iter_mut().take(used));
        }
    }

    /// Pixels that the caller ignores in the last frame.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Takes a frame's mask, any value but 0 being ignored, and adds the pixels that no raw pixel
    /// covers.
    pub fn update(&mut self, mask: Option<View<'_, u8>>, covered: Option<InvalidPair<'_>>) {
        self.count = 0;
        let Some(mask) = mask else { return };
        let row_words = InvalidPixels::words_a_row(mask.width());
        let rows = self.words.chunks_exact_mut(row_words.max(1)).zip(mask.rows());
        for (v, (words, pixels)) in rows.enumerate() {
            for (word, pixels) in words.iter_mut().zip(pixels.chunks(WORD)) {
                let bits = pixels.iter().rev().fold(0, |bits, &pixel| bits << 1 | set(pixel));
                self.count += u64::count_ones(bits);
                *word = bits;
            }
            for u in covered.iter().flat_map(|pair| pair.left.in_row(v)) {
                if let Some(word) = words.get_mut(u / WORD) {
                    *word |= 1 << (u % WORD);
                }
            }
        }
    }

    /// All pixels of a pair of that size that no stage uses; `None` where all are used.
    pub fn pair<'a>(
        &'a self,
        [width, height]: [usize; 2],
        covered: Option<InvalidPair<'a>>,
    ) -> Option<InvalidPair<'a>> {
        if self.count == 0 {
            return covered;
        }
        // A match needs its left pixel, so that the right image needs no mask of its own.
        let left = InvalidPixels::new(self.words, width, height)?;
        Some(InvalidPair { left, right: covered.and_then(|pair| pair.right) })
    }
}

/// The bit of a mask's pixel.
fn set(pixel: u8) -> u64 {
    u64::from(pixel != 0)
}
