//! Frames that wait for their evaluation. What a frame's points belong to and what the input measured is settled while the frame is there.

use super::{Aim, EvaluatedFrame, Layer, ScanCount, Tally, Target};
use crate::formats::Image;
use dynvox_core::geometry::Transform;
use dynvox_core::image::View;
use std::collections::VecDeque;

/// A point of a frame that waits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Pixel and true disparity.
    pub target: Target,
    /// The input's disparity, px; 0 none.
    pub input_px: f32,
    /// What it belongs to.
    pub layer: Layer,
}

/// A frame that waits.
#[derive(Clone, Debug)]
pub struct Awaited {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// Where the camera was, as estimated.
    pub t_world_camera: Transform,
    /// What became of the scan's points.
    pub count: ScanCount,
    /// The points.
    pub samples: Vec<Sample>,
    /// Left image, of frames whose errors are drawn.
    pub picture: Option<Image<u8>>,
}

impl Awaited {
    /// Settles what a frame's points belong to, and what the input measured there: `input_px` and `layer` by pixel.
    pub fn settle(
        frame: usize,
        t_world_camera: Transform,
        aim: &Aim,
        input_px: impl Fn(usize, usize) -> f32,
        layer: impl Fn(i32, i32) -> Layer,
    ) -> Self {
        let sample = |&target: &Target| Sample {
            target,
            input_px: input_px(target.u.into(), target.v.into()),
            layer: layer(target.u.into(), target.v.into()),
        };
        Self {
            frame,
            t_world_camera,
            count: aim.count,
            samples: aim.targets.iter().map(sample).collect(),
            picture: None,
        }
    }

    /// Compares with a view of the map from the frame's pose; `focal_baseline_px_m` turns its depth into disparity. Also gives the map's disparity of
    /// each sample, 0 where it shows nothing. `enlarged` px of the images as they are stored are one px of those compared: errors are counted at full
    /// size, whatever the scale.
    pub fn compare(&self, map_depth_m: &View<'_, f32>, focal_baseline_px_m: f64, enlarged: f32) -> (EvaluatedFrame, Vec<f32>) {
        let mut layers = [Tally::default(); 3];
        let shown = |sample: &Sample| {
            let depth_m = map_depth_m.get(sample.target.u.into(), sample.target.v.into()).unwrap_or_default();
            let shown_px = if depth_m > 1e-5 { (focal_baseline_px_m / f64::from(depth_m)) as f32 } else { 0.0 };
            layers[sample.layer as usize].add(enlarged * sample.target.disparity_px, [enlarged * sample.input_px, enlarged * shown_px]);
            shown_px
        };
        let shown_px = self.samples.iter().map(shown).collect();
        (EvaluatedFrame { frame: self.frame, count: self.count, layers }, shown_px)
    }
}

/// Frames in a row: each comes out `delay` steps after it went in.
#[derive(Debug)]
pub struct Delay {
    delay: usize,
    waiting: VecDeque<Option<Awaited>>,
}

impl Delay {
    /// With so many steps; 0 gives a frame back at once.
    pub fn new(delay: usize) -> Self {
        Self { delay, waiting: VecDeque::new() }
    }

    /// One step: a frame goes in, or none where there is nothing to compare with, and the one of `delay` steps ago comes out.
    pub fn step(&mut self, frame: Option<Awaited>) -> Option<Awaited> {
        self.waiting.push_back(frame);
        if self.waiting.len() > self.delay { self.waiting.pop_front().flatten() } else { None }
    }
}
