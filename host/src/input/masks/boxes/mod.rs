//! Boxes of a detector, made masks by disparity.
//!
//! Most detectors give boxes, and a mapper needs pixels: a box is a third road and background. What
//! a box shows most of, within the depth that its class can have, above the ground and in one
//! component, is its object (`mask`). Small boxes, whose disparity tells too little, are only
//! shrunk.
//!
//! The disparity is the frame's own where depth is given, else that of the core's stereo matching,
//! computed here on the thread that reads ahead (`disparity`). Masks of one frame share no pixel:
//! the better score has it, so that they can be saved as a picture and taken again.

mod disparity;
mod marks;
mod mask;
mod tables;

pub(super) use disparity::FrameDisparity;
pub(super) use tables::FORMAT;

use super::MaskSource;
use super::format::OpenedMasks;
use crate::formats::Image;
use crate::input::source::{
    FrameMasks, FrameSource, InputError, InstanceMask, StereoImages, bounding_boxes,
};
use dynvox_core::geometry::StereoRig;
use dynvox_core::masks::PixelBox;
use dynvox_core::tracking::Class;
use mask::Scene;

impl OpenedMasks {
    /// Masks made of boxes for `there` frames.
    ///
    /// # Errors
    /// The images are not rectified.
    pub fn boxes(
        source: impl DetectionSource + 'static,
        there: usize,
        dataset: &dyn FrameSource,
    ) -> Result<Self, InputError> {
        let source = Box::new(BoxMasks::new(source, dataset)?);
        Ok(Self { source, there, fits_scaled: true })
    }
}

/// A detector's box in the left image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DetectedBox {
    pub class: Class,
    pub score: f32,
    /// Left, top, right and bottom edge, px from the outer corner of the upper left pixel.
    pub edges: [f64; 4],
}

impl DetectedBox {
    /// The pixels whose centres lie within the box, `margins` of its width and height left out at
    /// every side, and in the image.
    pub fn pixels(&self, margin: f64, (width, height): (usize, usize)) -> PixelBox {
        let [left, top, right, bottom] = self.edges;
        let [x, y] = [margin * (right - left), margin * (bottom - top)];
        let [left, top, right, bottom] = [left + x, top + y, right - x, bottom - y]
            .map(|edge| edge.round().clamp(-1e6, 1e6) as i32);
        let image = PixelBox { left: 0, top: 0, width: width as i32, height: height as i32 };
        PixelBox { left, top, width: right - left, height: bottom - top }.intersection(&image)
    }
}

/// Output of a detector for a frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Detections {
    /// Masks, and what could not be used.
    pub masks: FrameMasks,
    /// Boxes without masks.
    pub boxes: Vec<DetectedBox>,
    /// The class of each pixel as [`Class::code`], 0 where it is none that may move.
    pub regions: Option<Image<u8>>,
}

/// Gives boxes and masks of a frame.
pub(super) trait DetectionSource: Send + Sync {
    /// Returns the detections in frame `index`, whose images are given.
    fn detections(&self, index: usize, images: &StereoImages) -> Result<Detections, InputError>;
}

/// Masks of a detector's boxes.
pub(super) struct BoxMasks<S> {
    source: S,
    disparity: FrameDisparity,
    rig: StereoRig,
    /// Size of the images as they are mapped, px.
    size: (usize, usize),
    /// Factor by which the detections are scaled to fit the images.
    scale: f64,
}

impl<S: DetectionSource> BoxMasks<S> {
    /// Wraps a source whose detections have the size of the images in files.
    pub fn new(source: S, dataset: &dyn FrameSource) -> Result<Self, InputError> {
        let scale = dataset.size().0 as f64 / dataset.full_size().0 as f64;
        Ok(Self {
            source,
            disparity: FrameDisparity::new(dataset)?,
            rig: dataset.rig(),
            size: dataset.size(),
            scale,
        })
    }

    /// Wraps a source whose detections have the size of the images as they are mapped.
    #[cfg(feature = "onnx")]
    pub fn of_pictures(source: S, dataset: &dyn FrameSource) -> Result<Self, InputError> {
        Ok(Self { scale: 1.0, ..Self::new(source, dataset)? })
    }

    fn fitted(&self, mut found: Detections) -> Detections {
        if self.scale != 1.0 {
            for one in std::mem::take(&mut found.masks.instances) {
                found.masks.push(one.scaled(self.scale, self.size));
            }
            found
                .boxes
                .iter_mut()
                .for_each(|one| one.edges = one.edges.map(|edge| edge * self.scale));
        }
        found
    }
}

impl<S: DetectionSource> MaskSource for BoxMasks<S> {
    fn masks(&self, index: usize, images: &StereoImages) -> Result<FrameMasks, InputError> {
        let Detections { mut masks, boxes, regions } =
            self.fitted(self.source.detections(index, images)?);
        if !boxes.is_empty() || regions.is_some() {
            self.disparity.with(images, |disparity_q8| {
                let scene = Scene::new(&self.rig, disparity_q8, regions.as_ref());
                for one in &boxes {
                    if masks.reserve(one.pixels(0.0, self.size).area() as usize) {
                        masks.push(scene.mask(one));
                    }
                }
                for one in scene.uncovered(&masks.instances) {
                    if masks.reserve(one.mask.len()) {
                        masks.push(Some(one));
                    }
                }
            })?;
        }
        Ok(disjoint(masks, self.size))
    }
}

/// Removes from each mask the pixels that a mask of a better score has.
fn disjoint(masks: FrameMasks, (width, height): (usize, usize)) -> FrameMasks {
    let mut order: Vec<(u16, &InstanceMask)> = (1..).zip(&masks.instances).collect();
    order.sort_by(|(_, a), (_, b)| a.score.total_cmp(&b.score));
    let mut labels = vec![0u16; width * height];
    for (label, one) in order {
        for v in one.pixels.top..one.pixels.top + one.pixels.height {
            for u in (one.pixels.left..one.pixels.left + one.pixels.width)
                .filter(|u| one.contains(*u, v))
            {
                labels
                    .get_mut(v as usize * width + u as usize)
                    .into_iter()
                    .for_each(|pixel| *pixel = label);
            }
        }
    }
    let Some(labels) = Image::new(width, height, labels) else { return masks };
    let mut apart = FrameMasks::refusing(masks.refusals);
    let named =
        (1..).zip(&masks.instances).map(|(label, one)| (label, one.class, one.score)).collect();
    apart.extract(&labels, &bounding_boxes(&labels), named);
    apart
}
