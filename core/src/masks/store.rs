//! A bounded buffer of masks: a box each and, for each of its rows, words of 64 pixels that begin
//! at multiples of 64 columns of the image, so that two masks meet word by word.

use super::{MAX_SIDE, PixelBox, pixel_box::share};
use crate::{
    slices::{clipped, clipped_mut},
    state::Visitor,
};
use bytemuck::{Pod, Zeroable};

/// Pixels in a word.
const WORD: i32 = 64;

/// Names a mask of a [`MaskStore`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct MaskHandle {
    /// The box its pixels lie in.
    pub pixels: PixelBox,
    /// First word.
    start: u32,
    /// Words in a row; 0 when there is no mask and the box stands for it.
    stride: u32,
}

impl MaskHandle {
    /// A box all of whose pixels count, without a word stored.
    pub(crate) fn full(pixels: PixelBox) -> Self {
        Self { pixels, start: 0, stride: 0 }
    }

    /// Visits every field. [`MaskStore::holds`] tells whether what was read can be.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { pixels, start, stride } = self;
        pixels.visit(visitor);
        visitor.u32(start);
        visitor.u32(stride);
    }

    /// Words of a row of its box.
    fn words_of_row(&self) -> u32 {
        ((self.pixels.left + self.pixels.width - self.origin() + WORD - 1) / WORD) as u32
    }

    /// Returns true if the box stands for the mask.
    pub(super) fn is_box(&self) -> bool {
        self.stride == 0
    }

    /// Column at which the words begin.
    pub(super) fn origin(&self) -> i32 {
        self.pixels.left.div_euclid(WORD) * WORD
    }
}

/// A bounded buffer of masks, filled front to back and emptied as a whole.
#[derive(Debug)]
pub(crate) struct MaskStore<'s> {
    words: &'s mut [u64],
    used: usize,
    /// The most used since the store was last emptied.
    peak: usize,
}

impl<'s> MaskStore<'s> {
    /// A store in `words`.
    pub(crate) fn new(words: &'s mut [u64]) -> Self {
        Self { words, used: 0, peak: 0 }
    }

