//! An image's features, sorted so that a search window is a few contiguous runs.
//!
//! Order: by class, then by bands of [`CELL_V`] rows, then by cells of [`CELL_U`] columns, then as
//! found. Positions and descriptors stand in separate arrays, so that comparing a run of neighbours
//! reads contiguous 32-byte descriptors.
//!
//! Memory: 36 bytes per feature, and 4 bytes per class and cell (16 / 256 bytes per pixel).

use super::suppression::{CLASSES, Candidate};
use crate::{
    lanes::{Eight, LANES},
    memory::Capacity,
    sad::{Descriptor, Inside, Kernels, NO_FEATURE, OFFSET_BITS},
};

/// Columns of a cell.
pub(super) const CELL_U: usize = 32;
/// Rows of a cell.
pub(super) const CELL_V: usize = 8;
/// Bytes of a descriptor: 16 positions, two Sobel responses each.
const DESCRIPTOR: usize = 32;

/// Positions at which a descriptor samples the gradients, relative to the feature: 16 within 11 x
/// 11 px, finer towards the middle.
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

/// Class and place of a feature that is sought, and the descriptor that it should have.
pub(super) struct Sought<'d> {
    pub class: usize,
    pub window: Window,
    pub descriptor: &'d [Descriptor; 2],
}

/// One image's features of one pass.
#[derive(Debug)]
pub(super) struct Features<'s> {
    at: &'s mut [[u16; 2]],
    descriptor: &'s mut [[Descriptor; 2]],
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
    /// An empty set with space for as many features as `at` and `descriptor` have entries, `start`
    /// has [`table`] of them.
    pub(super) fn new(
        at: &'s mut [[u16; 2]],
        descriptor: &'s mut [[Descriptor; 2]],
        start: &'s mut [u32],
    ) -> Self {
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

    /// Sorts candidates in and describes them by `gradient`, whose rows are `width` apart. The
    /// first that fit are kept; returns how many were dropped.
    #[inline(always)]
    pub(super) fn fill(
        &mut self,
        candidates: impl Iterator<Item = Candidate> + Clone,
        gradient: &[u16],
        width: usize,
        height: usize,
    ) -> usize {
        // Keys are class, band and cell: a search reads whole runs of one band.
        self.bands = height.div_ceil(CELL_V);
        self.cells = width.div_ceil(CELL_U);
        let accepted = candidates.clone().take(self.at.len());
        let keys = CLASSES * self.bands * self.cells;
        let Some(start) = self.start.get_mut(..=keys) else {
            self.clear();
            return candidates.count();
        };
        let key = |c: Candidate| {
            (usize::from(c.class) * self.bands + usize::from(c.v) / CELL_V) * self.cells
                + usize::from(c.u) / CELL_U
        };
        // Count, turn counts into starts one entry to the right, then insert: each cell's cursor
        // ends as the next one's start.
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
            if let (Some(at), Some(descriptor)) =
                (self.at.get_mut(slot), self.descriptor.get_mut(slot))
            {
                *at = [candidate.u, candidate.v];
                describe(
                    gradient,
                    width,
                    usize::from(candidate.u),
                    usize::from(candidate.v),
                    bytemuck::cast_mut(descriptor),
                );
            }
        }
        // Undo the cursors' advance.
        start.copy_within(..keys, 1);
        if let Some(first) = start.first_mut() {
            *first = 0;
        }
        candidates.count() - self.len
    }

    /// The class of a feature: features are sorted by it.
    pub(super) fn class(&self, index: usize) -> usize {
        let per_class = self.bands * self.cells;
        (1..CLASSES)
            .filter(|class| {
                self.start.get(class * per_class).is_some_and(|&start| start as usize <= index)
            })
            .count()
    }

    /// Descriptor of a feature.
    pub(super) fn descriptor(&self, index: usize) -> Option<&[Descriptor; 2]> {
        self.descriptor.get(index)
    }

    /// The feature of a class within a window whose descriptor is nearest; the first of equals in
    /// the set's order. Adds the descriptors that were compared to `compared`.
    #[inline(always)]
    pub(super) fn nearest(
        &self,
        sought: Sought<'_>,
        kernels: &impl Kernels,
        compared: &mut u64,
    ) -> Option<usize> {
        let Sought { class, window, descriptor } = sought;
        if window.u_max < 0
            || window.v_max < 0
            || window.u_min > window.u_max
            || window.v_min > window.v_max
            || self.bands == 0
        {
            return None;
        }
        // Clip the window to the image's cells.
        let [u_min, u_max, v_min, v_max] =
            [window.u_min, window.u_max, window.v_min, window.v_max].map(|x| x.max(0) as usize);
        let (first_band, last_band) = (v_min / CELL_V, (v_max / CELL_V).min(self.bands - 1));
        let (first_cell, last_cell) = (u_min / CELL_U, (u_max / CELL_U).min(self.cells - 1));
        if first_cell > last_cell {
            return None;
        }
        // Positions are compared in 16 bits: one subtraction tests both ends of the window.
        let low = [u_min, v_min].map(|x| x.min(usize::from(u16::MAX)) as u16);
        let span = [u_max - u_min, v_max - v_min].map(|x| x.min(usize::from(u16::MAX)) as u16);
        let mut best = Best::default();
        let (mut origin, mut keys) = (0, [NO_FEATURE; LANES]);
        for band in first_band..=last_band {
            let row = (class * self.bands + band) * self.cells;
            let (Some(&from), Some(&to)) =
                (self.start.get(row + first_cell), self.start.get(row + last_cell + 1))
            else {
                continue;
            };
            // No 4 x 4 px hold two features of a class: a band's offsets fit, and mostly all
            // bands'.
            if band == first_band || to.saturating_sub(origin) >> OFFSET_BITS != 0 {
                best.take(origin, keys);
                (origin, keys) = (from, [NO_FEATURE; LANES]);
            }
            *compared += u64::from(to.saturating_sub(from));
            let end = to.saturating_sub(origin);
            for offset in (from.saturating_sub(origin)..end).step_by(LANES) {
                let start = (origin + offset) as usize;
                let inside = |at| Inside { at, low, span, offset, end };
                // The last few of the set are copied into eight padded ones.
                keys = match (chunk(self.at, start), chunk(self.descriptor, start)) {
                    (Some(at), Some(others)) => {
                        kernels.least_inside(keys, descriptor, others, &inside(at))
                    }
                    _ => {
                        let (at, others) = self.last_eight(start);
                        kernels.least_inside(keys, descriptor, &others, &inside(&at))
                    }
                };
            }
        }
        best.take(origin, keys);
        best.index
    }

    /// The set's last features from `start` on, fewer than eight, and others that mean nothing.
    #[cold]
    #[inline(never)]
    fn last_eight(&self, start: usize) -> (Eight<[u16; 2]>, Eight<[Descriptor; 2]>) {
        let mut eight = ([[0; 2]; LANES], [[Descriptor([0; 16]); 2]; LANES]);
        eight.0.iter_mut().zip(self.at.iter().skip(start)).for_each(|(to, at)| *to = *at);
        eight
            .1
            .iter_mut()
            .zip(self.descriptor.iter().skip(start))
            .for_each(|(to, descriptor)| *to = *descriptor);
        eight
    }
}

