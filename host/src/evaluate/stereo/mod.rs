//! Disparity against KITTI's stereo benchmarks of 2012 (Geiger, Lenz, Urtasun, CVPR 2012) and 2015
//! (Menze, Geiger, CVPR 2015).
//!
//! A pixel with truth is *bad by n* when it is off by more than n px, and wrong by *D1* when it is
//! off by more than 3 px and by more than 5 % of the truth. Shares are given of the pixels that
//! have an estimate, and, as the benchmarks rank, of all pixels with truth after the estimate's
//! holes are filled ([`filled`]). What the matcher itself filled in (the core marks it:
//! [`DisparityQ8::is_filled`]) is counted apart from what it measured. Pixels are counted over all pairs
//! together. Regions: what is seen in both images (`noc`), all (`occ`), each once more for
//! foreground and background where the benchmark has an `obj_map`.

mod fill;
mod frontier;
mod layout;
#[cfg(test)]
mod tests;

pub use fill::filled;
pub use frontier::{Frontier, FrontierRow};
pub use layout::{StereoPair, StereoSet, StereoSetError, find_stereo_set};

use crate::evaluate::reference::Rule;
use crate::formats::Image;
use dynvox_core::image::DisparityQ8;
use serde::Serialize;

/// Plain thresholds, px.
pub const BAD_PX: [f32; 4] = [2.0, 3.0, 4.0, 5.0];
/// 16-bit disparities are in this part of a pixel.
const ONE_PX: f32 = 256.0;

/// Counts of one region.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StereoCounts {
    /// Pixels with truth.
    pixels: u64,
    /// Pixels among them with an estimate of their own.
    given: u64,
    /// Wrong by D1: given ones, all after filling.
    d1: [u64; 2],
    /// Bad by each of [`BAD_PX`]: given ones, all after filling.
    bad: [[u64; BAD_PX.len()]; 2],
    /// Sum of |error| of the given ones, px, and of the error with its sign.
    error_sums_px: [f64; 2],
    /// Given ones that the matcher measured, and those it filled in.
    parts: [PartCounts; 2],
}

/// Counts of a part of the estimates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct PartCounts {
    given: u64,
    d1: u64,
    bad: [u64; BAD_PX.len()],
}

/// An estimated disparity image, as it is counted.
#[derive(Clone, Copy, Debug)]
pub struct Estimate<'a> {
    /// 1/256 px, 0 none.
    pub given: &'a Image<u16>,
    /// Disparities with holes filled as the benchmarks do.
    pub filled: &'a Image<u16>,
    /// True if the core's marks tell which disparities the matcher filled in.
    pub marked: bool,
}

impl StereoCounts {
    /// Takes in an image: truth in 1/256 px, 0 none; `counts` tells which pixels belong to the
    /// region.
    pub fn add(
        &mut self,
        truth: &Image<u16>,
        estimate: &Estimate<'_>,
        counts: impl Fn(usize) -> bool,
    ) {
        let px = |q8: u16| f32::from(q8) / ONE_PX;
        let pixels = truth
            .pixels()
            .iter()
            .zip(estimate.given.pixels())
            .zip(estimate.filled.pixels())
            .enumerate();
        for (_, ((&truth, &given), &filled)) in
            pixels.filter(|(at, ((truth, _), _))| **truth > 0 && counts(*at))
        {
            self.pixels += 1;
            self.given += u64::from(given > 0);
            // The given disparities count where they are; the filled ones everywhere.
            for (way, estimate) in [given, filled]
                .into_iter()
                .enumerate()
                .filter(|(way, estimate)| *way == 1 || *estimate > 0)
            {
                self.d1[way] += u64::from(Rule::KITTI.is_error(px(estimate), px(truth)));
                let off_px = (px(estimate) - px(truth)).abs();
                self.bad[way]
                    .iter_mut()
                    .zip(BAD_PX)
                    .for_each(|(bad, limit)| *bad += u64::from(off_px > limit));
            }
            // Mean and bias, over what the matcher gave.
            if given > 0 {
                let error = f64::from(px(given) - px(truth));
                self.error_sums_px[0] += error.abs();
                self.error_sums_px[1] += error;
                let is_filled = estimate.marked && DisparityQ8::new(given).is_filled();
                self.parts[usize::from(is_filled)].add(px(given), px(truth));
            }
        }
    }

    /// The figures; `None` where there is no truth.
    pub fn figures(&self) -> Option<StereoFigures> {
        let share = |count: u64, all: u64| if all > 0 { count as f64 / all as f64 } else { 0.0 };
        let mean = |sum: f64| if self.given > 0 { sum / self.given as f64 } else { 0.0 };
        (self.pixels > 0).then(|| StereoFigures {
            pixels: self.pixels,
            coverage: share(self.given, self.pixels),
            // `d1` is of the pixels with a disparity, `d1_filled` of all that have a truth.
            d1: share(self.d1[0], self.given),
            d1_filled: share(self.d1[1], self.pixels),
            bad: self.bad[0].map(|bad| share(bad, self.given)),
            bad_filled: self.bad[1].map(|bad| share(bad, self.pixels)),
            mean_error_px: mean(self.error_sums_px[0]),
            mean_signed_error_px: mean(self.error_sums_px[1]),
            measured: self.parts[0].figures(self.pixels),
            filled_in: self.parts[1].figures(self.pixels),
        })
    }
}

impl PartCounts {
    fn add(&mut self, estimate_px: f32, truth_px: f32) {
        self.given += 1;
        self.d1 += u64::from(Rule::KITTI.is_error(estimate_px, truth_px));
        let off_px = (estimate_px - truth_px).abs();
        self.bad.iter_mut().zip(BAD_PX).for_each(|(bad, limit)| *bad += u64::from(off_px > limit));
    }

    /// `None` where there is no such estimate; `pixels` have truth.
    fn figures(&self, pixels: u64) -> Option<PartFigures> {
        let share = |count: u64| count as f64 / self.given as f64;
        (self.given > 0).then(|| PartFigures {
            coverage: self.given as f64 / pixels as f64,
            d1: share(self.d1),
            bad: self.bad.map(share),
        })
    }
}

/// Figures of a part of the estimates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PartFigures {
    /// Share of the pixels with truth.
    pub coverage: f64,
    /// Share of these estimates that is wrong by 3 px and 5 %.
    pub d1: f64,
    /// Share that is off by more than 2, 3, 4, 5 px.
    pub bad: [f64; BAD_PX.len()],
}

/// Figures of one region.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StereoFigures {
    /// Pixels with truth.
    pub pixels: u64,
    /// Share of them with an estimate.
    pub coverage: f64,
    /// Share of the estimates that is wrong by 3 px and 5 %.
    pub d1: f64,
    /// Share of wrong disparities over all pixels, holes filled.
    pub d1_filled: f64,
    /// Share of the estimates that is off by more than 2, 3, 4, 5 px.
    pub bad: [f64; BAD_PX.len()],
    /// Shares of disparities off by each limit over all pixels, holes filled.
    pub bad_filled: [f64; BAD_PX.len()],
    /// Mean |error| of the estimates, px.
    pub mean_error_px: f64,
    /// Mean error of the estimates, px: below 0 where they are too far away.
    pub mean_signed_error_px: f64,
    /// Figures of the disparities that the matcher measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured: Option<PartFigures>,
    /// Figures of the disparities that the matcher filled in.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub filled_in: Option<PartFigures>,
}
