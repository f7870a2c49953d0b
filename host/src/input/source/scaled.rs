//! A data set at a smaller size: every pixel is the area average of the pixels it covers, and the
//! rig shrinks with it.

use super::{
    ExactFrame, FrameInfo, FrameSource, GivenDepth, InputError, LidarScan, SourceInfo,
    StereoImages, StreamState,
};
use crate::formats::Image;
use dynvox_core::geometry::StereoRig;

/// Least side of a scaled image, px.
const LEAST_SIDE_PX: usize = 32;
/// Weights along one axis sum to this: 12 bits, so that two axes and 8 bits of pixel fit `u32`.
const ONE: u32 = 1 << 12;

/// Another data set, scaled down.
pub struct Scaled {
    inner: Box<dyn FrameSource>,
    scale: f64,
    columns: Vec<Span>,
    rows: Vec<Span>,
    info: SourceInfo,
}

/// Pixels one output pixel covers along one axis.
struct Span {
    first: usize,
    weights: Vec<u32>,
}

impl Scaled {
    /// Scales by `scale` in (0, 1].
    pub fn new(inner: Box<dyn FrameSource>, scale: f64) -> Result<Self, InputError> {
        let (width, height) = inner.size();
        let side = |side: usize| (side as f64 * scale) as usize;
        if !(scale > 0.0 && scale <= 1.0) || side(width).min(side(height)) < LEAST_SIDE_PX {
            return Err(InputError::Scale { scale, width, height, least: LEAST_SIDE_PX });
        }
        let scaled = (side(width), side(height));
        let mut info =
            SourceInfo { size: scaled, rig: shrunk(inner.rig(), scale), ..inner.info().clone() };
        let (to_width, to_height) = scaled;
        info.notes
            .push(format!("images scaled from {width} x {height} to {to_width} x {to_height} px"));
        // Raw images stay as they are: the rectified ones are made smaller.
        if let Some(rectification) = &mut info.rectification {
            rectification.width = to_width as u32;
            rectification.height = to_height as u32;
        }
        Ok(Self {
            columns: spans(side(width), width, scale),
            rows: spans(side(height), height, scale),
            inner,
            scale,
            info,
        })
    }

    fn shrink<const N: usize>(&self, pixels: &[[u8; N]], width: usize) -> Vec<[u8; N]> {
        let mut out = Vec::with_capacity(self.columns.len() * self.rows.len());
        let mut sums = vec![[0u32; N]; self.columns.len()];
        for row in &self.rows {
            sums.fill([0; N]);
            for (source, &weight) in pixels.chunks_exact(width).skip(row.first).zip(&row.weights) {
                for (sum, column) in sums.iter_mut().zip(&self.columns) {
                    let mut across = [0u32; N];
                    for (pixel, &share) in source.iter().skip(column.first).zip(&column.weights) {
                        across
                            .iter_mut()
                            .zip(pixel)
                            .for_each(|(total, &value)| *total += share * u32::from(value));
                    }
                    sum.iter_mut().zip(across).for_each(|(total, value)| *total += weight * value);
                }
            }
            out.extend(
                sums.iter()
                    .map(|sum| sum.map(|total| ((total + ONE * ONE / 2) / (ONE * ONE)) as u8)),
            );
        }
        out
    }

    fn grey(&self, image: &Image<u8>) -> Option<Image<u8>> {
        let pixels = self.shrink::<1>(image.pixels().as_chunks().0, image.width());
        Image::new(self.columns.len(), self.rows.len(), pixels.as_flattened().to_vec())
    }

    /// Disparities shrink with the image.
    fn depth(&self, depth: &GivenDepth) -> Option<GivenDepth> {
        let disparity_q8 = self
            .nearest(&depth.disparity_q8)?
            .map(|&value| (f64::from(value) * self.scale).round() as u16);
        Some(GivenDepth { disparity_q8, refused: depth.refused })
    }

