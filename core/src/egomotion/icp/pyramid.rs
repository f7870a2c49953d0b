//! The measured disparity at half, a quarter and an eighth of its size, in memory lent for the
//! purpose. Disparities are averaged, not depths: on a plane their mean is that of the middle.

use super::config::MAX_LEVELS;
use crate::{
    geometry::StereoRig,
    image::{DISPARITY_ONE_PX, View},
};

/// Disparities within this of a block's first one are averaged with it, px: means never bridge an
/// edge.
const SAME_PX: f32 = 1.0;
/// Least size of a level beyond the finest, px: on smaller ones most points lie on edges, and lead
/// astray.
const MIN_WIDTH: usize = 64;
/// Least height of a level, px.
const MIN_HEIGHT: usize = 20;

/// Disparity in px of the full image, finest first; 0 where it is unknown or its depth is beyond
/// the limits.
pub(super) struct Pyramid<'a> {
    levels: [Option<View<'a, f32>>; MAX_LEVELS as usize],
}

impl<'a> Pyramid<'a> {
    /// Averages 2 x 2 px after 2 x 2 px. `memory` needs a third of the image's pixels; levels that
    /// do not fit are left out.
    pub fn build(
        rig: &StereoRig,
        limits_m: [f32; 2],
        disparity_q8: View<'_, u16>,
        levels: u8,
        memory: &'a mut [f32],
    ) -> Self {
        let mut pyramid = Self { levels: [None; MAX_LEVELS as usize] };
        let (mut width, mut height) = (disparity_q8.width() / 2, disparity_q8.height() / 2);
        let mut rest = memory;
        // The farthest point has the smallest disparity: the limits change places.
        let limits_px = [limits_m[1], limits_m[0]]
            .map(|depth_m| (rig.focal_baseline_px_m() / f64::from(depth_m)) as f32);
        let mut finer: Option<View<'a, f32>> = None;
        for slot in pyramid.levels.iter_mut().take(usize::from(levels)) {
            let pixels = width * height;
            // The finest level is kept at any size; a coarser one needs enough pixels to pair.
            let coarse = finer.is_some() && (width < MIN_WIDTH || height < MIN_HEIGHT);
            if coarse || pixels == 0 {
                break;
            }
            let Some(level) = rest.split_off_mut(..pixels) else { break };
            // The first level halves the input, in 1/256 px; each other one the level before it.
            match finer {
                None => halve_given(limits_px, disparity_q8, level, width),
                Some(finer) => halve(finer, level, width),
            }
            finer = View::new(level, width, height);
            *slot = finer;
            (width, height) = (width / 2, height / 2);
        }
        pyramid
    }

    /// The levels that fit, coarsest first, each with its number: 0 is the finest.
    pub fn coarse_to_fine(&self) -> impl Iterator<Item = (usize, View<'a, f32>)> {
        self.levels.iter().enumerate().rev().filter_map(|(at, level)| Some((at, (*level)?)))
    }

    /// The finest level with pixels at least twice as far apart as those of a picture of every so
    /// many pixels, or else the coarsest.
    pub fn finest_for(&self, every: usize) -> usize {
        let is_coarse = |level: &usize| Self::stride_px(*level) >= (2 * every) as f64;
        let levels = self.levels.iter().flatten().count();
        (0..levels).find(is_coarse).unwrap_or(levels.saturating_sub(1))
    }

    /// Px of the image between two pixels of a level.
    pub fn stride_px(level: usize) -> f64 {
        f64::from(2u32 << level.min(usize::from(MAX_LEVELS)))
    }
}

/// Mean of the given disparities of each 2 x 2 px within the limits, px.
fn halve_given(limits_px: [f32; 2], disparity_q8: View<'_, u16>, level: &mut [f32], width: usize) {
    let px = |value: u16| {
        let px = f32::from(value) / f32::from(DISPARITY_ONE_PX);
        // Disparities outside the limits count as none.
        if px >= limits_px[0] && px <= limits_px[1] { px } else { 0.0 }
    };
    for (v, row) in level.chunks_exact_mut(width.max(1)).enumerate() {
        for (to, four) in
            row.iter_mut().zip(blocks(disparity_q8.row(2 * v), disparity_q8.row(2 * v + 1)))
        {
            *to = mean(four.map(px));
        }
    }
}

/// Mean of each 2 x 2 px of a finer level.
fn halve(finer: View<'_, f32>, level: &mut [f32], width: usize) {
    for (v, row) in level.chunks_exact_mut(width.max(1)).enumerate() {
        for (to, four) in row.iter_mut().zip(blocks(finer.row(2 * v), finer.row(2 * v + 1))) {
            *to = mean(four);
        }
    }
}

/// Mean of the disparities close to the first one there is.
fn mean(four: [f32; 4]) -> f32 {
    let first = four.into_iter().find(|&value| value > 0.0).unwrap_or(0.0);
    let near = four.into_iter().filter(|&value| value > 0.0 && (value - first).abs() <= SAME_PX);
    let (sum, count) = near.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

/// 2 x 2 px after 2 x 2 px of two rows.
fn blocks<'r, T: Copy>(upper: &'r [T], lower: &'r [T]) -> impl Iterator<Item = [T; 4]> + 'r {
    upper
        .as_chunks::<2>()
        .0
        .iter()
        .zip(lower.as_chunks::<2>().0)
        .map(|([a, b], [c, d])| [*a, *b, *c, *d])
}
