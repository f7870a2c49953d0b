//! Removal of small segments. A segment is what hangs together by neighbours (left, right, above,
//! below) of similar disparity.
//!
//! Runs of similar pixels along a row are united with those of the row above that they touch: a
//! union-find over runs, whose roots hold the sizes. Where runs end is remembered, so that a second
//! walk over runs, not pixels, blanks the small ones. Memory: six bytes a pixel (in the worst case
//! each is a run) and three a column. Time: one walk over the image in bytes side by side, and one
//! over its runs.

use super::dense::{FILLED, NONE};
use crate::{
    flags::{for_each_set, word},
    parallel::Work,
};

/// Working memory.
pub(super) struct Scratch<'a> {
    /// An entry a pixel: each run's parent, or its size as a negative if it is a root.
    pub runs: &'a mut [i32],
    /// An entry a pixel: for each row, from its first pixel's place on, one past the last column of
    /// each run.
    pub ends: &'a mut [u16],
    /// Three bytes a column.
    pub flags: &'a mut [u8],
}

/// A root's size is kept as its negative; others point at a run nearer to the root.
struct Runs<'a>(&'a mut [i32]);

impl Runs<'_> {
    /// A run's entry. Runs are numbered below the number of pixels, and as many entries there are:
    /// beyond them it is an empty root.
    #[inline(always)]
    fn get(&self, run: usize) -> i32 {
        self.0.get(run).copied().unwrap_or(-1)
    }

    #[inline(always)]
    fn set(&mut self, run: usize, entry: i32) {
        if let Some(slot) = self.0.get_mut(run) {
            *slot = entry;
        }
    }

    #[inline(always)]
    fn root(&mut self, mut run: usize) -> usize {
        while let Ok(parent) = usize::try_from(self.get(run)) {
            // Halve the path, so that no chain gets long.
            let above = self.get(parent);
            if above >= 0 {
                self.set(run, above);
            }
            run = parent;
        }
        run
    }

    /// The size of a run's segment, asked of one run after the other, from the first on.
    #[inline(always)]
    fn size_of_next(&mut self, run: usize) -> u32 {
        // Parents are earlier runs: they know their root by now, so that no loop, which no
        // processor foresees, leads to it.
        let entry = self.get(run);
        let parent = usize::try_from(entry).unwrap_or(run);
        let root = usize::try_from(self.get(parent)).unwrap_or(parent);
        self.set(run, if entry < 0 { entry } else { root as i32 });
        self.get(root).unsigned_abs()
    }

    /// The earlier root wins: no rank is needed, and the result does not depend on order.
    #[inline(always)]
    fn unite(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        if a != b {
            let (root, child) = (a.min(b), a.max(b));
            self.set(root, self.get(root) + self.get(child));
            self.set(child, root as i32);
        }
    }
}

/// Pixels that were blanked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Blanked {
    /// Measured ones.
    pub measured: u32,
    /// Filled ones.
    pub filled: u32,
}

/// Blanks segments of fewer than `smallest` pixels, measured or filled, in an image `width` wide;
/// neighbours differ by at most `similarity`, in the unit of the pixels and less than NONE is away
/// from any.
pub(super) struct RemoveSpeckles<'a> {
    pub disparity: &'a mut [i16],
    pub width: usize,
    pub similarity: i16,
    pub smallest: u32,
    pub scratch: Scratch<'a>,
}