    /// The pixel in the middle of each covered area: depths must not be averaged across edges.
    fn nearest<T: Copy>(&self, image: &Image<T>) -> Option<Image<T>> {
        let middle = |at: usize| ((at as f64 + 0.5) / self.scale) as usize;
        let pick = |v: usize| (0..self.columns.len()).map(move |u| image.get(middle(u), middle(v)));
        let pixels: Option<Vec<T>> = (0..self.rows.len()).flat_map(pick).collect();
        Image::new(self.columns.len(), self.rows.len(), pixels?)
    }
}

/// Rig of images scaled by `scale`.
fn shrunk(rig: StereoRig, scale: f64) -> StereoRig {
    // Pixel centres lie at whole numbers, areas begin half a pixel before them.
    let center = |center_px: f64| (center_px + 0.5) * scale - 0.5;
    StereoRig {
        focal_px: rig.focal_px * scale,
        center_u_px: center(rig.center_u_px),
        center_v_px: center(rig.center_v_px),
        baseline_m: rig.baseline_m,
    }
}

/// For each of `count` output pixels: the input pixels it covers and their shares, which sum to
/// [`ONE`] exactly.
fn spans(count: usize, input: usize, scale: f64) -> Vec<Span> {
    let span = |at: usize| {
        let (from, to) = (at as f64 / scale, ((at + 1) as f64 / scale).min(input as f64));
        let first = from as usize;
        let last = (to.ceil() as usize).clamp(first + 1, input);
        // Shares from rounded running sums, so that nothing is lost to rounding.
        let upto = |edge: f64| {
            ((edge.clamp(from, to) - from) / (to - from) * f64::from(ONE)).round() as u32
        };
        let weights =
            (first..last).map(|pixel| upto((pixel + 1) as f64) - upto(pixel as f64)).collect();
        Span { first, weights }
    };
    (0..count).map(span).collect()
}

impl FrameSource for Scaled {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn frame_info(&self, index: usize) -> FrameInfo {
        self.inner.frame_info(index)
    }

    fn stream(&self) -> Option<StreamState> {
        self.inner.stream()
    }

    fn frame(&self, index: usize) -> Result<StereoImages, InputError> {
        let frame = self.inner.frame(index)?;
        if self.info.rectification.is_some() {
            return Ok(frame);
        }
        let (width, height) = self.inner.size();
        let failed =
            || InputError::Scale { scale: self.scale, width, height, least: LEAST_SIDE_PX };
        let colour = frame.colour.map(|colour| {
            let pixels = self.shrink(colour.pixels(), colour.width());
            Image::new(self.columns.len(), self.rows.len(), pixels).ok_or_else(failed)
        });
        Ok(StereoImages {
            left: self.grey(&frame.left).ok_or_else(failed)?,
            right: self.grey(&frame.right).ok_or_else(failed)?,
            colour: colour.transpose()?,
            depth: frame.depth.and_then(|depth| self.depth(&depth)),
            exact: frame.exact.and_then(|exact| {
                Some(ExactFrame {
                    depth_m: self.nearest(&exact.depth_m)?,
                    moving: self.nearest(&exact.moving)?,
                    instances: self.nearest(&exact.instances)?,
                    classes: exact.classes,
                })
            }),
            objects: frame.objects.map(|truth| truth.scaled(self.scale)),
            masks: frame.masks,
            ignored: None,
        })
    }

    fn has_lidar(&self, index: usize) -> bool {
        self.inner.has_lidar(index)
    }

    fn lidar(&self, index: usize) -> Result<Option<LidarScan>, InputError> {
        Ok(self.inner.lidar(index)?.map(|scan| scan.scaled(self.scale)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_sum_to_one_and_a_half_is_the_mean_of_two() {
        for (count, input, scale) in [
            (50, 100, 0.5),
            (75, 100, 0.75),
            (33, 100, 1.0 / 3.0),
            (100, 100, 1.0),
            (931, 1242, 0.75),
        ] {
            let spans = spans(count, input, scale);
            assert!(spans.iter().all(|span| span.weights.iter().sum::<u32>() == ONE
                && span.first + span.weights.len() <= input));
        }
        let half = spans(2, 4, 0.5);
        assert_eq!(
            half.iter().map(|span| (span.first, span.weights.clone())).collect::<Vec<_>>(),
            [(0, vec![ONE / 2; 2]), (2, vec![ONE / 2; 2])]
        );
    }
}
