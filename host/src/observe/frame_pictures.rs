//! Pictures of a frame that several observers show: each is made once.

use super::{FrameContext, pictures};
use crate::formats::Image;
use image::RgbImage;

/// Contents of a picture of a frame.
#[derive(Clone, Copy)]
pub(super) enum Shown {
    /// The left image: in colour where that lies on the image that was matched.
    Left,
    /// Disparity in colours.
    Disparity,
    /// The static map from the camera's pose.
    Map,
    /// Raycast of the map with every object at its pose; none without objects.
    Composed,
}

/// JPEG files of a frame, as far as they were asked for. Empty where there is no picture.
#[derive(Default)]
pub struct FramePictures([Option<Vec<u8>>; 4]);

impl FrameContext<'_, '_> {
    /// A picture as a JPEG file, made when it is first asked for; empty without a picture.
    pub(super) fn jpeg(&mut self, shown: Shown) -> Vec<u8> {
        let at = shown as usize;
        let made = self.pictures.0[at].take();
        let made = made.unwrap_or_else(|| {
            self.picture(shown).as_ref().map(pictures::jpeg).unwrap_or_default()
        });
        self.pictures.0[at].insert(made).clone()
    }

    fn picture(&mut self, shown: Shown) -> Option<RgbImage> {
        let t_world_camera = self.row.report.t_world_camera;
        match shown {
            Shown::Left => left(self),
            Shown::Disparity => Some(pictures::disparity(&self.view.mapper().disparity_q8())),
            Shown::Map => pictures::map(pictures::SMALL_PX, self.view, &t_world_camera),
            Shown::Composed => pictures::composed(pictures::SMALL_PX, self.view, &t_world_camera),
        }
    }
}

/// The left image as a picture; `None` where it has no pixels.
pub(super) fn left(frame: &FrameContext<'_, '_>) -> Option<RgbImage> {
    let rectified = frame.view.mapper().rectified_pair().map(|[left, _]| left);
    let colour = frame.images.colour.as_ref().filter(|_| rectified.is_none()).and_then(Image::view);
    let grey = rectified.or_else(|| frame.images.left.view())?;
    Some(pictures::input(&grey, colour.as_ref()))
}
