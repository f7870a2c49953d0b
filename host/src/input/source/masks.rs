//! The instances of one frame, each with its mask, and what had to be left out.

use crate::formats::Image;
use dynvox_core::masks::PixelBox;
use dynvox_core::tracking::{Class, Detection};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Masks kept of one frame at most; the core takes fewer. Of more the lowest scores go, and are
/// counted.
pub const MAX_MASKS: usize = 1_000;
/// Bytes of masks kept of one frame at most.
pub const MAX_BYTES: usize = 64 << 20;

/// An instance in the left image.
#[derive(Clone, Debug, PartialEq)]
pub struct InstanceMask {
    /// Class that the source gives.
    pub class: Class,
    /// Confidence of the source. The core refuses values outside 0..=1.
    pub score: f32,
    /// The box its mask fills.
    pub pixels: PixelBox,
    /// The mask, row by row within the box, 0 or 1.
    pub mask: Vec<u8>,
}

impl InstanceMask {
    /// Returns the mask as the core takes it.
    pub fn detection(&self) -> Detection<'_> {
        Detection {
            class: self.class,
            score: self.score,
            left: self.pixels.left,
            top: self.pixels.top,
            width: self.pixels.width.max(0) as u32,
            height: self.pixels.height.max(0) as u32,
            mask: &self.mask,
        }
    }

    /// Returns true if the mask contains a pixel.
    pub fn contains(&self, u: i32, v: i32) -> bool {
        let at = || {
            (v - self.pixels.top) as usize * self.pixels.width as usize
                + (u - self.pixels.left) as usize
        };
        self.pixels.contains(u, v) && self.mask.get(at()).is_some_and(|&pixel| pixel != 0)
    }

    /// The mask of the pixels within `within` for which `holds` is true, its box shrunk to what it
    /// fills; `None` when that is nothing.
    pub fn from_predicate(
        class: Class,
        score: f32,
        within: PixelBox,
        holds: impl Fn(i32, i32) -> bool,
    ) -> Option<Self> {
        let mut filled: Option<[i32; 4]> = None;
        let mut mask = Vec::with_capacity(within.area() as usize);
        for v in within.top..within.top + within.height {
            for u in within.left..within.left + within.width {
                let inside = holds(u, v);
                if inside {
                    let [l, t, r, b] = filled.unwrap_or([u, v, u, v]);
                    filled = Some([l.min(u), t.min(v), r.max(u), b.max(v)]);
                }
                mask.push(u8::from(inside));
            }
        }
        let [left, top, right, bottom] = filled?;
        let pixels = PixelBox { left, top, width: right - left + 1, height: bottom - top + 1 };
        if pixels != within {
            let rows = mask
                .chunks_exact(within.width as usize)
                .skip((top - within.top) as usize)
                .take(pixels.height as usize);
            let columns = (left - within.left) as usize..(right + 1 - within.left) as usize;
            mask = rows.flat_map(|row| &row[columns.clone()]).copied().collect();
        }
        Some(Self { class, score, pixels, mask })
    }

    /// Scales the mask to an image scaled by `scale` to `size`: the pixel in the middle of each
    /// covered area decides.
    pub fn scaled(&self, scale: f64, size: (usize, usize)) -> Option<Self> {
        let image = PixelBox { left: 0, top: 0, width: size.0 as i32, height: size.1 as i32 };
        let from = |at: i32| (f64::from(at) * scale).floor() as i32 - 1;
        let side = |side: i32| (f64::from(side) * scale).ceil() as i32 + 3;
        let PixelBox { left, top, width, height } = self.pixels;
        let around =
            PixelBox { left: from(left), top: from(top), width: side(width), height: side(height) };
        let middle = |at: i32| ((f64::from(at) + 0.5) / scale) as i32;
        Self::from_predicate(self.class, self.score, around.intersection(&image), |u, v| {
            self.contains(middle(u), middle(v))
        })
    }
}