impl Work for RemoveSpeckles<'_> {
    type Output = Blanked;

    #[inline(always)]
    fn run(self) -> Blanked {
        let Self { disparity, width, similarity, smallest, scratch: Scratch { runs, ends, flags } } =
            self;
        let (pixels, width) = (disparity.len(), width.max(1));
        let mut blanked = Blanked::default();
        if smallest <= 1 || runs.len() < pixels || ends.len() < pixels || flags.len() < 3 * width {
            return blanked;
        }
        let mut runs = Runs(runs);
        let image = Segmented { disparity, width, similarity: similarity.unsigned_abs() };
        find_segments(&image, &mut runs, ends, flags);
        let mut run = 0;
        for (row, ends) in disparity.chunks_exact_mut(width).zip(ends.chunks_exact(width)) {
            let mut start = 0;
            for &end in ends {
                // A small segment is a mismatch more often than a surface.
                let is_small = runs.size_of_next(run) < smallest;
                run += 1;
                if let Some(pixels) = row.get_mut(start..usize::from(end))
                    && is_small & pixels.first().is_some_and(|&d| d != NONE)
                {
                    let filled = pixels.iter().filter(|&&d| d & FILLED != 0).count() as u32;
                    blanked.filled += filled;
                    blanked.measured += pixels.len() as u32 - filled;
                    pixels.fill(NONE);
                }
                start = usize::from(end);
                // The slots behind the row's last run hold ends of earlier frames.
                if start == width {
                    break;
                }
            }
        }
        blanked
    }
}

/// An image to be divided into segments.
struct Segmented<'a> {
    disparity: &'a [i16],
    width: usize,
    /// Largest difference of neighbours within a segment.
    similarity: u16,
}

/// Returns the difference of two disparities, filled or not. NONE differs from every disparity even
/// with its bit of filled pixels cleared.
#[inline(always)]
fn difference(a: i16, b: i16) -> u16 {
    (a & !FILLED).abs_diff(b & !FILLED)
}

/// Finds the runs of all rows, numbered in scan order, those without disparity included, and unites
/// them.
#[inline(always)]
fn find_segments(image: &Segmented<'_>, runs: &mut Runs<'_>, ends: &mut [u16], flags: &mut [u8]) {
    let &Segmented { disparity, width, similarity } = image;
    let width = width.max(1);
    let mut flags = flags.chunks_exact_mut(width);
    let (Some(mut breaks_above), Some(mut breaks), Some(touches)) =
        (flags.next(), flags.next(), flags.next())
    else {
        return;
    };
    let mut above: &[i16] = &[];
    let (mut above_run, mut here_run) = (0, 0);
    for (here, ends) in disparity.chunks_exact(width).zip(ends.chunks_exact_mut(width)) {
        // A run ends where the next pixel differs.
        break_up(here, similarity, breaks);
        let mut next_run = here_run;
        let mut start = 0;
        let mut slots = ends.iter_mut();
        for_each_set(breaks, |last| {
            let end = last as i32 + 1;
            runs.set(next_run, start - end);
            if let Some(slot) = slots.next() {
                *slot = end as u16;
            }
            start = end;
            next_run += 1;
        });
        // Runs that touch a similar pixel in the row above are one segment.
        if !above.is_empty() {
            for (touch, (&up, &here)) in touches.iter_mut().zip(above.iter().zip(here)) {
                *touch = u8::from(difference(up, here) <= similarity) & u8::from(here != NONE);
            }
            for_each_contact(touches, [breaks_above, breaks], |[a, b]| {
                runs.unite(above_run + a, here_run + b)
            });
        }
        // The row's breaks become those above the next row.
        (above, above_run, here_run) = (here, here_run, next_run);
        core::mem::swap(&mut breaks_above, &mut breaks);
    }
}

/// Flags the last pixel of each run of a row.
#[inline(always)]
fn break_up(row: &[i16], similarity: u16, breaks: &mut [u8]) {
    for (flag, (&a, &b)) in breaks.iter_mut().zip(row.iter().zip(row.iter().skip(1))) {
        *flag = u8::from(difference(a, b) > similarity);
    }
    if let Some(last) = breaks.last_mut() {
        *last = 1;
    }
}

