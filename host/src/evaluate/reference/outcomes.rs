//! Outcome at each point of the static map, so that the maps of several runs can be compared on the
//! points all of them show.

use super::{PendingFrame, Region, Rule};
use serde::{Deserialize, Serialize};

/// Points a word has bits for.
const WORD: usize = 64;

/// The points of one frame, in the order of its reference: a bit each.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PointOutcomes {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// Points of the reference, in all regions.
    pub points: usize,
    /// Set where the static map shows a point of its region.
    pub shown: Vec<u64>,
    /// Set where it is right, by KITTI's rule.
    pub right: Vec<u64>,
}

impl PointOutcomes {
    /// Compares the map's disparities of a frame, px, with its samples; `enlarged` as in
    /// [`PendingFrame::compare`].
    pub fn from_frame(frame: &PendingFrame, shown_px: &[f32], enlarged: f32) -> Self {
        let words = frame.samples.len().div_ceil(WORD);
        let (mut shown, mut right) = (vec![0; words], vec![0; words]);
        for (at, (sample, &px)) in frame.samples.iter().zip(shown_px).enumerate() {
            // Objects are elsewhere by the time the map is looked at.
            let is_shown = sample.region == Region::Static && px > 0.0;
            let is_right = is_shown
                && !Rule::KITTI.is_error(enlarged * px, enlarged * sample.point.disparity_px);
            // A bit a point: outcomes of all frames of a sweep are kept.
            shown[at / WORD] |= u64::from(is_shown) << (at % WORD);
            right[at / WORD] |= u64::from(is_right) << (at % WORD);
        }
        Self { frame: frame.frame, points: frame.samples.len(), shown, right }
    }
}

/// Accuracy of each run on the points that all runs show: means over the frames that all of them
/// evaluated, at the same points. And how many points that are. `None` without runs or points.
pub fn on_common_points(runs: &[&[PointOutcomes]]) -> Option<(Vec<f64>, u64)> {
    let (first, _) = runs.split_first()?;
    let (mut sums, mut frames, mut points) = (vec![0.0; runs.len()], 0u32, 0u64);
    for frame in *first {
        // The same frame, with the same points: others cannot be compared.
        let same = |run: &&[PointOutcomes]| {
            run.iter().position(|other| (other.frame, other.points) == (frame.frame, frame.points))
        };
        let Some(of): Option<Vec<&PointOutcomes>> =
            runs.iter().map(|run| run.get(same(run)?)).collect()
        else {
            continue;
        };
        // Bits of points that every run shows.
        let words =
            of.iter().map(|one| one.shown.len().min(one.right.len())).min().unwrap_or_default();
        let common: Vec<u64> = (0..words)
            .map(|word| of.iter().fold(u64::MAX, |all, one| all & one.shown[word]))
            .collect();
        let all: u32 = common.iter().map(|word| word.count_ones()).sum();
        if all == 0 {
            continue;
        }
        // Accuracy on the common points, which differ between runs only in the maps.
        for (sum, one) in sums.iter_mut().zip(&of) {
            let right: u32 = common
                .iter()
                .zip(&one.right)
                .map(|(common, right)| (common & right).count_ones())
                .sum();
            *sum += f64::from(right) / f64::from(all);
        }
        frames += 1;
        points += u64::from(all);
    }
    (frames > 0).then(|| (sums.into_iter().map(|sum| sum / f64::from(frames)).collect(), points))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_points_that_all_show_count() {
        let run = |shown: u64, right: u64| {
            vec![PointOutcomes { frame: 3, points: 5, shown: vec![shown], right: vec![right] }]
        };
        // The second run drops two points; one was wrong in the first.
        let (first, second) = (run(0b11111, 0b00111), run(0b01101, 0b01101));
        let (accuracy, points) = on_common_points(&[&first, &second]).unwrap();
        assert_eq!((accuracy, points), (vec![2.0 / 3.0, 1.0], 3));
        let other = vec![PointOutcomes { frame: 4, ..first[0].clone() }];
        assert!(on_common_points(&[&first, &other]).is_none() && on_common_points(&[]).is_none());
    }
}
