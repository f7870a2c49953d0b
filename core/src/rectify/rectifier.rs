//! The rectifier: maps, masks and rectified images in the slab.

use super::{MAX_RAW_SIDE, Rectification, RectifyReport, map};
use crate::{
    digest::Digest,
    geometry::StereoRig,
    image::{InvalidPair, InvalidPixels, View},
    memory::{Capacity, Carver, region_bytes},
    parallel::{Executor, each},
};

/// Why a rectification does not fit a capacity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RectifierError {
    /// The raw images are larger than the capacity allows.
    RawTooLarge {
        /// Widest raw image, px; 0 where the capacity has none.
        width: usize,
        /// Highest raw image, px.
        height: usize,
    },
    /// The rectified images are larger than the capacity allows.
    RectifiedTooLarge {
        /// Widest image, px.
        width: usize,
        /// Highest image, px.
        height: usize,
    },
}

/// The images of a pair, raw or rectified.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a> {
    /// Left grey image.
    pub left: View<'a, u8>,
    /// Right grey image.
    pub right: View<'a, u8>,
    /// Left image in colour, where there is one.
    pub colour: Option<View<'a, [u8; 3]>>,
}

/// One camera's regions.
#[derive(Debug, Default)]
struct Camera<'s> {
    map: &'s mut [u32],
    invalid: &'s mut [u64],
    invalid_count: u32,
}

/// Room for the rectified images. Apart from the [`Rectifier`], so that a mapper can lend them to its stages.
#[derive(Debug, Default)]
pub struct RectifiedImages<'s> {
    left: &'s mut [u8],
    right: &'s mut [u8],
    colour: &'s mut [[u8; 3]],
}

impl<'s> RectifiedImages<'s> {
    /// Bytes of the slab.
    pub const fn bytes(capacity: &Capacity) -> usize {
        let [pixels, _] = lengths(capacity);
        2 * region_bytes::<u8>(pixels) + region_bytes::<[u8; 3]>(if capacity.colour { pixels } else { 0 })
    }

    /// Allocates the regions; none without raw pixels.
    pub fn carve(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        let [pixels, _] = lengths(capacity);
        if pixels == 0 {
            return Self::default();
        }
        Self {
            left: carver.alloc("rectify.left", pixels),
            right: carver.alloc("rectify.right", pixels),
            colour: if capacity.colour { carver.alloc("rectify.colour", pixels) } else { &mut [] },
        }
    }
}

/// Turns raw pairs into rectified ones.
#[derive(Debug)]
pub struct Rectifier<'s> {
    left: Camera<'s>,
    right: Camera<'s>,
    capacity: Capacity,
    rectification: Option<Rectification>,
}

/// Pixels each region has, and words of its mask: 0 without raw pixels.
const fn lengths(capacity: &Capacity) -> [usize; 2] {
    if capacity.raw_width * capacity.raw_height == 0 {
        return [0, 0];
    }
    [capacity.pixels(), InvalidPixels::words_a_row(capacity.image_width) * capacity.image_height]
}

impl<'s> Rectifier<'s> {
    /// Bytes of the slab: 8 and a quarter a rectified pixel for maps and masks; none without raw pixels.
    pub const fn bytes(capacity: &Capacity) -> usize {
        let [pixels, words] = lengths(capacity);
        2 * (region_bytes::<u32>(pixels) + region_bytes::<u64>(words))
    }

    /// Allocates the regions; none without raw pixels. It rectifies nothing until [`Rectifier::prepare`].
    pub fn carve(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        let [pixels, words] = lengths(capacity);
        let mut camera = |[map, invalid]: [&'static str; 2]| {
            if pixels == 0 {
                return Camera::default();
            }
            Camera {
                map: carver.alloc(map, pixels),
                invalid: carver.alloc(invalid, words),
                invalid_count: 0,
            }
        };
        Self {
            left: camera(["rectify.map_left", "rectify.invalid_left"]),
            right: camera(["rectify.map_right", "rectify.invalid_right"]),
            capacity: *capacity,
            rectification: None,
        }
    }