/// The nearest feature so far.
#[derive(Default)]
struct Best {
    index: Option<usize>,
    /// Key without the offset; a candidate counts if its own is less.
    difference: u32,
}

impl Best {
    /// Takes in the least keys of features that are counted from `origin` on and come after those
    /// before.
    #[inline(always)]
    fn take(&mut self, origin: u32, keys: Eight<u32>) {
        let key = keys.into_iter().fold(NO_FEATURE, |a, b| a.min(b));
        let difference = key >> OFFSET_BITS;
        if key != NO_FEATURE && (self.index.is_none() || difference < self.difference) {
            self.difference = difference;
            self.index = Some((origin + (key & ((1 << OFFSET_BITS) - 1))) as usize);
        }
    }
}

/// Eight values from `start` on.
#[inline(always)]
fn chunk<T>(values: &[T], start: usize) -> Option<&Eight<T>> {
    values.get(start..)?.first_chunk()
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
#[inline(always)]
fn describe(gradient: &[u16], width: usize, u: usize, v: usize, out: &mut [u8; DESCRIPTOR]) {
    let centre = v * width + u;
    for (pair, (du, dv)) in out.chunks_exact_mut(2).zip(SAMPLES) {
        let at = centre.wrapping_add_signed(dv * width as isize + du);
        pair.copy_from_slice(&gradient.get(at).copied().unwrap_or(0).to_le_bytes());
    }
}