    /// Visits all masks.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self {
            words,
            used,
            // The next frame begins by forgetting it.
            peak: _,
        } = self;
        visitor.count(used, words.len());
        visitor.u64s(clipped_mut(words, ..*used));
    }

    /// Forgets all masks.
    pub(crate) fn clear(&mut self) {
        (self.used, self.peak) = (0, 0);
    }

    /// The most words in use since the masks were last forgotten.
    pub(crate) fn peak(&self) -> usize {
        self.peak
    }

    /// Space for a mask in a box within the image, all its bits 0; `None` when the store is full.
    pub(crate) fn alloc(&mut self, pixels: PixelBox) -> Option<MaskHandle> {
        // Whole words a row, from the word that holds the box's first column on.
        let mut mask = MaskHandle { pixels, start: self.used as u32, stride: 0 };
        mask.stride = mask.words_of_row();
        let end =
            self.used.checked_add(mask.stride as usize * usize::try_from(pixels.height).ok()?)?;
        self.words.get_mut(self.used..end)?.fill(0);
        self.used = end;
        if end > self.peak {
            self.peak = end;
        }
        Some(mask)
    }

    /// Returns true if a mask's box can lie in an image, and its words among those in use.
    pub(crate) fn holds(&self, mask: &MaskHandle) -> bool {
        let PixelBox { left, top, width, height } = mask.pixels;
        let lies =
            |first: i32, side: i32| first >= 0 && side >= 0 && first + side <= MAX_SIDE as i32;
        lies(left, width)
            && lies(top, height)
            && (mask.is_box()
                || mask.stride == mask.words_of_row()
                    && u64::from(mask.start) + u64::from(mask.stride) * height as u64
                        <= self.used as u64)
    }

    /// Gives back the space allocated last.
    pub(crate) fn free_last(&mut self, mask: MaskHandle) {
        self.used = mask.start as usize;
    }

    /// Copies a mask from another store; the box alone is kept where this one is full. Whether it
    /// was kept whole.
    pub(crate) fn copy(&mut self, mask: MaskHandle, from: &MaskStore<'_>) -> (MaskHandle, bool) {
        // A stride of 0 is a full box, which has no bits.
        if mask.stride == 0 {
            return (mask, true);
        }
        let Some(to) = self.alloc(mask.pixels) else {
            return (MaskHandle::full(mask.pixels), false);
        };
        let words = clipped(from.words, mask.start as usize..);
        let copy = clipped_mut(self.words, to.start as usize..self.used);
        copy.iter_mut().zip(words).for_each(|(to, from)| *to = *from);
        (to, true)
    }

    /// The words of a row of the image; empty outside the mask.
    pub(super) fn row(&self, mask: &MaskHandle, v: i32) -> &[u64] {
        let row = v.wrapping_sub(mask.pixels.top);
        if row < 0 || row >= mask.pixels.height {
            return &[];
        }
        let start = mask.start as usize + row as usize * mask.stride as usize;
        clipped(self.words, start..start + mask.stride as usize)
    }

    fn row_mut(&mut self, mask: &MaskHandle, v: i32) -> &mut [u64] {
        let row = v.wrapping_sub(mask.pixels.top);
        if row < 0 || row >= mask.pixels.height {
            return &mut [];
        }
        let start = mask.start as usize + row as usize * mask.stride as usize;
        clipped_mut(self.words, start..start + mask.stride as usize)
    }

    /// Returns true if a pixel of the image belongs to the mask.
    pub(crate) fn contains(&self, mask: &MaskHandle, u: i32, v: i32) -> bool {
        if !mask.pixels.contains(u, v) {
            return false;
        }
        if mask.stride == 0 {
            return true;
        }
        let column = (u - mask.origin()) as usize;
        self.row(mask, v).get(column / 64).is_some_and(|word| word >> (column % 64) & 1 == 1)
    }

    /// Sets the pixels of a mask for which `is_set` holds.
    pub(crate) fn fill(&mut self, mask: &MaskHandle, is_set: impl Fn(i32, i32) -> bool) {
        let PixelBox { left, top, width, height } = mask.pixels;
        let origin = mask.origin();
        for v in top..top + height {
            let words = self.row_mut(mask, v);
            for u in (left..left + width).filter(|&u| is_set(u, v)) {
                let column = (u - origin) as usize;
                if let Some(word) = words.get_mut(column / 64) {
                    *word |= 1 << (column % 64);
                }
            }
        }
    }

    /// Adds a row of a caller's mask, whose first pixel is at column `left`; pixels outside the box
    /// are left out.
    pub(crate) fn set_row(&mut self, mask: &MaskHandle, v: i32, left: i32, pixels: &[u8]) {
        let (origin, columns) = (mask.origin(), mask.pixels);
        let words = self.row_mut(mask, v);
        for (u, _) in (left..)
            .zip(pixels)
            .filter(|&(u, &pixel)| pixel != 0 && columns.contains(u, columns.top))
        {
            let column = (u - origin) as usize;
            if let Some(word) = words.get_mut(column / 64) {
                *word |= 1 << (column % 64);
            }
        }
    }

    /// 64 pixels of a row from column `u` on, the first in the lowest bit.
    pub(crate) fn bits(&self, mask: &MaskHandle, u: i32, v: i32) -> u64 {
        if mask.stride == 0 {
            let inside = |i: i32| u64::from(mask.pixels.contains(u + i, v)) << i;
            return (0..WORD).map(inside).fold(0, |bits, bit| bits | bit);
        }
        let row = self.row(mask, v);
        let from = u - mask.origin();
        let (word, shift) = (from.div_euclid(WORD), from.rem_euclid(WORD) as u32);
        // Beyond the row there are no pixels of the mask.
        let at = |word: i32| {
            usize::try_from(word).ok().and_then(|word| row.get(word)).copied().unwrap_or(0)
        };
        // A shift by 64 bits is none in Rust.
        if shift == 0 { at(word) } else { at(word) >> shift | at(word + 1) << (64 - shift) }
    }

    /// Pixels in the mask.
    pub(crate) fn area(&self, mask: &MaskHandle) -> i64 {
        if mask.stride == 0 {
            return mask.pixels.area();
        }
        let end = mask.start as usize + mask.stride as usize * mask.pixels.height.max(0) as usize;
        let words = clipped(self.words, mask.start as usize..end);
        words.iter().map(|word| i64::from(word.count_ones())).sum()
    }

    /// Intersection over union of a mask of this store with one of another, the other one moved by
    /// `shift` px.
    pub(crate) fn overlap(
        &self,
        mask: &MaskHandle,
        other: &MaskStore<'_>,
        other_mask: &MaskHandle,
        shift: [i32; 2],
    ) -> f32 {
        let common = mask.pixels.intersection(&other_mask.pixels.moved(shift));
        let mut both = 0;
        for v in common.top..common.top + common.height {
            let mut u = common.left;
            while u < common.left + common.width {
                // Words of both masks at the same pixels; bits outside a mask are zero.
                let bits =
                    self.bits(mask, u, v) & other.bits(other_mask, u - shift[0], v - shift[1]);
                both += i64::from(bits.count_ones());
                u += WORD;
            }
        }
        share(both, self.area(mask), other.area(other_mask))
    }

    /// Removes from a mask the pixels that another mask of the same store has.
    pub(crate) fn subtract(&mut self, mask: &MaskHandle, other: &MaskHandle) {
        let common = mask.pixels.intersection(&other.pixels);
        let origin = mask.origin();
        for v in common.top..common.top + common.height {
            for word in 0..mask.stride {
                let bits = self.bits(other, origin + word as i32 * WORD, v);
                if let Some(mine) = self.row_mut(mask, v).get_mut(word as usize) {
                    *mine &= !bits;
                }
            }
        }
    }
}