    /// Makes the maps. Time: two projections a rectified pixel, once.
    ///
    /// # Errors
    /// When the images do not fit the capacity; the rectifier is as it was.
    pub fn prepare(&mut self, rectification: &Rectification, rig: &StereoRig) -> Result<(), RectifierError> {
        let Capacity { image_width, image_height, .. } = self.capacity;
        let [raw_width, raw_height] = [self.capacity.raw_width, self.capacity.raw_height].map(|side| side.min(MAX_RAW_SIDE as usize));
        let [width, height] = [rectification.width as usize, rectification.height as usize];
        for raw in [&rectification.left.raw, &rectification.right.raw] {
            if raw.width as usize > raw_width || raw.height as usize > raw_height {
                return Err(RectifierError::RawTooLarge { width: raw_width, height: raw_height });
            }
        }
        if width > image_width || height > image_height {
            return Err(RectifierError::RectifiedTooLarge { width: image_width, height: image_height });
        }
        for (camera, turned) in [(&mut self.left, &rectification.left), (&mut self.right, &rectification.right)] {
            let entries = camera.map.get_mut(..width * height).unwrap_or(&mut []);
            map::fill(entries, width, turned, rig);
            camera.invalid_count = map::mark_invalid(entries, width, height, camera.invalid);
        }
        self.rectification = Some(*rectification);
        Ok(())
    }

    /// What is rectified, where anything is.
    pub fn rectification(&self) -> Option<&Rectification> {
        self.rectification.as_ref()
    }

    /// The pixels of both rectified images that are not to be used; `None` where all are.
    pub fn invalid(&self) -> Option<InvalidPair<'_>> {
        let Rectification { width, height, .. } = self.rectification?;
        (self.left.invalid_count + self.right.invalid_count > 0).then_some(())?;
        let [width, height] = [width as usize, height as usize];
        Some(InvalidPair {
            left: InvalidPixels::new(self.left.invalid, width, height)?,
            right: InvalidPixels::new(self.right.invalid, width, height)?,
        })
    }

    /// Rectifies a pair into `images`. `None` without a rectification. An image that is not of the raw size leaves what was there before:
    /// the mapper refuses those.
    pub fn rectify<'a, E: Executor>(&self, raw: &Pair<'_>, images: &'a mut RectifiedImages<'_>, executor: &E) -> Option<Pair<'a>> {
        let Rectification { left, right, width, height } = self.rectification.as_ref()?;
        let [width, height] = [*width as usize, *height as usize];
        let pixels = width * height;
        // Two bands an image, at rows that depend on its height alone.
        let middle = height / 2 * width;
        let [left_map, right_map] = [&self.left, &self.right].map(|camera| camera.map.get(..pixels).unwrap_or(&[]).split_at(middle));
        let [left_out, right_out] =
            [&mut *images.left, &mut *images.right].map(|grey| grey.get_mut(..pixels).unwrap_or_default().split_at_mut(middle));
        let bands = [
            (left_map.0, &left.raw, &raw.left, left_out.0),
            (left_map.1, &left.raw, &raw.left, left_out.1),
            (right_map.0, &right.raw, &raw.right, right_out.0),
            (right_map.1, &right.raw, &raw.right, right_out.1),
        ];
        each(executor, bands, |(map, camera, raw, rectified)| map::remap(map, camera, raw, rectified));
        let colour = raw.colour.and_then(|raw| {
            let (upper, lower) = images.colour.get_mut(..pixels)?.split_at_mut(middle);
            executor.join(|| map::remap(left_map.0, &left.raw, &raw, upper), || map::remap(left_map.1, &left.raw, &raw, lower));
            View::new(&*images.colour, width, height)
        });
        Some(Pair {
            left: View::new(&*images.left, width, height)?,
            right: View::new(&*images.right, width, height)?,
            colour,
        })
    }

    /// What is reported of each frame; `None` where nothing is rectified.
    pub fn report(&self, rectified: &Pair<'_>) -> Option<RectifyReport> {
        self.rectification.as_ref()?;
        let mut digest = Digest::default();
        rectified.left.rows().chain(rectified.right.rows()).for_each(|row| digest.bytes(row));
        rectified.colour.iter().flat_map(View::rows).for_each(|row| digest.bytes(row.as_flattened()));
        Some(RectifyReport {
            invalid_left: self.left.invalid_count,
            invalid_right: self.right.invalid_count,
            digest: digest.finish(),
        })
    }
}
