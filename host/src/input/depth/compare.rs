//! Given depth against the run's own matches: a factor between them is a unit misread.

use crate::formats::Image;
use crate::input::source::{FrameSource, StereoImages};
use crate::slab::HostSlab;
use dynvox_core::Serial;
use dynvox_core::memory::{Capacity, Carver};
use dynvox_core::stereo::{StereoConfig, StereoMatcher};

/// Frames that are compared.
pub(super) const FRAMES: usize = 2;
/// Fewest pixels that have both disparities.
const PIXELS_MIN: usize = 500;
/// Share of the pixels whose ratio is near the median where a factor explains them.
const AGREEING: f64 = 0.5;
/// A ratio is near the median within this share of it.
const NEAR: f64 = 0.15;
/// Factors up to this are errors of depth, not units.
const FACTOR_MIN: f64 = 1.4;
/// Disparities below this are too coarse for a ratio, 1/256 px.
const MATCHED_MIN_Q8: u16 = 2 * 256;

/// Ratios of given to matched disparities.
#[derive(Default)]
pub(super) struct Ratios(Vec<f32>);

impl Ratios {
    /// Adds a frame: given disparities in px, also such as no matcher finds, 0 or less unknown;
    /// those of the run in 1/256 px, 0 unknown.
    pub fn add(&mut self, given_px: &Image<f32>, matched: &Image<u16>) {
        let pairs = given_px.pixels().iter().zip(matched.pixels());
        let known = pairs.filter(|(given_px, matched)| {
            **given_px > 0.0 && given_px.is_finite() && **matched >= MATCHED_MIN_Q8
        });
        self.0.extend(known.map(|(given_px, matched)| 256.0 * given_px / f32::from(*matched)));
    }

    /// The factor by which given depths are too near (above 1) or too far (below 1), if there is
    /// one: the median ratio, where most ratios are near it.
    pub fn factor(mut self) -> Option<f64> {
        if self.0.len() < PIXELS_MIN {
            return None;
        }
        self.0.sort_by(f32::total_cmp);
        let median = f64::from(*self.0.get(self.0.len() / 2)?);
        let is_near = |ratio: &&f32| (f64::from(**ratio) / median - 1.0).abs() <= NEAR;
        let near = self.0.iter().filter(is_near).count();
        let is_unit = median.max(1.0 / median) >= FACTOR_MIN;
        (is_unit && near as f64 >= AGREEING * self.0.len() as f64).then_some(median)
    }
}

/// The core's disparities of a rectified pair, 1/256 px; `None` of raw images, or without memory.
pub(super) fn matched(dataset: &dyn FrameSource, images: &StereoImages) -> Option<Image<u16>> {
    if dataset.rectification().is_some() {
        return None;
    }
    let (image_width, image_height) = dataset.size();
    let capacity = Capacity { image_width, image_height, ..Capacity::TINY };
    let bytes = StereoMatcher::bytes(&capacity);
    let mut slab = HostSlab::map(bytes)?;
    let mut carver = Carver::new(slab.bytes_mut(), bytes).ok()?;
    let mut matcher = StereoMatcher::new_in(&capacity, &mut carver);
    let (left, right) = (images.left.view()?, images.right.view()?);
    matcher.compute(&StereoConfig::default(), left, right, &Serial);
    let found = matcher.disparity_q8();
    let pixels = (0..found.height()).flat_map(|v| (0..found.width()).map(move |u| (u, v)));
    let values = pixels.map(|(u, v)| found.get(u, v).unwrap_or_default()).collect();
    Image::new(found.width(), found.height(), values)
}
