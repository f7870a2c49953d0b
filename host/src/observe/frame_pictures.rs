//! Pictures of a frame that several observers show: each is made once.

use super::{FrameContext, pictures};
use crate::formats::Image;
use image::RgbImage;

/// JPEG files of a frame, as far as they were asked for. Empty where there is no picture.
#[derive(Default)]
pub struct FramePictures {
    left: Option<Vec<u8>>,
    disparity: Option<Vec<u8>>,
    map: Option<Vec<u8>>,
    composed: Option<Vec<u8>>,
}

impl FrameContext<'_, '_> {
    /// The left image: in colour where that lies on the image that was matched.
    pub(super) fn left_jpeg(&mut self) -> Vec<u8> {
        let made = self.pictures.left.take().unwrap_or_else(|| jpeg(left(self)));
        self.pictures.left.insert(made).clone()
    }

    /// Disparity in colours.
    pub(super) fn disparity_jpeg(&mut self) -> Vec<u8> {
        let made = self.pictures.disparity.take();
        let made = made.unwrap_or_else(|| pictures::jpeg(&pictures::disparity(&self.view.mapper().disparity_q8())));
        self.pictures.disparity.insert(made).clone()
    }

    /// The static map from the camera's pose.
    pub(super) fn map_jpeg(&mut self) -> Vec<u8> {
        let t_world_camera = self.row.report.t_world_camera;
        let made = self.pictures.map.take();
        let made = made.unwrap_or_else(|| jpeg(pictures::map(pictures::SMALL_PX, self.view, &t_world_camera)));
        self.pictures.map.insert(made).clone()
    }

    /// The same with every object in its place; empty without objects.
    pub(super) fn composed_jpeg(&mut self) -> Vec<u8> {
        let t_world_camera = self.row.report.t_world_camera;
        let made = self.pictures.composed.take();
        let made = made.unwrap_or_else(|| jpeg(pictures::composed(pictures::SMALL_PX, self.view, &t_world_camera)));
        self.pictures.composed.insert(made).clone()
    }
}

/// The left image as a picture; `None` where it has no pixels.
pub(super) fn left(frame: &FrameContext<'_, '_>) -> Option<RgbImage> {
    let rectified = frame.view.mapper().rectified_pair().map(|[left, _]| left);
    let colour = frame.images.colour.as_ref().filter(|_| rectified.is_none()).and_then(Image::view);
    let grey = rectified.or_else(|| frame.images.left.view())?;
    Some(pictures::input(&grey, colour.as_ref()))
}

/// A picture as a JPEG file; empty without a picture.
fn jpeg(picture: Option<RgbImage>) -> Vec<u8> {
    picture.as_ref().map(pictures::jpeg).unwrap_or_default()
}