/// Counts of masks that a source gave and that could not be used, or not as given. Nothing is
/// dropped without being counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MaskRefusals {
    /// Frames without a file of masks: nothing is seen in them.
    pub missing: u32,
    /// Instances in the picture that the list does not name.
    pub unnamed: u32,
    /// Names or numbers of unknown classes; kept as [`Class::Other`].
    pub unknown_class: u32,
    /// Masks without a pixel.
    pub empty: u32,
    /// Masks beyond the ceilings.
    pub beyond: u32,
}

impl MaskRefusals {
    /// Adds another frame's.
    pub fn add(&mut self, other: &Self) {
        self.missing += other.missing;
        self.unnamed += other.unnamed;
        self.unknown_class += other.unknown_class;
        self.empty += other.empty;
        self.beyond += other.beyond;
    }

    /// All counts by name.
    pub fn named(&self) -> [(&'static str, u32); 5] {
        [
            ("frames without masks", self.missing),
            ("instances without a row", self.unnamed),
            ("unknown classes", self.unknown_class),
            ("empty masks", self.empty),
            ("masks beyond the ceiling", self.beyond),
        ]
    }
}

/// The masks of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameMasks {
    /// The instances, one by one.
    pub instances: Vec<InstanceMask>,
    /// Counts of refused masks.
    pub refusals: MaskRefusals,
    bytes: usize,
}

impl FrameMasks {
    /// The masks of a frame without a file.
    pub fn missing() -> Self {
        Self::refusing(MaskRefusals { missing: 1, ..MaskRefusals::default() })
    }

    /// No masks yet, and what is not among them.
    pub fn refusing(refusals: MaskRefusals) -> Self {
        Self { refusals, ..Self::default() }
    }

    /// Reserves bytes for a mask and returns true; returns false and counts the mask if it exceeds
    /// the limits.
    pub fn reserve(&mut self, bytes: usize) -> bool {
        let fits =
            self.instances.len() < MAX_MASKS && self.bytes.saturating_add(bytes) <= MAX_BYTES;
        self.refusals.beyond += u32::from(!fits);
        fits
    }

    /// Adds a mask that fits.
    pub fn push(&mut self, mask: Option<InstanceMask>) {
        match mask {
            Some(mask) => {
                self.bytes += mask.mask.len();
                self.instances.push(mask);
            }
            None => self.refusals.empty += 1,
        }
    }

    /// Takes the instances out of an image of labels, best first.
    pub fn extract(
        &mut self,
        labels: &Image<u16>,
        boxes: &BTreeMap<u16, PixelBox>,
        mut named: Vec<(u16, Class, f32)>,
    ) {
        named.sort_by(|a, b| b.2.total_cmp(&a.2).then(a.0.cmp(&b.0)));
        for (label, class, score) in named {
            let Some(pixels) = boxes.get(&label) else {
                self.refusals.empty += 1;
                continue;
            };
            if self.reserve(pixels.area() as usize) {
                self.push(InstanceMask::from_predicate(class, score, *pixels, |u, v| {
                    labels.get(u as usize, v as usize) == Some(label)
                }));
            }
        }
    }
}

/// The box of every label but 0.
pub fn bounding_boxes(labels: &Image<u16>) -> BTreeMap<u16, PixelBox> {
    let mut boxes = BTreeMap::<u16, PixelBox>::new();
    for (v, row) in (0..).zip(labels.pixels().chunks_exact(labels.width())) {
        let mut u = 0i32;
        // Neighbours mostly agree: a run at a time.
        for run in row.chunk_by(|a, b| a == b) {
            let width = run.len() as i32;
            if let Some(&label) = run.first().filter(|&&label| label != 0) {
                let run = PixelBox { left: u, top: v, width, height: 1 };
                boxes.entry(label).and_modify(|known| *known = union(known, &run)).or_insert(run);
            }
            u += width;
        }
    }
    boxes
}

/// The box around two.
pub fn union(a: &PixelBox, b: &PixelBox) -> PixelBox {
    let (left, top) = (a.left.min(b.left), a.top.min(b.top));
    let (right, bottom) =
        ((a.left + a.width).max(b.left + b.width), (a.top + a.height).max(b.top + b.height));
    PixelBox { left, top, width: right - left, height: bottom - top }
}
