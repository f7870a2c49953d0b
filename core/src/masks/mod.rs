//! Masks as bits: a box and, for each of its rows, words of 64 pixels that begin at multiples of 64 columns of the image, so that two
//! masks meet word by word.
//!
//! Memory: 8 bytes for each 64 columns a row of a box touches, out of one bounded buffer.

use crate::state::Visitor;
use bytemuck::{Pod, Zeroable};

/// Pixels in a word.
const WORD: i32 = 64;

/// A box of pixels: it holds columns `left .. left + width` and rows `top .. top + height`. It may lie partly or wholly beside the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Pod, Zeroable)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct PixelBox {
    /// First column, px.
    pub left: i32,
    /// First row, px.
    pub top: i32,
    /// Columns, px.
    pub width: i32,
    /// Rows, px.
    pub height: i32,
}

impl PixelBox {
    /// Visits every field.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { left, top, width, height } = self;
        visitor.i32s([left, top, width, height]);
    }

    /// Pixels in the box.
    pub fn area(&self) -> i64 {
        i64::from(self.width.max(0)) * i64::from(self.height.max(0))
    }

    /// Whether it holds a pixel.
    pub fn contains(&self, u: i32, v: i32) -> bool {
        u >= self.left && v >= self.top && u - self.left < self.width && v - self.top < self.height
    }

    /// What both hold; of width or height 0 where that is nothing.
    pub fn intersection(&self, other: &Self) -> Self {
        let (left, top) = (self.left.max(other.left), self.top.max(other.top));
        let right = (self.left + self.width).min(other.left + other.width);
        let bottom = (self.top + self.height).min(other.top + other.height);
        Self { left, top, width: (right - left).max(0), height: (bottom - top).max(0) }
    }

    /// Intersection over union.
    pub fn overlap(&self, other: &Self) -> f32 {
        share(self.intersection(other).area(), self.area(), other.area())
    }

    /// The box moved.
    pub fn moved(&self, [u, v]: [i32; 2]) -> Self {
        Self { left: self.left + u, top: self.top + v, ..*self }
    }

    /// The box scaled about its centre: the new width is `width * permille / 1000` cut to whole pixels, half the excess on either side, the
    /// odd pixel right and below (as in the published code).
    pub fn scaled(&self, permille: u32) -> Self {
        let of = |side: i32| (i64::from(side) * i64::from(permille) / 1000) as i32;
        let (width, height) = (of(self.width), of(self.height));
        let half = |excess: i32| excess.div_euclid(2);
        Self {
            left: self.left - half(width - self.width),
            top: self.top - half(height - self.height),
            width,
            height,
        }
    }
}

fn share(common: i64, a: i64, b: i64) -> f32 {
    let union = a + b - common;
    if union > 0 { common as f32 / union as f32 } else { 0.0 }
}

/// Where a mask stands in a [`MaskStore`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct MaskPlace {
    /// The box its pixels lie in.
    pub pixels: PixelBox,
    /// First word.
    start: u32,
    /// Words in a row; 0 when there is no mask and the box stands for it.
    stride: u32,
}

impl MaskPlace {
    /// A box all of whose pixels count, without a word stored.
    pub fn full(pixels: PixelBox) -> Self {
        Self { pixels, start: 0, stride: 0 }
    }

    /// Visits every field.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { pixels, start, stride } = self;
        pixels.visit(visitor);
        visitor.u32(start);
        visitor.u32(stride);
    }

    /// Column at which the words begin.
    fn origin(&self) -> i32 {
        self.pixels.left.div_euclid(WORD) * WORD
    }
}

/// A bounded buffer of masks, filled front to back and emptied as a whole.
#[derive(Debug)]
pub struct MaskStore<'s> {
    words: &'s mut [u64],
    used: usize,
}

impl<'s> MaskStore<'s> {
    /// A store in `words`.
    pub fn new(words: &'s mut [u64]) -> Self {
        Self { words, used: 0 }
    }