/// Calls `each` with the numbers, from the row's first one on, of every two runs that touch: of two
/// rows, whose runs end where `breaks` are set. Eight pixels at a time.
#[inline(always)]
fn for_each_contact(touches: &[u8], [above, here]: [&[u8]; 2], mut each: impl FnMut([usize; 2])) {
    // The number of flags that are set: the highest byte of the product is the sum of all.
    let count = |flags: u64| (flags.wrapping_mul(0x0101_0101_0101_0101) >> 56) as usize;
    let mut before = [0; 2];
    // Whether the same two runs have touched at the pixel before.
    let mut known = 0;
    for (touches, (above, here)) in touches.chunks(8).zip(above.chunks(8).zip(here.chunks(8))) {
        let (touches, breaks) = (word(touches), [word(above), word(here)]);
        // Runs that touch here, and break at neither of the two, touch at the next pixel, too.
        let goes_on = touches & !(breaks[0] | breaks[1]);
        let mut first = touches & !(goes_on << 8 | known);
        known = goes_on >> 56;
        while first != 0 {
            // The breaks before a pixel are the number of its run within the row.
            let earlier = (1 << first.trailing_zeros()) - 1;
            each([before[0] + count(breaks[0] & earlier), before[1] + count(breaks[1] & earlier)]);
            first &= first - 1;
        }
        before = [before[0] + count(breaks[0]), before[1] + count(breaks[1])];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::{vec, vec::Vec};

    /// The twin: flood fill from each pixel.
    fn plain(disparity: &[i16], width: usize, similarity: i16, smallest: usize) -> Vec<i16> {
        let mut out = disparity.to_vec();
        let mut visited = vec![false; out.len()];
        for start in 0..out.len() {
            if visited[start] || disparity[start] == NONE {
                continue;
            }
            let (mut segment, mut next) = (vec![start], 0);
            visited[start] = true;
            while let Some(&i) = segment.get(next) {
                next += 1;
                let u = i % width;
                // Four neighbours; the row above and below may lie outside.
                let beside = [
                    (u > 0).then(|| i - 1),
                    (u + 1 < width).then_some(i + 1),
                    i.checked_sub(width),
                    Some(i + width),
                ];
                for j in beside.into_iter().flatten().filter(|&j| j < disparity.len()) {
                    if !visited[j]
                        && disparity[j] != NONE
                        && difference(disparity[i], disparity[j]) <= similarity as u16
                    {
                        visited[j] = true;
                        segment.push(j);
                    }
                }
            }
            if segment.len() < smallest {
                segment.into_iter().for_each(|i| out[i] = NONE);
            }
        }
        out
    }

    #[test]
    fn equals_a_flood_fill_on_noise_of_every_roughness() {
        let mut random = Random::new(21);
        for (width, height, levels, smallest) in
            [(31, 17, 3, 5), (40, 30, 6, 12), (64, 9, 2, 30), (1, 50, 3, 4), (50, 1, 3, 4)]
                .repeat(8)
        {
            // Few levels, so that segments of many sizes come about.
            let pixel = |random: &mut Random| match random.below(6) {
                0 => NONE,
                1 => (random.below(levels) as i16 * 64) | FILLED,
                _ => random.below(levels) as i16 * 64,
            };
            let image: Vec<i16> = (0..width * height).map(|_| pixel(&mut random)).collect();
            let mut fast = image.clone();
            // Filled with 7: nothing may rely on zeroed buffers.
            let (mut runs, mut ends, mut flags) =
                (vec![7; image.len()], vec![7; image.len()], vec![7; 3 * width]);
            let scratch = Scratch { runs: &mut runs, ends: &mut ends, flags: &mut flags };
            let blanked =
                RemoveSpeckles { disparity: &mut fast, width, similarity: 64, smallest, scratch }
                    .run();
            assert!(fast == plain(&image, width, 64, smallest as usize));
            let removed = |bit| {
                image.iter().zip(&fast).filter(|(a, b)| a != b && **a & FILLED == bit).count()
                    as u32
            };
            assert_eq!(blanked, Blanked { measured: removed(0), filled: removed(FILLED) });
        }
    }
}
