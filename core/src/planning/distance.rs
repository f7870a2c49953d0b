//! The exact Euclidean distance transform, in integers.
//!
//! For every cell the squared distance from its centre to the nearest centre of a cell of the other
//! kind, in cells: of an obstacle where the cell is none, and of a cell without where it is one. So
//! the field is signed, and one transform gives both sides. It is separable (Saito, Toriwaki: *New
//! algorithms for Euclidean distance transformation of an n-dimensional digitized picture*, 1994):
//! the first pass counts steps along y, each further pass takes, along x and then z, the lower
//! envelope of the parabolas that the pass before left (Maurer, Qi, Raghavan: *A Linear Time
//! Algorithm for Computing Exact Euclidean Distance Transforms of Binary Images in Arbitrary
//! Dimensions*, 2003; Felzenszwalb, Huttenlocher: *Distance Transforms of Sampled Functions*,
//! 2012). Parabolas are compared by products, so nothing is divided and nothing is rounded.
//!
//! A line falls into runs of one kind. The cells next to a run are of the other kind and 0 away
//! from it, so they hide all that lies beyond them: each run needs itself and these two, and no
//! cell is looked at for the other side's sake.
//!
//! Of several nearest cells the one with the lowest z, of these with the lowest x, of these with
//! the lowest y is kept: the order is total, so it does not depend on how the work is done.
//!
//! Memory: 8 bytes a cell and 16 bytes for each cell of the longest side. Time: linear in the
//! cells, whichever are obstacles.

use crate::{
    digest::Digest,
    memory::{Carver, region_bytes},
    slices::{clipped, clipped_mut},
};
use bytemuck::{Pod, Zeroable};

/// A squared distance where there is no cell of the other kind.
pub const NO_OBSTACLE: u32 = u32::MAX;

/// A cell that others may be nearest to: of the other kind, or with a way to one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
struct Site {
    /// Position on the line.
    at: u32,
    /// Squared distance from it to the nearest cell, across the line.
    squared: u32,
    /// Cell of the obstacle.
    nearest: u32,
    reserved: u32,
}

impl Site {
    /// Squared distance from a place on the line.
    fn squared_from(&self, at: u32) -> u64 {
        let along = u64::from(at.abs_diff(self.at));
        along * along + u64::from(self.squared)
    }

    /// Returns true if this parabola, between two others on the line, is nowhere below both: the
    /// positions where they intersect tell.
    fn is_hidden(&self, before: &Self, after: &Self) -> bool {
        let [a, b] = [self.at - before.at, after.at - self.at].map(i64::from);
        let [own, first, last] = [self.squared, before.squared, after.squared].map(i64::from);
        let c = a + b;
        c * own - b * first - a * last - a * b * c >= 0
    }
}

/// A distance field: the result of the last transform.
///
/// ```
/// use dynvox_core::{memory::{Carver, SLAB_ALIGN}, planning::DistanceField};
///
/// let bytes = DistanceField::bytes(5 * 4, 5);
/// let mut slab = vec![0; bytes + SLAB_ALIGN];
/// let mut field = DistanceField::new_in(5 * 4, 5, &mut Carver::new(&mut slab, bytes)?);
/// let mut is_obstacle = [0; 5 * 4];
/// is_obstacle[7] = 1; // (2, 1)
/// assert!(field.transform(&is_obstacle, [5, 4, 1]));
/// assert_eq!(field.get(3 * 5 + 4), Some((8, 7))); // (4, 3): 2 and 2 cells away
/// assert_eq!(field.get(7), Some((1, 6))); // (1, 1): of the four beside it the one with the lowest x
/// # Ok::<(), dynvox_core::memory::SlabError>(())
/// ```
#[derive(Debug)]
pub struct DistanceField<'s> {
    /// Squared distances in cells, [`NO_OBSTACLE`] where no cell is of it.
    squared: &'s mut [u32],
    /// Positions of the nearest cells of the other kind.
    nearest: &'s mut [u32],
    sites: &'s mut [Site],
}

impl<'s> DistanceField<'s> {
    /// Bytes for so many cells, with lines of at most `longest`.
    pub const fn bytes(cells: usize, longest: usize) -> usize {
        2 * region_bytes::<u32>(cells) + region_bytes::<Site>(if cells == 0 { 0 } else { longest })
    }

    /// Allocates them.
    pub fn new_in(cells: usize, longest: usize, carver: &mut Carver<'s>) -> Self {
        Self {
            squared: carver.alloc("planning.squared", cells),
            nearest: carver.alloc("planning.nearest", cells),
            sites: carver.alloc("planning.sites", if cells == 0 { 0 } else { longest }),
        }
    }

    /// Squared distance to the nearest cell of the other kind, in cells, and that cell's position;
    /// `None` where all are of one kind or the position is outside.
    pub fn get(&self, position: usize) -> Option<(u32, usize)> {
        let squared = *self.squared.get(position)?;
        (squared != NO_OBSTACLE).then_some((squared, *self.nearest.get(position)? as usize))
    }

    /// Adds all of it to a digest.
    pub(super) fn digest(&self, digest: &mut Digest) {
        self.squared.iter().zip(&*self.nearest).for_each(|(squared, nearest)| {
            digest.u64(u64::from(*squared) << 32 | u64::from(*nearest))
        });
    }

