//! What is kept of one camera: two frames, the previous and the current one, swapped by index.

use super::{
    features::Features,
    filter::{COLUMN_SUMS, Responses, filter},
    suppression::{Candidate, Field, suppress},
};
use crate::{
    image::View,
    memory::{Capacity, Carver, SlabError, region_bytes},
};

/// Counts of one image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FeatureCount {
    /// Features of the dense pass kept.
    pub dense: u32,
    /// Features of the sparse pass kept.
    pub sparse: u32,
    /// Features found beyond `capacity.features` (dense) or a quarter of it (sparse), and dropped.
    pub dropped: u32,
}

/// One image and its features.
#[derive(Debug)]
pub(super) struct Frame<'s> {
    pub pixels: &'s mut [u8],
    pub dense: Features<'s>,
    pub sparse: Features<'s>,
}

/// One camera.
#[derive(Debug)]
pub(super) struct Camera<'s> {
    frames: [Frame<'s>; 2],
    /// Which of the two is the current one.
    current: bool,
    gradient: &'s mut [u16],
    blob: &'s mut [i16],
    corner: &'s mut [i16],
    rows: &'s mut [i16],
    candidates: &'s mut [Candidate],
}

/// Names of one camera's regions.
pub(super) struct Names {
    pub pixels: [&'static str; 2],
    pub dense: [[&'static str; 3]; 2],
    pub sparse: [[&'static str; 3]; 2],
    pub scratch: [&'static str; 5],
}

/// Features of the sparse pass: its peaks are at most a sixth as dense.
const fn sparse(capacity: &Capacity) -> usize {
    capacity.features / 4
}

impl<'s> Camera<'s> {
    pub(super) const fn bytes(capacity: &Capacity) -> usize {
        let pixels = capacity.pixels();
        let frame =
            region_bytes::<u8>(pixels) + Features::bytes(capacity, capacity.features) + Features::bytes(capacity, sparse(capacity));
        2 * frame
            + region_bytes::<u16>(pixels)
            + 2 * region_bytes::<i16>(pixels)
            + region_bytes::<i16>(COLUMN_SUMS * capacity.image_width)
            + region_bytes::<Candidate>(capacity.features)
    }

    pub(super) fn carve(capacity: &Capacity, carver: &mut Carver<'s>, names: &Names) -> Result<Self, SlabError> {
        let pixels = capacity.pixels();
        let [first, second] = [0, 1];
        let mut frame = |which: usize| -> Result<Frame<'s>, SlabError> {
            let pick = |names: &[[&'static str; 3]; 2]| if which == first { names[0] } else { names[1] };
            Ok(Frame {
                pixels: carver.cut(if which == first { names.pixels[0] } else { names.pixels[1] }, pixels)?,
                dense: Features::carve(capacity, carver, capacity.features, pick(&names.dense))?,
                sparse: Features::carve(capacity, carver, sparse(capacity), pick(&names.sparse))?,
            })
        };
        Ok(Self {
            frames: [frame(first)?, frame(second)?],
            current: false,
            gradient: carver.cut(names.scratch[0], pixels)?,
            blob: carver.cut(names.scratch[1], pixels)?,
            corner: carver.cut(names.scratch[2], pixels)?,
            rows: carver.cut(names.scratch[3], COLUMN_SUMS * capacity.image_width)?,
            candidates: carver.cut(names.scratch[4], capacity.features)?,
        })
    }

    /// The previous and the current frame.
    pub(super) fn frames(&self) -> (&Frame<'s>, &Frame<'s>) {
        let [a, b] = &self.frames;
        if self.current { (a, b) } else { (b, a) }
    }

    /// Makes the current frame the previous one and takes in an image no larger than the capacity.
    pub(super) fn take(&mut self, image: View<'_, u8>, response_min: i16) -> FeatureCount {
        self.current = !self.current;
        let [a, b] = &mut self.frames;
        let frame = if self.current { b } else { a };
        let (width, height) = (image.width(), image.height());
        let pixels = width * height;
        let (Some(gradient), Some(blob), Some(corner)) =
            (self.gradient.get_mut(..pixels), self.blob.get_mut(..pixels), self.corner.get_mut(..pixels))
        else {
            frame.dense.clear();
            frame.sparse.clear();
            return FeatureCount::default();
        };
        for (kept, row) in frame.pixels.chunks_exact_mut(width).zip(image.rows()) {
            kept.copy_from_slice(row);
        }
        filter(image, Responses { gradient, blob, corner }, self.rows);
        let mut found = 0;
        let mut slots = self.candidates.iter_mut();
        suppress(Field { response: blob, width }, Field { response: corner, width }, response_min, self.rows, |candidate| {
            found += 1;
            if let Some(slot) = slots.next() {
                *slot = candidate;
            }
        });
        let candidates = self.candidates.iter().take(found).copied();
        let mut dropped = found.saturating_sub(self.candidates.len());
        dropped += frame.dense.fill(candidates.clone(), gradient, width, height);
        dropped += frame.sparse.fill(candidates.filter(|candidate| candidate.sparse == 1), gradient, width, height);
        FeatureCount { dense: frame.dense.len() as u32, sparse: frame.sparse.len() as u32, dropped: dropped as u32 }
    }
}
