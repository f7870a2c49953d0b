//! An image's features, sorted so that a search window is a few contiguous runs.
//!
//! Order: by class, then by bands of [`CELL_V`] rows, then by cells of [`CELL_U`] columns, then as found. Positions and descriptors
//! stand in separate arrays, so that comparing a run of neighbours reads contiguous 32-byte descriptors.
//!
//! Memory: 36 bytes per feature, and 4 bytes per class and cell (16 / 256 bytes per pixel).

use super::suppression::{CLASSES, Candidate};
use crate::memory::Capacity;

/// Columns of a cell.
pub(super) const CELL_U: usize = 32;
/// Rows of a cell.
pub(super) const CELL_V: usize = 8;
/// Bytes of a descriptor: 16 positions, two Sobel responses each.
pub(super) const DESCRIPTOR: usize = 32;

/// Where a descriptor samples the gradients, relative to the feature: 16 positions within 11 x 11 px, finer towards the middle.
const SAMPLES: [(isize, isize); DESCRIPTOR / 2] = [
    (-2, -5),
    (2, -5),
    (-5, -3),
    (0, -3),
    (5, -3),
    (-1, -1),
    (1, -1),
    (-3, 0),
    (3, 0),
    (-1, 1),
    (1, 1),
    (-5, 3),
    (0, 3),
    (5, 3),
    (-2, 5),
    (2, 5),
];

/// One image's features of one pass.
#[derive(Debug)]
pub(super) struct Features<'s> {
    at: &'s mut [[u16; 2]],
    descriptor: &'s mut [[u8; DESCRIPTOR]],
    start: &'s mut [u32],
    len: usize,
    bands: usize,
    cells: usize,
}

/// Entries of the table of cell starts.
pub(super) const fn table(capacity: &Capacity) -> usize {
    CLASSES * capacity.image_width.div_ceil(CELL_U) * capacity.image_height.div_ceil(CELL_V) + 1
}

impl<'s> Features<'s> {
    /// An empty set with space for as many features as `at` and `descriptor` have entries, `start` has [`table`] of them.
    pub(super) fn new(at: &'s mut [[u16; 2]], descriptor: &'s mut [[u8; DESCRIPTOR]], start: &'s mut [u32]) -> Self {
        Self { at, descriptor, start, len: 0, bands: 0, cells: 0 }
    }

    /// Features in the set.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Forgets all features.
    pub(super) fn clear(&mut self) {
        self.len = 0;
        self.bands = 0;
        self.cells = 0;
    }

    /// Position (u, v) of a feature, px.
    pub(super) fn at(&self, index: usize) -> Option<[u16; 2]> {
        self.at.get(index).copied()
    }

    /// Sorts candidates in and describes them by `gradient`, whose rows are `width` apart. The first that fit are kept; returns how
    /// many were dropped.
    pub(super) fn fill(
        &mut self,
        candidates: impl Iterator<Item = Candidate> + Clone,
        gradient: &[u16],
        width: usize,
        height: usize,
    ) -> usize {
        self.bands = height.div_ceil(CELL_V);
        self.cells = width.div_ceil(CELL_U);
        let accepted = candidates.clone().take(self.at.len());
        let keys = CLASSES * self.bands * self.cells;
        let Some(start) = self.start.get_mut(..=keys) else {
            self.clear();
            return candidates.count();
        };
        let key = |c: Candidate| (usize::from(c.class) * self.bands + usize::from(c.v) / CELL_V) * self.cells + usize::from(c.u) / CELL_U;
        // Count, turn counts into starts one entry to the right, then insert: each cell's cursor ends as the next one's start.
        start.fill(0);
        for candidate in accepted.clone() {
            if let Some(count) = start.get_mut(key(candidate) + 1) {
                *count += 1;
            }
        }
        let mut sum = 0;
        for entry in start.iter_mut() {
            sum += *entry;
            *entry = sum;
        }
        self.len = sum as usize;
        for candidate in accepted {
            let Some(cursor) = start.get_mut(key(candidate)) else { continue };
            let slot = *cursor as usize;
            *cursor += 1;
            if let (Some(at), Some(descriptor)) = (self.at.get_mut(slot), self.descriptor.get_mut(slot)) {
                *at = [candidate.u, candidate.v];
                describe(gradient, width, usize::from(candidate.u), usize::from(candidate.v), descriptor);
            }
        }
        start.copy_within(..keys, 1);
        if let Some(first) = start.first_mut() {
            *first = 0;
        }
        candidates.count() - self.len
    }

