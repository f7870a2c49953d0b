//! The map against a renderer's exact depth: how far off what it shows is, and how much it shows.

use crate::input::ExactFrame;
use dynvox_core::image::View;
use serde::{Deserialize, Serialize};

/// Farthest pixels compared, m: as far as depth is fused.
const FAR_M: f32 = 20.0;
/// Error, as a share of the exact depth, up to which a pixel counts as accurate.
const CLOSE_SHARE: f32 = 0.05;
/// Width of a bin of the error histogram, m.
const BIN_M: f32 = 0.000_5;
/// Width of a bin of the depth histogram, m.
const DEPTH_BIN_M: f32 = 0.01;
/// Bins of either histogram; what lies beyond the last falls into it.
const BINS: usize = 10_000;

/// What the comparison gave.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ExactFigures {
    /// Median of |depth of the map - exact depth|, m, to half a millimetre.
    pub median_error_m: f64,
    /// Median exact depth of the pixels compared, m, to a centimetre: what the error is to be held against.
    pub median_depth_m: f64,
    /// Share of the pixels where the map shows a surface that lie within 5 % of the exact depth.
    pub accuracy: f64,
    /// Share of the exact pixels where the map shows a surface.
    pub completeness: f64,
    /// Exact pixels compared: those within 20 m that neither move nor belong to a thing with a map of its own.
    pub points: u64,
}

/// Collects errors over frames in a histogram: memory does not grow.
#[derive(Debug, Serialize, Deserialize)]
pub struct ExactErrors {
    errors: Vec<u64>,
    depths: Vec<u64>,
    close: u64,
    points: u64,
}

impl Default for ExactErrors {
    fn default() -> Self {
        Self { errors: vec![0; BINS], depths: vec![0; BINS], close: 0, points: 0 }
    }
}

impl ExactErrors {
    /// Compares one view of the static map with the exact depth of the same pixels, but for those of things that have maps of their own.
    pub fn add(&mut self, map_depth_m: &View<'_, f32>, exact: &ExactFrame, apart: impl Fn(usize, usize) -> bool) {
        let exact_pixels = exact.depth_m.pixels().iter().zip(exact.moving.pixels());
        for (pixel, (&shown_m, (&exact_m, &moving))) in map_depth_m.rows().flatten().zip(exact_pixels).enumerate() {
            let (u, v) = (pixel % map_depth_m.width(), pixel / map_depth_m.width());
            if moving || !(exact_m > 0.0 && exact_m <= FAR_M) || apart(u, v) {
                continue;
            }
            self.points += 1;
            if shown_m > 0.0 {
                count(&mut self.errors, (shown_m - exact_m).abs() / BIN_M);
                count(&mut self.depths, exact_m / DEPTH_BIN_M);
                self.close += u64::from((shown_m - exact_m).abs() <= CLOSE_SHARE * exact_m);
            }
        }
    }

    /// The figures; `None` when nothing was compared.
    pub fn figures(&self) -> Option<ExactFigures> {
        Some(ExactFigures {
            median_error_m: f64::from(BIN_M) * median_bin(&self.errors)?,
            median_depth_m: f64::from(DEPTH_BIN_M) * median_bin(&self.depths)?,
            accuracy: self.close as f64 / self.errors.iter().sum::<u64>() as f64,
            completeness: self.errors.iter().sum::<u64>() as f64 / self.points as f64,
            points: self.points,
        })
    }
}

fn count(bins: &mut [u64], bin: f32) {
    if let Some(count) = bins.get_mut((bin as usize).min(BINS - 1)) {
        *count += 1;
    }
}

/// Middle of the bin the median lies in; `None` when nothing was counted.
fn median_bin(bins: &[u64]) -> Option<f64> {
    let all: u64 = bins.iter().sum();
    let mut below = 0;
    let at = bins.iter().position(|count| {
        below += count;
        2 * below >= all
    })?;
    (all > 0).then_some(at as f64 + 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Image;

    #[test]
    fn counts_static_near_pixels_alone() {
        let image = |pixels: Vec<f32>| Image::new(6, 1, pixels).unwrap();
        let exact = ExactFrame {
            depth_m: image(vec![10.0, 10.0, 10.0, 10.0, 25.0, 0.0]),
            moving: Image::new(6, 1, vec![false, false, false, true, false, false]).unwrap(),
            instances: Image::new(6, 1, vec![0; 6]).unwrap(),
            classes: Vec::new(),
        };
        let mut errors = ExactErrors::default();
        assert_eq!(errors.figures(), None);
        let map = image(vec![10.1, 10.1, 0.0, 3.0, 3.0, 3.0]);
        errors.add(&map.view().unwrap(), &exact, |u, v| (u, v) == (2, 0));
        assert_eq!(
            errors.figures().map(|figures| (figures.points, figures.completeness)),
            Some((2, 1.0)),
            "one lies on a thing kept apart"
        );
        let mut errors = ExactErrors::default();
        errors.add(&map.view().unwrap(), &exact, |_, _| false);
        let figures = errors.figures().unwrap();
        assert_eq!(figures.points, 3);
        assert_eq!(figures.accuracy, 1.0, "what is not shown is not inaccurate");
        assert!((figures.completeness - 2.0 / 3.0).abs() < 1e-12);
        assert!((figures.median_error_m - 0.1).abs() < 0.001 && (figures.median_depth_m - 10.0).abs() < 0.02, "{figures:?}");
    }
}
