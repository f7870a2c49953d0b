//! Masks scaled about the centre of their boxes.

use super::{MaskHandle, MaskStore, PixelBox};
use core::ops::Range;

/// A mask scaled about the centre of its box: a bilinear resize of a 0/1 image, in integers; a
/// pixel belongs to it if its value is 1. Not a dilation: a corner cut out of the mask is cut out
/// of the scaled one, larger.
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

    /// Moves the mask within the image.
    pub(crate) fn moved(self, shift: [i32; 2]) -> Self {
        Self { pixels: self.pixels.moved(shift), ..self }
    }

    /// Returns true if a pixel of the image belongs to the scaled mask.
    pub(crate) fn contains(&self, u: i32, v: i32) -> bool {
        if !self.pixels.contains(u, v) {
            return false;
        }
        let (from, scaled) = (&self.mask.pixels, &self.pixels);
        let columns = sources(u - scaled.left, from.width, scaled.width);
        let rows = sources(v - scaled.top, from.height, scaled.height);
        let set = |column: i32, row: i32| {
            self.store.contains(&self.mask, from.left + column, from.top + row)
        };
        // Bilinear: a pixel is set where all of its sources are.
        rows.iter().all(|&row| columns.iter().all(|&column| set(column, row)))
    }

    /// Visits the runs of pixels of row `v` of the image that belong to the scaled mask and lie in
    /// columns `0..width`, from left to right.
    pub(crate) fn runs(&self, v: i32, width: usize, mut visit: impl FnMut(Range<usize>)) {
        let (from, scaled) = (&self.mask.pixels, &self.pixels);
        if v < scaled.top || v - scaled.top >= scaled.height {
            return;
        }
        let mut visit_scaled = |run: Range<i32>| {
            let run = scaled_run(run, from.width, scaled.width);
            let [first, end] =
                [run.start, run.end].map(|column| (scaled.left + column).max(0) as usize);
            if first < end.min(width) {
                visit(first..end.min(width));
            }
        };
        // A box has no bits: each row is one run.
        if self.mask.is_box() {
            return visit_scaled(0..from.width);
        }
        // Enlarging by a fraction: a pixel belongs to the mask if both rows it comes from do.
        let [above, below] = sources(v - scaled.top, from.height, scaled.height)
            .map(|row| self.store.row(&self.mask, from.top + row));
        let before = from.left - self.mask.origin();
        let words = above.iter().zip(below).map(|(above, below)| above & below);
        runs_of_ones(words, |run| visit_scaled(run.start - before..run.end - before));
    }
}

/// Visits the runs of bits that are set in a row of words, whose lowest bits come first.
fn runs_of_ones(words: impl Iterator<Item = u64>, mut visit: impl FnMut(Range<i32>)) {
    let (mut begun, mut at) = (None, 0);
    for word in words {
        let mut left = 64;
        while left > 0 {
            let rest = word >> (64 - left);
            // A shifted word is filled up with zeros, which are no pixels.
            let alike = if begun.is_some() { rest.trailing_ones() } else { rest.trailing_zeros() }
                .min(left);
            (at, left) = (at + alike as i32, left - alike);
            if left > 0 {
                match begun.take() {
                    Some(start) => visit(start..at),
                    None => begun = Some(at),
                }
            }
        }
    }
    if let Some(start) = begun {
        visit(start..at);
    }
}

/// The pixels of a line of `from` resized to `to` that lie between two of a run, or beyond the
/// line's ends where these belong to it.
fn scaled_run(run: Range<i32>, from: i32, to: i32) -> Range<i32> {
    // The mask reaches the edge, and so does the scaled one, however it is rounded.
    let start = if run.start <= 0 {
        0
    } else {
        let (position, unit) = resized(run.start, from, to);
        (position + unit - 1).div_euclid(unit) as i32
    };
    let end = if run.end >= from {
        to
    } else {
        let (position, unit) = resized(run.end - 1, from, to);
        position.div_euclid(unit) as i32 + 1
    };
    start..end
}

/// The two pixels of a line of `from` between which pixel `at` of the same line resized to `to`
/// lies; the same one twice where it hits one.
fn sources(at: i32, from: i32, to: i32) -> [i32; 2] {
    let (position, unit) = resized(at, to, from);
    let low = position.div_euclid(unit);
    let last = i64::from((from - 1).max(0));
    [low, low + i64::from(position.rem_euclid(unit) != 0)].map(|pixel| pixel.clamp(0, last) as i32)
}

/// Returns the position and size of pixel `at` of a line of `from` when the line is resized to
/// `to`.
fn resized(at: i32, from: i32, to: i32) -> (i64, i64) {
    (i64::from(2 * at + 1) * i64::from(to) - i64::from(from), 2 * i64::from(from.max(1)))
}
