//! Frames that wait for their evaluation. The regions of a frame's points and what the input
//! measured are fixed while the frame is there.

use super::{Counts, EvaluatedFrame, ProjectedPoint, ProjectedScan, Region, ScanCount};
use crate::formats::Image;
use dynvox_core::image::View;
use dynvox_core::view::RaycastView;
use std::collections::VecDeque;

/// A point of a frame that waits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Pixel and true disparity.
    pub point: ProjectedPoint,
    /// The input's disparity, px; 0 none.
    pub input_px: f32,
    /// Region of the image the sample lies in: static or dynamic.
    pub region: Region,
}

/// A frame that waits.
#[derive(Clone, Debug)]
pub struct PendingFrame {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// View of the map from the camera's estimated pose.
    pub view: RaycastView,
    /// The scan's points by outcome.
    pub count: ScanCount,
    /// The points.
    pub samples: Vec<Sample>,
    /// Left image, of frames whose errors are drawn.
    pub picture: Option<Image<u8>>,
}

impl PendingFrame {
    /// Fixes region and input disparity of a frame's points: `input_px` and `region` by pixel.
    pub fn new(
        frame: usize,
        view: RaycastView,
        scan: &ProjectedScan,
        input_px: impl Fn(usize, usize) -> f32,
        region: impl Fn(i32, i32) -> Region,
    ) -> Self {
        // Now, since the frame's images are gone when the map is looked at.
        let sample = |&point: &ProjectedPoint| Sample {
            point,
            input_px: input_px(point.u.into(), point.v.into()),
            region: region(point.u.into(), point.v.into()),
        };
        let samples = scan.points.iter().map(sample).collect();
        Self { frame, view, count: scan.count, samples, picture: None }
    }

    /// Compares with a view of the map from the frame's pose; `focal_baseline_px_m` turns its depth
    /// into disparity. Also gives the map's disparity of each sample, 0 where it shows nothing.
    /// `enlarged` px of the stored images are one px of those compared: errors are counted at full
    /// size, at every scale.
    pub fn compare(
        &self,
        map_depth_m: &View<'_, f32>,
        focal_baseline_px_m: f64,
        enlarged: f32,
    ) -> (EvaluatedFrame, Vec<f32>) {
        let mut regions = [Counts::default(); 3];
        let shown = |sample: &Sample| {
            let depth_m =
                map_depth_m.get(sample.point.u.into(), sample.point.v.into()).unwrap_or_default();
            // Zero depth is no surface.
            let shown_px = if depth_m > 1e-5 {
                (focal_baseline_px_m / f64::from(depth_m)) as f32
            } else {
                0.0
            };
            regions[sample.region as usize].add(
                enlarged * sample.point.disparity_px,
                [enlarged * sample.input_px, enlarged * shown_px],
            );
            shown_px
        };
        let shown_px = self.samples.iter().map(shown).collect();
        (EvaluatedFrame { frame: self.frame, count: self.count, regions }, shown_px)
    }
}

/// Frames in a row: each comes out some steps after it went in.
#[derive(Debug, Default)]
pub struct PendingFrames {
    waiting: VecDeque<Option<PendingFrame>>,
}

impl PendingFrames {
    /// One step: a frame goes in, or none where there is no reference, and the one of `delay` steps
    /// ago comes out.
    pub fn step(&mut self, delay: usize, frame: Option<PendingFrame>) -> Option<PendingFrame> {
        self.waiting.push_back(frame);
        if self.waiting.len() > delay { self.waiting.pop_front().flatten() } else { None }
    }
}
