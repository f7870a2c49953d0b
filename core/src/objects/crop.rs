//! Crop: the part of a frame that shows one object, its virtual frame, cropped to the object's box
//! (Section III-B of the paper).
//!
//! A crop is the disparity under the copy mask, 0 elsewhere, and the picture of the box. Next to an
//! edge the matcher's surface continues behind what is in front, and would stay attached to the
//! object, for no later frame observes that space: pixels next to much nearer ones are left out.
//! Crops of objects whose motion is uncertain are kept in a ring until it is known; when the ring
//! is full the oldest is dropped, and counted.
//!
//! Memory: 3 bytes a pixel of `capacity.crop_pixels`, 6 with colour, and [`MAX_CROPS`] entries of
//! 152 bytes.

use crate::{
    digest::Digest,
    geometry::{StereoRig, Transform, histogram::Histogram},
    image::View,
    invariants::Invariants,
    masks::{MaskHandle, MaskStore, PixelBox},
    memory::{Capacity, Carver, region_bytes},
    parallel::{Vectors, Work},
    slices::{clipped, clipped_mut},
    state::Visitor,
    volume::{BLOCK, EDGE_Q8, Surroundings},
};
use bytemuck::{Pod, Zeroable};

/// Most crops kept for later.
pub(crate) const MAX_CROPS: usize = 128;
/// Disparity units in a half pixel: the median is found to that, up to 256 px.
const BIN: u16 = 128;

/// Images and masks that a crop is cut from.
#[derive(Clone, Copy)]
pub(super) struct CropSource<'a> {
    pub rig: &'a StereoRig,
    /// Greatest distance along z from the median of the depths, m.
    pub extent_m: f32,
    /// 1/256 px, 0 none.
    pub disparity_q8: View<'a, u16>,
    pub masks: &'a MaskStore<'a>,
    pub mask: &'a MaskHandle,
}

impl CropSource<'_> {
    /// Copies the disparity under the mask into `disparities`, row by row of the mask's box; 0
    /// outside the mask, just behind edges, and where the depth is farther than `extent_m` from the
    /// median. Returns how many pixels have one.
    pub fn copy_into(&self, disparities: &mut [u16], vectors: Vectors) -> u32 {
        let PixelBox { left, top, width, height } = self.mask.pixels;
        let (Ok(left_u), Ok(top_v)) = (usize::try_from(left), usize::try_from(top)) else {
            return 0;
        };
        let size = [width.max(1) as usize, height.max(0) as usize];
        // The histogram has bins of half a pixel: the middle of the median's bin is taken.
        let median = self.copy_masked(disparities).median().unwrap_or(0);
        let focal_baseline = self.rig.focal_baseline_px_m();
        let depth = focal_baseline / ((median as f64 + 0.5) * 0.5);
        let extent_m = f64::from(self.extent_m);
        // A limit at or behind the camera excludes nothing.
        let limits = [depth + extent_m, depth - extent_m].map(|depth_m| {
            let disparity = focal_baseline / depth_m * 256.0;
            if depth_m > 0.0 && disparity < 65_535.0 { disparity as u16 } else { u16::MAX }
        });
        vectors.run(LeaveOut {
            disparity_q8: self.disparity_q8,
            origin: [left_u, top_v],
            size,
            limits,
            disparities,
        })
    }

    /// Copies what is under the mask, 0 elsewhere; counts by half pixels of disparity.
    fn copy_masked(&self, disparities: &mut [u16]) -> Histogram {
        let PixelBox { left, top, width, height } = self.mask.pixels;
        let [left_u, top_v] = [left, top].map(|side| side.max(0) as usize);
        let [columns, rows] = [width.max(1) as usize, height.max(0) as usize];
        let mut found = Histogram::new();
        for (v, row) in disparities.chunks_exact_mut(columns).enumerate().take(rows) {
            let from = self.disparity_q8.row(top_v + v).get(left_u..).unwrap_or(&[]);
            for ((u, row), from) in
                (left..).step_by(BLOCK).zip(row.chunks_mut(BLOCK)).zip(from.chunks(BLOCK))
            {
                // Masks are read by words: BLOCK pixels at a time.
                let bits = self.masks.bits(self.mask, u, top + v as i32);
                for (i, (to, &disparity)) in row.iter_mut().zip(from).enumerate() {
                    *to = if bits >> i & 1 == 1 { disparity } else { 0 };
                    if *to > 0 {
                        found.add(usize::from(*to / BIN));
                    }
                }
            }
        }
        found
    }
}

/// Leaves out of a crop what is too far or too near, or just behind an edge.
struct LeaveOut<'a> {
    disparity_q8: View<'a, u16>,
    /// Column and row of the crop in the image.
    origin: [usize; 2],
    size: [usize; 2],
    /// Least and greatest disparity that is kept.
    limits: [u16; 2],
    disparities: &'a mut [u16],
}