    /// The class of a feature: features are sorted by it.
    pub(super) fn class(&self, index: usize) -> usize {
        let per_class = self.bands * self.cells;
        (1..CLASSES).filter(|class| self.start.get(class * per_class).is_some_and(|&start| start as usize <= index)).count()
    }

    /// Descriptor of a feature.
    pub(super) fn descriptor(&self, index: usize) -> Option<&[u8; DESCRIPTOR]> {
        self.descriptor.get(index)
    }

    /// The feature of `class` within the window whose descriptor is nearest; the first of equals in the set's order.
    pub(super) fn nearest(&self, class: usize, window: Window, descriptor: &[u8; DESCRIPTOR]) -> Option<usize> {
        if window.u_max < 0 || window.v_max < 0 || window.u_min > window.u_max || window.v_min > window.v_max || self.bands == 0 {
            return None;
        }
        let [u_min, u_max, v_min, v_max] = [window.u_min, window.u_max, window.v_min, window.v_max].map(|x| x.max(0) as usize);
        let (first_band, last_band) = (v_min / CELL_V, (v_max / CELL_V).min(self.bands - 1));
        let (first_cell, last_cell) = (u_min / CELL_U, (u_max / CELL_U).min(self.cells - 1));
        if first_cell > last_cell {
            return None;
        }
        // Positions are below 2^16, so that a position left of or above the window wraps to one far beyond it.
        let low = [u_min, v_min].map(|x| x as u16);
        let span = [u_max - u_min, v_max - v_min].map(|x| x.min(usize::from(u16::MAX)) as u16);
        let (mut best, mut best_difference) = (None, u32::MAX);
        for band in first_band..=last_band {
            let row = (class * self.bands + band) * self.cells;
            let (Some(&from), Some(&to)) = (self.start.get(row + first_cell), self.start.get(row + last_cell + 1)) else { continue };
            let run = from as usize..to as usize;
            let (Some(at), Some(descriptors)) = (self.at.get(run.clone()), self.descriptor.get(run)) else { continue };
            if let Some((index, difference)) = closest(at, descriptors, low, span, descriptor, best_difference) {
                (best, best_difference) = (Some(from as usize + index), difference);
            }
        }
        best
    }
}

/// The first of a run's features that is inside the window and differs least, if it differs by less than `bound`.
///
/// Whether a feature is inside is a coin toss that no branch predictor wins: all are compared, and those outside lose. The descriptor
/// sought is read anew each time because a compiler that may keep it in registers keeps it there widened, and then misses the one
/// instruction for sums of absolute differences.
#[inline(never)]
fn closest(
    at: &[[u16; 2]],
    descriptors: &[[u8; DESCRIPTOR]],
    low: [u16; 2],
    span: [u16; 2],
    sought: &[u8; DESCRIPTOR],
    bound: u32,
) -> Option<(usize, u32)> {
    let (mut best, mut best_difference) = (usize::MAX, bound);
    for (index, (at, other)) in at.iter().zip(descriptors).enumerate() {
        let inside = (at[0].wrapping_sub(low[0]) <= span[0]) & (at[1].wrapping_sub(low[1]) <= span[1]);
        let difference = difference(core::hint::black_box(sought), other) | if inside { 0 } else { u32::MAX };
        if difference < best_difference {
            (best, best_difference) = (index, difference);
        }
    }
    (best != usize::MAX).then_some((best, best_difference))
}

/// A search window, px, ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Window {
    pub u_min: i32,
    pub u_max: i32,
    pub v_min: i32,
    pub v_max: i32,
}

/// Samples the gradients around a feature that is at least 5 px inside the image.
fn describe(gradient: &[u16], width: usize, u: usize, v: usize, out: &mut [u8; DESCRIPTOR]) {
    let centre = v * width + u;
    for (pair, (du, dv)) in out.chunks_exact_mut(2).zip(SAMPLES) {
        let at = centre.wrapping_add_signed(dv * width as isize + du);
        pair.copy_from_slice(&gradient.get(at).copied().unwrap_or(0).to_le_bytes());
    }
}

/// Sum of absolute differences.
#[inline(always)]
fn difference(a: &[u8; DESCRIPTOR], b: &[u8; DESCRIPTOR]) -> u32 {
    a.iter().zip(b).map(|(&a, &b)| u32::from(a.abs_diff(b))).sum()
}
