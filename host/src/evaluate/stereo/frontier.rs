//! Coverage against error: what is left, and how much of it is wrong, if disparities of less than
//! each confidence are removed.

use super::ONE_PX;
use crate::evaluate::reference::Rule;
use crate::formats::Image;
use serde::Serialize;

/// Error from which on a pixel is bad, px.
const BAD_PX: f32 = 3.0;
/// Least confidences of the rows.
const STEPS: [u8; 13] = [1, 16, 32, 48, 64, 80, 96, 112, 128, 160, 192, 224, 255];

/// Counts of pixels by confidence.
#[derive(Clone, Debug)]
pub struct Frontier {
    /// Pixels with truth.
    pixels: u64,
    /// Pixels of each confidence: estimates, bad ones, wrong ones by D1.
    of: [[u64; 3]; 256],
}

/// Estimates left at a least confidence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FrontierRow {
    /// Least confidence of what is left.
    pub min_confidence: u8,
    /// Share of the pixels with truth that is left.
    pub coverage: f64,
    /// Share of what is left that is off by more than 3 px.
    pub bad: f64,
    /// Share of what is left that is wrong by 3 px and 5 %.
    pub d1: f64,
}

impl Default for Frontier {
    fn default() -> Self {
        Self { pixels: 0, of: [[0; 3]; 256] }
    }
}

impl Frontier {
    /// Takes in an image: truth and estimate in 1/256 px, 0 none, and the estimate's confidences.
    pub fn add(&mut self, truth: &Image<u16>, given: &Image<u16>, confidence: &Image<u8>) {
        let pixels = truth.pixels().iter().zip(given.pixels()).zip(confidence.pixels());
        for ((&truth, &given), &confidence) in pixels.filter(|((truth, _), _)| **truth > 0) {
            self.pixels += 1;
            if given == 0 {
                continue;
            }
            let [truth_px, given_px] = [truth, given].map(|q8| f32::from(q8) / ONE_PX);
            let is_bad = (given_px - truth_px).abs() > BAD_PX;
            let is_wrong = Rule::KITTI.is_error(given_px, truth_px);
            if let Some([all, bad, wrong]) = self.of.get_mut(usize::from(confidence)) {
                *all += 1;
                *bad += u64::from(is_bad);
                *wrong += u64::from(is_wrong);
            }
        }
    }

    /// The rows, from all estimates to the surest; those that leave nothing are left out.
    pub fn rows(&self) -> Vec<FrontierRow> {
        STEPS.iter().filter_map(|&least| self.row(least)).collect()
    }

    fn row(&self, min_confidence: u8) -> Option<FrontierRow> {
        let left = self.of.iter().skip(usize::from(min_confidence));
        let [all, bad, wrong] =
            left.fold([0; 3], |sums, of| std::array::from_fn(|i| sums[i] + of[i]));
        (all > 0).then(|| FrontierRow {
            min_confidence,
            coverage: all as f64 / self.pixels as f64,
            bad: bad as f64 / all as f64,
            d1: wrong as f64 / all as f64,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_counts_what_its_confidence_leaves() {
        let image = |q8: [u16; 5]| Image::new(5, 1, q8.to_vec()).unwrap();
        let px = |px: [u16; 5]| image(px.map(|px| px * 256));
        // Right and sure; bad and doubtful, 4 px of 100; without an estimate; without truth; right.
        let (truth, given) = (px([10, 100, 10, 0, 20]), px([10, 104, 0, 5, 21]));
        let confidence = Image::new(5, 1, vec![255, 20, 0, 90, 40]).unwrap();
        let mut frontier = Frontier::default();
        frontier.add(&truth, &given, &confidence);
        let rows = frontier.rows();
        assert_eq!(rows.len(), STEPS.len());
        let row = |least: u8| *rows.iter().find(|row| row.min_confidence == least).unwrap();
        assert_eq!(
            row(1),
            FrontierRow { min_confidence: 1, coverage: 0.75, bad: 1.0 / 3.0, d1: 0.0 }
        );
        assert_eq!((row(32).coverage, row(32).bad), (0.5, 0.0));
        assert_eq!(row(255).coverage, 0.25);
        assert!(Frontier::default().rows().is_empty());
    }
}