    /// Visits all masks.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { words, used } = self;
        visitor.count(used, words.len());
        visitor.u64s(words.get_mut(..*used).unwrap_or(&mut []));
    }

    /// Forgets all masks.
    pub fn clear(&mut self) {
        self.used = 0;
    }

    /// Words in use.
    pub fn used(&self) -> usize {
        self.used
    }

    /// Room for a mask in a box within the image, all its bits 0; `None` when the store is full.
    pub fn take(&mut self, pixels: PixelBox) -> Option<MaskPlace> {
        let mut place = MaskPlace { pixels, start: self.used as u32, stride: 0 };
        place.stride = ((pixels.left + pixels.width - place.origin() + WORD - 1) / WORD) as u32;
        let end = self.used.checked_add(place.stride as usize * usize::try_from(pixels.height).ok()?)?;
        self.words.get_mut(self.used..end)?.fill(0);
        self.used = end;
        Some(place)
    }

    /// Gives back the mask taken last.
    pub fn undo(&mut self, place: MaskPlace) {
        self.used = place.start as usize;
    }

    /// Copies a mask from another store; the box alone is kept where this one is full. Whether it was kept whole.
    pub fn copy(&mut self, place: MaskPlace, from: &MaskStore<'_>) -> (MaskPlace, bool) {
        if place.stride == 0 {
            return (place, true);
        }
        let Some(to) = self.take(place.pixels) else { return (MaskPlace::full(place.pixels), false) };
        let words = from.words.get(place.start as usize..).unwrap_or(&[]);
        let room = self.words.get_mut(to.start as usize..self.used).unwrap_or(&mut []);
        room.iter_mut().zip(words).for_each(|(to, from)| *to = *from);
        (to, true)
    }

    /// The words of a row of the image and the column they begin at; nothing beside the mask.
    fn row(&self, place: &MaskPlace, v: i32) -> &[u64] {
        let row = v.wrapping_sub(place.pixels.top);
        if row < 0 || row >= place.pixels.height {
            return &[];
        }
        let start = place.start as usize + row as usize * place.stride as usize;
        self.words.get(start..start + place.stride as usize).unwrap_or(&[])
    }

    fn row_mut(&mut self, place: &MaskPlace, v: i32) -> &mut [u64] {
        let row = v.wrapping_sub(place.pixels.top);
        if row < 0 || row >= place.pixels.height {
            return &mut [];
        }
        let start = place.start as usize + row as usize * place.stride as usize;
        self.words.get_mut(start..start + place.stride as usize).unwrap_or(&mut [])
    }

    /// Whether a pixel of the image belongs to the mask.
    pub fn contains(&self, place: &MaskPlace, u: i32, v: i32) -> bool {
        if !place.pixels.contains(u, v) {
            return false;
        }
        if place.stride == 0 {
            return true;
        }
        let column = (u - place.origin()) as usize;
        self.row(place, v).get(column / 64).is_some_and(|word| word >> (column % 64) & 1 == 1)
    }

    /// Enters a row of a caller's mask, whose first pixel is at column `left`; pixels beside the box are left out.
    pub fn enter_row(&mut self, place: &MaskPlace, v: i32, left: i32, pixels: &[u8]) {
        let (origin, columns) = (place.origin(), place.pixels);
        let words = self.row_mut(place, v);
        for (u, _) in (left..).zip(pixels).filter(|&(u, &pixel)| pixel != 0 && columns.contains(u, columns.top)) {
            let column = (u - origin) as usize;
            if let Some(word) = words.get_mut(column / 64) {
                *word |= 1 << (column % 64);
            }
        }
    }

    /// 64 pixels of a row from column `u` on, the first in the lowest bit.
    fn bits(&self, place: &MaskPlace, u: i32, v: i32) -> u64 {
        if place.stride == 0 {
            let inside = |i: i32| u64::from(place.pixels.contains(u + i, v)) << i;
            return (0..WORD).map(inside).fold(0, |bits, bit| bits | bit);
        }
        let row = self.row(place, v);
        let from = u - place.origin();
        let (word, shift) = (from.div_euclid(WORD), from.rem_euclid(WORD) as u32);
        let at = |word: i32| usize::try_from(word).ok().and_then(|word| row.get(word)).copied().unwrap_or(0);
        if shift == 0 { at(word) } else { at(word) >> shift | at(word + 1) << (64 - shift) }
    }

    /// Pixels in the mask.
    pub fn area(&self, place: &MaskPlace) -> i64 {
        if place.stride == 0 {
            return place.pixels.area();
        }
        let end = place.start as usize + place.stride as usize * place.pixels.height.max(0) as usize;
        let words = self.words.get(place.start as usize..end).unwrap_or(&[]);
        words.iter().map(|word| i64::from(word.count_ones())).sum()
    }

    /// Intersection over union of a mask of this store with one of another, the other one moved by `shift` px.
    pub fn overlap(&self, place: &MaskPlace, other: &MaskStore<'_>, theirs: &MaskPlace, shift: [i32; 2]) -> f32 {
        let common = place.pixels.intersection(&theirs.pixels.moved(shift));
        let mut both = 0;
        for v in common.top..common.top + common.height {
            let mut u = common.left;
            while u < common.left + common.width {
                let bits = self.bits(place, u, v) & other.bits(theirs, u - shift[0], v - shift[1]);
                both += i64::from(bits.count_ones());
                u += WORD;
            }
        }
        share(both, self.area(place), other.area(theirs))
    }

    /// Takes from a mask the pixels that another mask of the same store has.
    pub fn subtract(&mut self, place: &MaskPlace, taken: &MaskPlace) {
        let common = place.pixels.intersection(&taken.pixels);
        let origin = place.origin();
        for v in common.top..common.top + common.height {
            for word in 0..place.stride {
                let bits = self.bits(taken, origin + word as i32 * WORD, v);
                if let Some(mine) = self.row_mut(place, v).get_mut(word as usize) {
                    *mine &= !bits;
                }
            }
        }
    }
}

