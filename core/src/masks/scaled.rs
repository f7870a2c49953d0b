//! Masks scaled about the centre of their boxes.

use super::{MaskHandle, MaskStore, PixelBox};

/// A mask scaled about the centre of its box: a bilinear resize of a 0/1 image, in integers; a pixel belongs to it if its value is 1. Not
/// a dilation: a corner cut out of the mask is cut out of the scaled one, larger.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScaledMask<'m, 's> {
    store: &'m MaskStore<'s>,
    mask: MaskHandle,
    /// The scaled box.
    pub pixels: PixelBox,
}

impl<'m, 's> ScaledMask<'m, 's> {
    /// A mask of `store` scaled by `permille` / 1000.
    pub(crate) fn new(store: &'m MaskStore<'s>, mask: MaskHandle, permille: u32) -> Self {
        Self { store, mask, pixels: mask.pixels.scaled(permille) }
    }

    /// The same elsewhere in the image.
    pub(crate) fn moved(self, shift: [i32; 2]) -> Self {
        Self { pixels: self.pixels.moved(shift), ..self }
    }

    /// Whether a pixel of the image belongs to the scaled mask.
    pub(crate) fn contains(&self, u: i32, v: i32) -> bool {
        if !self.pixels.contains(u, v) {
            return false;
        }
        let (from, scaled) = (&self.mask.pixels, &self.pixels);
        let columns = sources(u - scaled.left, from.width, scaled.width);
        let rows = sources(v - scaled.top, from.height, scaled.height);
        let set = |column: i32, row: i32| self.store.contains(&self.mask, from.left + column, from.top + row);
        rows.iter().all(|&row| columns.iter().all(|&column| set(column, row)))
    }

    /// Visits the pixels of row `v` of the image that belong to the scaled mask and lie in columns `0..width`.
    pub(crate) fn row(&self, v: i32, width: i32, mut visit: impl FnMut(usize)) {
        let (from, scaled) = (&self.mask.pixels, &self.pixels);
        if v < scaled.top || v - scaled.top >= scaled.height {
            return;
        }
        let (is_box, first_bit) = (self.mask.is_box(), from.left - self.mask.origin());
        let [above, below] = sources(v - scaled.top, from.height, scaled.height).map(|row| self.store.row(&self.mask, from.top + row));
        // Columns between which a pixel lies are within the box.
        let set = |column: i32| {
            let at = (first_bit + column) as usize;
            let both = |(above, below): (&u64, &u64)| (above & below) >> (at % 64) & 1 == 1;
            is_box || above.get(at / 64).zip(below.get(at / 64)).is_some_and(both)
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