impl Work for LeaveOut<'_> {
    /// Number of pixels that are left.
    type Output = u32;

    #[inline(always)]
    fn run(self) -> u32 {
        let ([left, top], [width, height], [low, high]) = (self.origin, self.size, self.limits);
        let surroundings = Surroundings { disparity_q8: self.disparity_q8 };
        let mut kept = 0;
        for (v, row) in (top..).zip(self.disparities.chunks_exact_mut(width)).take(height) {
            for (u, block) in (left..).step_by(BLOCK).zip(row.chunks_mut(BLOCK)) {
                // A pixel without a disparity lies below `low`, or is 0.
                let is_kept = |disparity: u16| (disparity >= low) & (disparity <= high);
                if !block
                    .iter()
                    .fold(false, |any, &disparity| any | (is_kept(disparity) & (disparity > 0)))
                {
                    block.fill(0);
                    continue;
                }
                for (disparity, nearest) in block.iter_mut().zip(surroundings.nearest(u, v)) {
                    // Just behind an edge the matcher mixes foreground and background.
                    let is_behind_edge = nearest > disparity.saturating_add(EDGE_Q8);
                    *disparity = if is_kept(*disparity) & !is_behind_edge { *disparity } else { 0 };
                    kept += u32::from(*disparity > 0);
                }
            }
        }
        kept
    }
}

/// A crop that is kept for later. Transforms as in the track.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Crop {
    pub t_world_camera: Transform,
    pub t_world_object: Transform,
    pub pixels: PixelBox,
    /// Track it belongs to; 0 none.
    pub id: u32,
    /// First pixel in the ring.
    pub start: u32,
    /// Pixels.
    pub len: u32,
    /// 1 if the crop has colour, else 0.
    pub coloured: u32,
    /// Digest of its pixels, which do not change while it is kept.
    pub digest: u64,
}

impl Crop {
    /// Visits every field; the pixels are [`Crops`]'.
    fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { t_world_camera, t_world_object, pixels, id, start, len, coloured, digest } =
            self;
        visitor.transform(t_world_camera);
        visitor.transform(t_world_object);
        pixels.visit(visitor);
        visitor.u32s([id, start, len, coloured]);
        visitor.u64(digest);
    }
}

/// The left picture a crop is cut from.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    /// In grey.
    pub grey: View<'a, u8>,
    /// In colour, where there is one.
    pub colour: Option<View<'a, [u8; 3]>>,
}

impl Picture<'_> {
    /// The part in a box within the picture.
    pub(super) fn part(&self, pixels: &PixelBox) -> Option<Self> {
        let [left, top, width, height] =
            [pixels.left, pixels.top, pixels.width, pixels.height].map(|side| side.max(0) as usize);
        let grey = self.grey.part(left, top, width, height)?;
        Some(Self {
            grey,
            colour: self.colour.and_then(|image| image.part(left, top, width, height)),
        })
    }
}

/// The ring.
#[derive(Debug)]
pub(super) struct Crops<'s> {
    disparity_q8: &'s mut [u16],
    grey: &'s mut [u8],
    colour: &'s mut [[u8; 3]],
    entries: &'s mut [Crop],
    /// Entries in use, oldest first.
    len: usize,
    /// Offset of the next crop.
    next: usize,
}