/// A mask scaled about the centre of its box: a bilinear resize of a 0/1 image of which a pixel counts if its value is 1, in integers. Not
/// a dilation: a corner cut out of the mask is cut out of the scaled one, larger.
#[derive(Clone, Copy, Debug)]
pub struct ScaledMask<'m, 's> {
    store: &'m MaskStore<'s>,
    place: MaskPlace,
    /// The scaled box.
    pub pixels: PixelBox,
}

impl<'m, 's> ScaledMask<'m, 's> {
    /// A mask of `store` scaled by `permille` / 1000.
    pub fn new(store: &'m MaskStore<'s>, place: MaskPlace, permille: u32) -> Self {
        Self { store, place, pixels: place.pixels.scaled(permille) }
    }

    /// The same elsewhere in the image.
    pub fn moved(self, shift: [i32; 2]) -> Self {
        Self { pixels: self.pixels.moved(shift), ..self }
    }

    /// Whether a pixel of the image belongs to the scaled mask.
    pub fn contains(&self, u: i32, v: i32) -> bool {
        if !self.pixels.contains(u, v) {
            return false;
        }
        let (from, scaled) = (&self.place.pixels, &self.pixels);
        let columns = sources(u - scaled.left, from.width, scaled.width);
        let rows = sources(v - scaled.top, from.height, scaled.height);
        let set = |column: i32, row: i32| self.store.contains(&self.place, from.left + column, from.top + row);
        rows.iter().all(|&row| columns.iter().all(|&column| set(column, row)))
    }

    /// Visits the pixels of row `v` of the image that belong to the scaled mask and lie in columns `0..width`.
    pub fn row(&self, v: i32, width: i32, mut visit: impl FnMut(usize)) {
        let (from, scaled) = (&self.place.pixels, &self.pixels);
        if v < scaled.top || v - scaled.top >= scaled.height {
            return;
        }
        let (whole, lead) = (self.place.stride == 0, from.left - self.place.origin());
        let [above, below] = sources(v - scaled.top, from.height, scaled.height).map(|row| self.store.row(&self.place, from.top + row));
        // Columns between which a pixel lies are within the box.
        let set = |column: i32| {
            let at = (lead + column) as usize;
            let both = |(above, below): (&u64, &u64)| (above & below) >> (at % 64) & 1 == 1;
            whole || above.get(at / 64).zip(below.get(at / 64)).is_some_and(both)
        };
        let (first, last) = (scaled.left.max(0), (scaled.left + scaled.width).min(width));
        for (u, [before, after]) in (first..last).zip(Sources::begin(first - scaled.left, from.width, scaled.width)) {
            if set(before) && (before == after || set(after)) {
                visit(u as usize);
            }
        }
    }
}

/// [`sources`] of one pixel after the other, without a division for each.
struct Sources {
    low: i64,
    rest: i64,
    /// What a pixel adds to low and rest.
    by: [i64; 2],
    step: i64,
    last: i64,
}

impl Sources {
    fn begin(at: i32, from: i32, to: i32) -> Self {
        let position = i64::from(2 * at + 1) * i64::from(from) - i64::from(to);
        let (step, add) = (2 * i64::from(to.max(1)), 2 * i64::from(from));
        Self {
            low: position.div_euclid(step),
            rest: position.rem_euclid(step),
            by: [add.div_euclid(step), add.rem_euclid(step)],
            step,
            last: i64::from((from - 1).max(0)),
        }
    }

    fn pixels(&self) -> [i32; 2] {
        [self.low, self.low + i64::from(self.rest != 0)].map(|pixel| pixel.clamp(0, self.last) as i32)
    }
}

impl Iterator for Sources {
    type Item = [i32; 2];

    fn next(&mut self) -> Option<[i32; 2]> {
        let pixels = self.pixels();
        let [low, rest] = self.by;
        (self.low, self.rest) = (self.low + low, self.rest + rest);
        if self.rest >= self.step {
            (self.low, self.rest) = (self.low + 1, self.rest - self.step);
        }
        Some(pixels)
    }
}

/// The two pixels of a line of `from` between which pixel `at` of the same line resized to `to` lies; the same one twice where it hits one.
fn sources(at: i32, from: i32, to: i32) -> [i32; 2] {
    Sources::begin(at, from, to).pixels()
}
