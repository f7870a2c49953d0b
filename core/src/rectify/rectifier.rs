//! The rectifier: maps, masks and rectified images in the slab.

use super::{
    MAX_RAW_SIDE, Rectification, RectifyReport, TurnedCamera,
    map::{self, Sample},
    packed::remap_packed,
};
use core::fmt;

use crate::{
    digest::Digest,
    geometry::StereoRig,
    image::{InvalidPair, InvalidPixels, SampleLayout, View},
    memory::{Capacity, Carver, region_bytes},
    parallel::{Bands, Executor, each, zip2},
    slices::clipped_mut,
};

/// Reason that a rectification does not fit a capacity.
///
/// ```
/// use dynvox_core::{Capacity, rectify::RectifierError};
///
/// // TINY has no space for raw images.
/// assert_eq!(Capacity::TINY.raw_width, 0);
/// let sentence = RectifierError::RawTooLarge { width: 0, height: 0 }.to_string();
/// assert!(sentence.contains("set its raw_width and raw_height"));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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

impl Rectification {
    /// Checks that raw and rectified images are within the bounds of a capacity.
    ///
    /// # Errors
    /// The first bound that is too small.
    pub(crate) fn check_fit(&self, capacity: &Capacity) -> Result<(), RectifierError> {
        // A map's entry has bits for MAX_RAW_SIDE columns and rows.
        let [width, height] =
            [capacity.raw_width, capacity.raw_height].map(|side| side.min(MAX_RAW_SIDE as usize));
        for raw in [&self.left.raw, &self.right.raw] {
            if raw.width as usize > width || raw.height as usize > height {
                return Err(RectifierError::RawTooLarge { width, height });
            }
        }
        let Capacity { image_width: width, image_height: height, .. } = *capacity;
        if self.width as usize > width || self.height as usize > height {
            return Err(RectifierError::RectifiedTooLarge { width, height });
        }
        Ok(())
    }
}

impl fmt::Display for RectifierError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::RawTooLarge { width: 0, .. } => {
                f.write_str("the capacity holds no raw images: set its raw_width and raw_height")
            }
            Self::RawTooLarge { width, height } => {
                write!(
                    f,
                    "the raw images are larger than the capacity allows: at most {width} x \
                     {height} px"
                )
            }
            Self::RectifiedTooLarge { width, height } => {
                write!(
                    f,
                    "the rectified images are larger than the capacity allows: at most {width} x \
                     {height} px"
                )
            }
        }
    }
}

impl core::error::Error for RectifierError {}

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

/// A raw image and the camera that took it.
struct RawImage<'a, T> {
    camera: &'a TurnedCamera,
    image: View<'a, T>,
    /// Arrangement of grey samples.
    layout: SampleLayout,
}

/// One camera's regions.
#[derive(Debug, Default)]
struct Camera<'s> {
    map: &'s mut [u32],
    invalid: &'s mut [u64],
    invalid_count: u32,
}

impl Camera<'_> {
    /// Fills a rectified image of that size, in bands of rows, and looks at it.
    fn remap<'a, T: Sample, E: Executor>(
        &self,
        raw: RawImage<'_, T>,
        [width, height]: [usize; 2],
        out: &'a mut [T],
        executor: &E,
    ) -> Option<View<'a, T>> {
        let bands = Bands::new(height);
        let jobs = zip2(bands.split(self.map, width), bands.split_mut(out, width));
        each(executor, jobs, |(map, out)| map::remap(map, &raw.camera.raw, &raw.image, out));
        View::new(out, width, height)
    }

    /// Fills a rectified grey image from samples of any layout.
    fn remap_grey<'a, E: Executor>(
        &self,
        raw: RawImage<'_, u8>,
        size: [usize; 2],
        out: &'a mut [u8],
        executor: &E,
    ) -> Option<View<'a, u8>> {
        if raw.layout == SampleLayout::Bytes {
            return self.remap(raw, size, out, executor);
        }
        let [width, height] = size;
        let bands = Bands::new(height);
        let jobs = zip2(bands.split(self.map, width), bands.split_mut(out, width));
        each(executor, jobs, |(map, out)| {
            remap_packed(map, &raw.camera.raw, &raw.image, raw.layout, out);
        });
        View::new(out, width, height)
    }
}

