//! Input of the mapper, frame by frame.

use super::StepError;
use crate::{
    digest::Digest,
    geometry::Transform,
    image::{DISPARITY_ONE_PX, SampleLayout, View},
    inertial::InertialSample,
    tracking::Detection,
};

/// Number that tells ignored pixels from other images in a frame's digest.
const IGNORED_MARK: u64 = 0x6967_6E6F_7265;

/// One stereo frame as the core takes it, 8 bit: rectified images of equal sizes, or raw ones for a
/// mapper that rectifies ([`crate::Config::rectification`]). Classes, disparities, ignored pixels
/// and detections belong to the rectified left image in either case.
///
/// ```
/// use dynvox_core::{StereoFrame, geometry::Transform, image::View};
///
/// let pixels = [0; 320 * 96];
/// let image = View::new(&pixels, 320, 96).unwrap();
/// let frame = StereoFrame { t_world_camera: Some(Transform::IDENTITY), ..StereoFrame::pair(image, image) };
/// assert!(frame.detections.is_empty() && frame.digest() != StereoFrame::pair(image, image).digest());
/// ```
#[derive(Clone, Copy, Debug)]
pub struct StereoFrame<'a> {
    /// Left grey image.
    pub left: View<'a, u8>,
    /// Right grey image.
    pub right: View<'a, u8>,
    /// Arrangement of the samples of both grey images: others than bytes need a mapper that
    /// rectifies, and views whose stride is that of the memory, in bytes.
    pub layout: SampleLayout,
    /// Left image in colour, for fusion; grey is fused where it is absent.
    pub colour: Option<View<'a, [u8; 3]>>,
    /// Semantic class of each left pixel, an index into `VolumeConfig::class_weight`; all weights
    /// are 1 where it is absent.
    pub class: Option<View<'a, u8>>,
    /// Disparity of each left pixel in 1/256 px, 0 none, from elsewhere: it replaces the pair's
    /// own. Motion still needs both images. Values no pair of this width can have are refused and
    /// counted.
    pub disparity_q8: Option<View<'a, u16>>,
    /// Pixels of the left image that no stage uses, marked by any value but 0: the car's own
    /// bonnet, a dirty lens. They get no match and no depth, also not a given one.
    pub ignored: Option<View<'a, u8>>,
    /// Pose of the left camera, camera to world, from elsewhere: it replaces the camera's own
    /// egomotion. Give it with every frame, in one world.
    pub t_world_camera: Option<Transform>,
    /// Time of the pair, ns since any moment that stays the same: later than that of the frame
    /// before. If two frames in a row have it, objects move by the true time between them; else by
    /// `frame_interval_s` of the configuration.
    pub time_ns: Option<u64>,
    /// Detections in the left image, in any order; empty without a detector.
    pub detections: &'a [Detection<'a>],
    /// Samples of [`crate::Config::inertial`] since the frame before, in order of time, on the
    /// clock of `time_ns`: with the first frame those of the second before it. At most
    /// [`crate::inertial::INERTIAL_SAMPLES_PER_FRAME`] are read; more are counted. Empty without a
    /// unit.
    pub inertial: &'a [InertialSample],
}

impl<'a> StereoFrame<'a> {
    /// A pair of grey images and nothing else: add what there is with
    /// `StereoFrame { colour, ..StereoFrame::pair(left, right) }`.
    pub fn pair(left: View<'a, u8>, right: View<'a, u8>) -> Self {
        Self {
            left,
            right,
            layout: SampleLayout::Bytes,
            colour: None,
            class: None,
            disparity_q8: None,
            ignored: None,
            t_world_camera: None,
            time_ns: None,
            detections: &[],
            inertial: &[],
        }
    }

    /// Checks that the grey samples can be read, by a mapper that rectifies or does not.
    pub(super) fn check_layout(&self, rectifies: bool) -> Result<(), StepError> {
        let layout = self.layout;
        if layout == SampleLayout::Bytes {
            return Ok(());
        }
        // The stages read bytes: only the rectifier finds them among packed samples.
        if !rectifies {
            return Err(StepError::PackedNotRectified);
        }
        if layout.fits(&self.left) && layout.fits(&self.right) {
            Ok(())
        } else {
            Err(StepError::PackedTooShort { row_bytes: layout.row_bytes(self.left.width()) })
        }
    }

    /// Digest of the images, row by row, of given disparities, ignored pixels, pose and time, and
    /// of the detections in any order.
    ///
    /// ```
    /// use dynvox_core::{StereoFrame, image::View};
    ///
    /// let (one, other) = ([90; 64 * 32], [91; 64 * 32]);
    /// let [one, other] = [&one, &other].map(|image| View::new(&image[..], 64, 32).unwrap());
    /// let frame = StereoFrame::pair(one, one);
    /// assert_ne!(frame.digest(), StereoFrame::pair(one, other).digest());
    /// assert_ne!(frame.digest(), StereoFrame { time_ns: Some(1), ..frame }.digest());
    /// ```
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::default();
        let images = [&self.left, &self.right].into_iter();
        images.flat_map(|image| self.layout.rows(image)).for_each(|row| digest.bytes(row));
        self.colour.iter().flat_map(View::rows).for_each(|row| digest.bytes(row.as_flattened()));
        self.class.iter().flat_map(View::rows).for_each(|row| digest.bytes(row));
        if let Some(disparity) = &self.disparity_q8 {
            // A mark first, so that a given disparity is never taken for an image of classes.
            digest.u64(u64::from(DISPARITY_ONE_PX));
            disparity.rows().for_each(|row| digest.u16s(row));
        }
        if let Some(ignored) = &self.ignored {
            // A mark here as well.
            digest.u64(IGNORED_MARK);
            ignored.rows().for_each(|row| digest.bytes(row));
        }
        if let Some(pose) = &self.t_world_camera {
            pose.rotation.iter().chain(&pose.translation_m).for_each(|&value| digest.f64(value));
        }
        if let Some(time_ns) = self.time_ns {
            // An absent time adds nothing to the digest.
            digest.u64(time_ns);
        }
        // Absent samples add nothing either.
        self.inertial.iter().for_each(|sample| sample.hash_into(&mut digest));
        // A sum, so that the order in which a detector lists its finds does not matter.
        digest.u64(self.detections.iter().map(Detection::digest).fold(0, u64::wrapping_add));
        digest.finish()
    }
}
