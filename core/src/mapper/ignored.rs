//! Pixels of the left image that no stage uses: those the caller ignores, those attached to the
//! camera, and with them those that no raw pixel covers.
//!
//! **Memory.** A bit a pixel. **Time.** A read of each pixel in frames that bring a mask, nothing
//! in others.

use super::StereoFrame;
use crate::{
    Capacity,
    attached::{AttachedCells, CELL_PX},
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
    /// Other pixels that lie in attached cells.
    attached: u32,
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
        Self { words: carver.alloc("ignored", words(capacity)), count: 0, attached: 0 }
    }

    /// Visits the bits, if there are any, of images of that size.
    pub fn visit(&mut self, [width, height]: [usize; 2], visitor: &mut impl Visitor) {
        let Self { words, count, attached } = self;
        visitor.u32(count);
        visitor.u32(attached);
        if *count > 0 || *attached > 0 {
            let used = InvalidPixels::words_a_row(width) * height;
            visitor.u64s(words.iter_mut().take(used));
        }
    }

    /// Pixels that the caller ignores in the last frame.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Tells that a mask or an attached cell hides pixels in the last frame.
    pub fn is_used(&self) -> bool {
        self.count + self.attached > 0
    }

    /// Pixels that lie in attached cells, and that the caller does not ignore.
    pub fn attached(&self) -> u32 {
        self.attached
    }

    /// Takes a frame's mask, any value but 0 being ignored, adds attached cells, and then the
    /// pixels that no raw pixel covers.
    pub fn update(
        &mut self,
        frame: &StereoFrame<'_>,
        attached: &AttachedCells<'_>,
        covered: Option<InvalidPair<'_>>,
    ) {
        let [width, height] = [frame.left.width(), frame.left.height()];
        (self.count, self.attached) = (0, 0);
        if frame.ignored.is_none() && attached.is_empty() {
            return;
        }
        let row_words = InvalidPixels::words_a_row(width);
        let used = self.words.get_mut(..row_words * height).unwrap_or_default();
        used.fill(0);
        let rows = used.chunks_exact_mut(row_words.max(1));
        for (words, pixels) in rows.zip(frame.ignored.iter().flat_map(View::rows)) {
            for (word, pixels) in words.iter_mut().zip(pixels.chunks(WORD)) {
                *word = pixels.iter().rev().fold(0, |bits, &pixel| bits << 1 | set(pixel));
                self.count += word.count_ones();
            }
        }
        for [column, row] in attached.attached() {
            let (left, top) = (column * CELL_PX, row * CELL_PX);
            // A cell lies in one word, because words begin at multiples of its side.
            let bits = (left..width.min(left + CELL_PX)).fold(0, |bits, u| bits | 1 << (u % WORD));
            for v in top..height.min(top + CELL_PX) {
                if let Some(word) = used.get_mut(v * row_words + left / WORD) {
                    self.attached += u64::count_ones(bits & !*word);
                    *word |= bits;
                }
            }
        }
        for v in 0..height {
            for u in covered.iter().flat_map(|pair| pair.left.in_row(v)) {
                if let Some(word) = used.get_mut(v * row_words + u / WORD) {
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
        if !self.is_used() {
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