impl<'s> Crops<'s> {
    pub const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<u16>(capacity.crop_pixels)
            + region_bytes::<u8>(capacity.crop_pixels)
            + if capacity.colour { region_bytes::<[u8; 3]>(capacity.crop_pixels) } else { 0 }
            + region_bytes::<Crop>(MAX_CROPS)
    }

    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        let pixels = capacity.crop_pixels;
        Self {
            disparity_q8: carver.alloc("objects.crop_disparity", pixels),
            grey: carver.alloc("objects.crop_grey", pixels),
            colour: if capacity.colour {
                carver.alloc("objects.crop_colour", pixels)
            } else {
                &mut []
            },
            entries: carver.alloc("objects.crop", MAX_CROPS),
            len: 0,
            next: 0,
        }
    }

    /// Adds a crop, its disparity given row by row. Returns how many kept crops it displaced, or
    /// `None` when it is larger than the ring.
    pub fn push(&mut self, crop: Crop, disparity_q8: &[u16], picture: &Picture<'_>) -> Option<u32> {
        // The part of the image is checked first: an error leaves the ring as it was.
        let picture = picture.part(&crop.pixels)?;
        let len = crop.pixels.area() as usize;
        if len > self.disparity_q8.len() || len == 0 {
            return None;
        }
        // The ring wraps: a crop is never split.
        if self.next + len > self.disparity_q8.len() {
            self.next = 0;
        }
        let span = self.next..self.next + len;
        // Crops that the new one overwrites are the oldest.
        let dropped = self.drop_where(|old, count| {
            let overlaps =
                (old.start as usize) < span.end && (old.start + old.len) as usize > span.start;
            overlaps || count >= MAX_CROPS
        });
        let width = (crop.pixels.width as usize).max(1);
        self.disparity_q8
            .get_mut(span.clone())?
            .iter_mut()
            .zip(disparity_q8)
            .for_each(|(to, from)| *to = *from);
        for (to, from) in
            self.grey.get_mut(span.clone())?.chunks_exact_mut(width).zip(picture.grey.rows())
        {
            to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
        }
        // A profile without colour keeps grey only.
        let coloured = picture.colour.filter(|_| !self.colour.is_empty());
        if let Some(image) = coloured {
            for (to, from) in
                self.colour.get_mut(span.clone())?.chunks_exact_mut(width).zip(image.rows())
            {
                to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
            }
        }
        let mut kept = Crop {
            start: span.start as u32,
            len: len as u32,
            coloured: u32::from(coloured.is_some()),
            ..crop
        };
        // The digest covers the pixels, which only now are in place.
        kept.digest = self.digest(&kept);
        *self.entries.get_mut(self.len)? = kept;
        self.len += 1;
        self.next = span.end;
        Some(dropped)
    }

    /// Drops the crops `drop` says, handed each and how many are left; how many of those had a
    /// track.
    fn drop_where(&mut self, mut drop: impl FnMut(&Crop, usize) -> bool) -> u32 {
        let (mut kept, mut left, mut dropped) = (0, self.len, 0);
        for index in 0..self.len {
            let Some(crop) = self.entries.get(index).copied() else { break };
            if drop(&crop, left) {
                left -= 1;
                dropped += u32::from(crop.id != 0);
            } else if let Some(slot) = self.entries.get_mut(kept) {
                *slot = crop;
                kept += 1;
            }
        }
        self.len = kept;
        dropped
    }

    /// Drops the crops of a track.
    pub fn forget(&mut self, id: u32) {
        self.drop_where(|crop, _| crop.id == id);
    }

    /// The crops of a track, oldest first.
    pub fn of(&self, id: u32) -> impl Iterator<Item = (&Crop, &[u16], Picture<'_>)> {
        let entries = clipped(self.entries, ..self.len);
        entries.iter().filter(move |crop| crop.id == id).filter_map(|crop| {
            let (disparity_q8, picture) = self.picture(crop)?;
            Some((crop, disparity_q8, picture))
        })
    }

    fn picture(&self, crop: &Crop) -> Option<(&[u16], Picture<'_>)> {
        // Disparities, grey and colour lie at one position of their rings.
        let span = crop.start as usize..(crop.start + crop.len) as usize;
        let (width, height) = (crop.pixels.width as usize, crop.pixels.height as usize);
        let colour = match crop.coloured {
            0 => None,
            _ => View::new(self.colour.get(span.clone())?, width, height),
        };
        let grey = View::new(self.grey.get(span.clone())?, width, height)?;
        Some((self.disparity_q8.get(span)?, Picture { grey, colour }))
    }

    /// Says what must hold of the ring after a frame.
    pub fn check_invariants(&self, invariants: &mut Invariants) {
        invariants
            .require(self.len <= self.entries.len(), "no more crops wait than there are entries");
        let pixels = self.disparity_q8.len();
        for crop in self.entries.iter().take(self.len) {
            invariants.require(
                crop.start as usize + crop.len as usize <= pixels,
                "a crop's pixels lie in the ring",
            );
        }
    }

    /// Visits the crops, with their pixels.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { disparity_q8, grey, colour, entries, len, next } = self;
        visitor.count(len, entries.len());
        visitor.count(next, disparity_q8.len());
        for crop in entries.iter_mut().take(*len) {
            crop.visit(visitor);
            let span = crop.start as usize..crop.start as usize + crop.len as usize;
            // Lengths from a file are not trusted: pixels must lie in the ring and match the box.
            if span.end > disparity_q8.len() || i64::from(crop.len) != crop.pixels.area() {
                visitor.refuse();
                return;
            }
            visitor.content(crop.digest, |visitor| {
                visitor.u16s(clipped_mut(disparity_q8, span.clone()));
                visitor.bytes(clipped_mut(grey, span.clone()));
                if crop.coloured > 0 {
                    visitor.bytes(clipped_mut(colour, span).as_flattened_mut());
                }
            });
        }
    }

    /// Digest of a crop's pixels.
    fn digest(&self, crop: &Crop) -> u64 {
        let mut digest = Digest::default();
        // A crop whose pixels cannot be found has the digest of none.
        if let Some((disparity_q8, picture)) = self.picture(crop) {
            digest.u16s(disparity_q8);
            picture.grey.rows().for_each(|row| digest.bytes(row));
            picture
                .colour
                .iter()
                .flat_map(View::rows)
                .for_each(|row| digest.bytes(row.as_flattened()));
        }
        digest.finish()
    }

    /// Pixels of a ring that would hold the crops kept now: from the oldest to the newest, and once
    /// more the largest, since a crop that does not fit at the end of the ring begins at its front.
    pub fn required_pixels(&self) -> usize {
        let kept = clipped(self.entries, ..self.len);
        let oldest = kept.first().map_or(0, |crop| crop.start as usize);
        let pixels = self.disparity_q8.len();
        let span =
            if oldest < self.next { self.next - oldest } else { pixels - oldest + self.next };
        let largest = kept.iter().map(|crop| crop.len as usize).max().unwrap_or(0);
        if span + largest < pixels { span + largest } else { pixels }
    }

    /// Crops kept.
    pub fn len(&self) -> usize {
        self.len
    }
}