/// Memory of the rectified images. Separate from the [`Rectifier`], so that a mapper can lend them
/// to its stages.
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
        2 * region_bytes::<u8>(pixels)
            + region_bytes::<[u8; 3]>(if capacity.colour { pixels } else { 0 })
    }

    /// Allocates the regions; none without raw pixels.
    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        let [pixels, _] = lengths(capacity);
        if pixels == 0 {
            return Self::default();
        }
        carver.group("rectify.images", |carver| Self {
            left: carver.alloc("rectify.left", pixels),
            right: carver.alloc("rectify.right", pixels),
            colour: if capacity.colour { carver.alloc("rectify.colour", pixels) } else { &mut [] },
        })
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
    /// Bytes of the slab: 8 and a quarter a rectified pixel for maps and masks; none without raw
    /// pixels.
    pub const fn bytes(capacity: &Capacity) -> usize {
        let [pixels, words] = lengths(capacity);
        2 * (region_bytes::<u32>(pixels) + region_bytes::<u64>(words))
    }

    /// Allocates the regions; none without raw pixels. It rectifies nothing until
    /// [`Rectifier::prepare`].
    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        let [pixels, words] = lengths(capacity);
        let camera = |carver: &mut Carver<'s>| {
            // Without raw images, not even an empty region is listed.
            if pixels == 0 {
                return Camera::default();
            }
            carver.group("rectify.maps", |carver| Camera {
                map: carver.alloc("rectify.map", pixels),
                invalid: carver.alloc("rectify.invalid", words),
                invalid_count: 0,
            })
        };
        Self {
            left: camera(carver),
            right: camera(carver),
            capacity: *capacity,
            rectification: None,
        }
    }

    /// Makes the maps. Time: two projections a rectified pixel, once.
    ///
    /// # Errors
    /// The images do not fit the capacity. The rectifier is unchanged then.
    pub fn prepare(
        &mut self,
        rectification: &Rectification,
        rig: &StereoRig,
    ) -> Result<(), RectifierError> {
        // First: nothing is changed after an error.
        rectification.check_fit(&self.capacity)?;
        let [width, height] = [rectification.width as usize, rectification.height as usize];
        for (camera, turned) in
            [(&mut self.left, &rectification.left), (&mut self.right, &rectification.right)]
        {
            let entries = clipped_mut(camera.map, ..width * height);
            map::fill(entries, width, turned, rig);
            camera.invalid_count = map::mark_invalid(entries, width, height, camera.invalid);
        }
        self.rectification = Some(*rectification);
        Ok(())
    }

    /// Rectification in use, where there is one.
    pub(crate) fn rectification(&self) -> Option<&Rectification> {
        self.rectification.as_ref()
    }

    /// The pixels of both rectified images that are not to be used; `None` where all are.
    pub(crate) fn invalid(&self) -> Option<InvalidPair<'_>> {
        let Rectification { width, height, .. } = self.rectification?;
        (self.left.invalid_count + self.right.invalid_count > 0).then_some(())?;
        let [width, height] = [width as usize, height as usize];
        Some(InvalidPair {
            left: InvalidPixels::new(self.left.invalid, width, height)?,
            right: Some(InvalidPixels::new(self.right.invalid, width, height)?),
        })
    }

    /// Rectifies a pair into `images`. `None` without a rectification. An image that is not of the
    /// raw size leaves what was there before: the mapper refuses those.
    pub fn rectify<'a, E: Executor>(
        &self,
        raw: &Pair<'_>,
        images: &'a mut RectifiedImages<'_>,
        executor: &E,
    ) -> Option<Pair<'a>> {
        self.rectify_from(SampleLayout::Bytes, raw, images, executor)
    }

    /// Rectifies a pair like [`Rectifier::rectify`], whose grey samples are arranged otherwise.
    pub fn rectify_from<'a, E: Executor>(
        &self,
        layout: SampleLayout,
        raw: &Pair<'_>,
        images: &'a mut RectifiedImages<'_>,
        executor: &E,
    ) -> Option<Pair<'a>> {
        let Rectification { left, right, width, height } = self.rectification.as_ref()?;
        let [width, height] = [*width as usize, *height as usize];
        let (size, out) = ([width, height], images);
        let raw_left = RawImage { camera: left, image: raw.left, layout };
        let raw_right = RawImage { camera: right, image: raw.right, layout };
        // The two images are independent and remapped at the same time.
        let (left_image, right_image) = executor.join(
            || self.left.remap_grey(raw_left, size, out.left, executor),
            || self.right.remap_grey(raw_right, size, out.right, executor),
        );
        // The colour image is the left camera's and shares its map.
        let colour = raw.colour.filter(|_| !out.colour.is_empty()).and_then(|image| {
            let raw = RawImage { camera: left, image, layout: SampleLayout::Bytes };
            self.left.remap(raw, size, out.colour, executor)
        });
        Some(Pair { left: left_image?, right: right_image?, colour })
    }

    /// The grey images, left and right, that the last [`Rectifier::rectify`] left in `images`;
    /// `None` without a rectification.
    pub(crate) fn grey<'a>(&self, images: &'a RectifiedImages<'_>) -> Option<[View<'a, u8>; 2]> {
        let Rectification { width, height, .. } = self.rectification.as_ref()?;
        let [width, height] = [*width as usize, *height as usize];
        Some([View::new(&*images.left, width, height)?, View::new(&*images.right, width, height)?])
    }

    /// Report of a frame; `None` where nothing is rectified.
    pub(crate) fn report(&self, rectified: &Pair<'_>) -> Option<RectifyReport> {
        self.rectification.as_ref()?;
        // The digest is of the images that the stages read, and not of the raw ones.
        let mut digest = Digest::default();
        rectified.left.rows().chain(rectified.right.rows()).for_each(|row| digest.bytes(row));
        rectified
            .colour
            .iter()
            .flat_map(View::rows)
            .for_each(|row| digest.bytes(row.as_flattened()));
        Some(RectifyReport {
            invalid_left: self.left.invalid_count,
            invalid_right: self.right.invalid_count,
            digest: digest.finish(),
        })
    }
}