    /// Transforms a field of `[width, length, height]` cells, cell (x, y, z) at
    /// `(y * width + x) * height + z`. `is_obstacle` is 0 or 1. A field larger than the memory is
    /// refused: `false`, and nothing changes.
    pub fn transform(&mut self, is_obstacle: &[u8], [width, length, height]: [usize; 3]) -> bool {
        let cells = width * length * height;
        let longest = if width > height { width } else { height };
        if is_obstacle.len() != cells || cells > self.squared.len() || longest > self.sites.len() {
            debug_assert!(false, "internal fault: a field fits its memory");
            return false;
        }
        let row = width * height;
        self.across_rows(is_obstacle, row, length);
        // The second pass, along x.
        for y in 0..length {
            (0..height).for_each(|z| self.along_line(is_obstacle, [y * row + z, height, width]));
        }
        // The third pass, along z; a field of one level has none.
        if height > 1 {
            (0..width * length)
                .for_each(|column| self.along_line(is_obstacle, [column * height, 1, height]));
        }
        true
    }

    /// The first pass, along y: rows of `row` cells, one after the other, up and down again.
    fn across_rows(&mut self, is_obstacle: &[u8], row: usize, rows: usize) {
        let (squared, nearest) =
            (clipped_mut(self.squared, ..row * rows), clipped_mut(self.nearest, ..row * rows));
        clipped_mut(squared, ..row).fill(NO_OBSTACLE);
        // Steps to the nearest cell of the other kind in the rows before.
        for y in 1..rows {
            let Some((before, after)) = squared.split_at_mut_checked(y * row) else { return };
            let kinds = clipped(is_obstacle, (y - 1) * row..y * row)
                .iter()
                .zip(clipped(is_obstacle, y * row..(y + 1) * row));
            for ((steps, last), (other, own)) in
                after.iter_mut().zip(clipped(before, (y - 1) * row..)).zip(kinds)
            {
                *steps = if own == other { last.saturating_add(1) } else { 1 };
            }
        }
        // In the first of them that is as near.
        let row_cells = row as u32;
        for ((at, nearest), steps) in (0u32..).zip(nearest.iter_mut()).zip(&*squared) {
            *nearest = at.wrapping_sub(steps.wrapping_mul(row_cells));
        }
        // And in the rows after, which win where they are nearer.
        for y in (1..rows).rev() {
            let Some((before, after)) = squared.split_at_mut_checked(y * row) else { return };
            let Some((near_before, near_after)) = nearest.split_at_mut_checked(y * row) else {
                return;
            };
            let kinds = clipped(is_obstacle, (y - 1) * row..y * row)
                .iter()
                .zip(clipped(is_obstacle, y * row..(y + 1) * row));
            let below = clipped_mut(before, (y - 1) * row..)
                .iter_mut()
                .zip(clipped_mut(near_before, (y - 1) * row..));
            let first = (y * row) as u32;
            for (((steps, near), (last, near_last)), ((own, other), at)) in
                below.zip(after.iter().zip(&*near_after)).zip(kinds.zip(first..))
            {
                let (down, near_down) =
                    if own == other { (last.saturating_add(1), *near_last) } else { (1, at) };
                (*steps, *near) = if down < *steps { (down, near_down) } else { (*steps, *near) };
            }
        }
        // From here on distances are squares: sums of squares are exact in integers.
        for steps in squared.iter_mut().filter(|steps| **steps != NO_OBSTACLE) {
            *steps *= *steps;
        }
    }

    /// A further pass along one line: `count` cells, `step` apart, from `first` on.
    fn along_line(&mut self, is_obstacle: &[u8], [first, step, count]: [usize; 3]) {
        let kind = |at: usize| is_obstacle.get(first + at * step).copied().unwrap_or_default();
        let mut begin = 0;
        while begin < count {
            let own = kind(begin);
            let mut end = begin + 1;
            while end < count && kind(end) == own {
                end += 1;
            }
            self.along_run([first, step, count], begin, end);
            begin = end;
        }
    }

    /// One run of a line: the cells `begin..end` are of one kind, those next to it of the other.
    fn along_run(&mut self, [first, step, count]: [usize; 3], begin: usize, end: usize) {
        let mut len = 0usize;
        // The cells next to the run, one at each end, are obstacles of the other kind.
        let from = begin.saturating_sub(1);
        let to = if end < count { end + 1 } else { end };
        for at in from..to {
            let position = first + at * step;
            let other = at < begin || at >= end;
            let squared =
                if other { 0 } else { self.squared.get(position).copied().unwrap_or(NO_OBSTACLE) };
            if squared == NO_OBSTACLE {
                continue;
            }
            let nearest = if other {
                position as u32
            } else {
                self.nearest.get(position).copied().unwrap_or_default()
            };
            // A parabola that is nowhere lowest is dropped before this one is added.
            let site = Site { at: at as u32, squared, nearest, reserved: 0 };
            // The lower envelope of the parabolas, after Felzenszwalb and Huttenlocher.
            while let Some([before, last]) = len
                .checked_sub(2)
                .and_then(|low| self.sites.get(low..len))
                .and_then(|two| two.first_chunk::<2>())
            {
                if !last.is_hidden(before, &site) {
                    break;
                }
                len -= 1;
            }
            if let Some(entry) = self.sites.get_mut(len) {
                *entry = site;
                len += 1;
            }
        }
        let mut sites = clipped_mut(self.sites, ..len).iter().peekable();
        let Some(mut current) = sites.next() else { return };
        // Envelope and cells ascend together: each cell moves on to the parabola that is lowest
        // there.
        for at in begin as u32..end as u32 {
            let mut squared = current.squared_from(at);
            while let Some(next) = sites.next_if(|next| next.squared_from(at) < squared) {
                squared = next.squared_from(at);
                current = next;
            }
            let position = first + at as usize * step;
            if let (Some(entry), Some(nearest)) =
                (self.squared.get_mut(position), self.nearest.get_mut(position))
            {
                (*entry, *nearest) = (squared as u32, current.nearest);
            }
        }
    }
}
