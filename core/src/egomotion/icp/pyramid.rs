//! The measured depth at half, a quarter and an eighth of its size, in memory lent for the purpose.

use super::config::MAX_LEVELS;
use crate::{
    geometry::StereoRig,
    image::{DISPARITY_ONE_PX, View},
};

/// Disparities within this of a block's first one are averaged with it, 1/256 px: means never bridge an edge.
const SAME_Q8: u16 = 256;
/// The same of depths, as a share.
const SAME_SHARE: f32 = 0.05;

/// Depth images, finest first; 0 where there is none.
pub(super) struct Pyramid<'a> {
    levels: [Option<View<'a, f32>>; MAX_LEVELS as usize],
}

impl<'a> Pyramid<'a> {
    /// Averages 2 x 2 px after 2 x 2 px. `memory` needs a third of the image's pixels; levels that do not fit are left out.
    pub fn build(rig: &StereoRig, limits_m: [f32; 2], disparity_q8: View<'_, u16>, levels: u8, memory: &'a mut [f32]) -> Self {
        let mut pyramid = Self { levels: [None; MAX_LEVELS as usize] };
        let (mut width, mut height) = (disparity_q8.width() / 2, disparity_q8.height() / 2);
        let mut rest = memory;
        let mut finer: Option<View<'a, f32>> = None;
        for slot in pyramid.levels.iter_mut().take(usize::from(levels)) {
            let pixels = width * height;
            if pixels == 0 || rest.len() < pixels {
                break;
            }
            let (level, after) = rest.split_at_mut(pixels);
            rest = after;
            match finer {
                None => halve_disparity(rig, limits_m, disparity_q8, level, width),
                Some(finer) => halve_depth(finer, level, width),
            }
            finer = View::new(level, width, height);
            *slot = finer;
            (width, height) = (width / 2, height / 2);
        }
        pyramid
    }

    /// The levels there are, coarsest first, each with its place: 0 is the finest.
    pub fn coarse_to_fine(&self) -> impl Iterator<Item = (usize, View<'a, f32>)> {
        self.levels.iter().enumerate().rev().filter_map(|(at, level)| Some((at, (*level)?)))
    }

    /// Px of the image between two pixels of a level.
    pub fn stride_px(level: usize) -> f64 {
        f64::from(2u32 << level.min(usize::from(MAX_LEVELS)))
    }
}

/// Mean disparity of each 2 x 2 px, as depth.
fn halve_disparity(rig: &StereoRig, [near_m, far_m]: [f32; 2], disparity_q8: View<'_, u16>, level: &mut [f32], width: usize) {
    let px_m = (rig.focal_baseline_px_m() * f64::from(DISPARITY_ONE_PX)) as f32;
    for (v, row) in level.chunks_exact_mut(width).enumerate() {
        for (to, four) in row.iter_mut().zip(blocks(disparity_q8.row(2 * v), disparity_q8.row(2 * v + 1))) {
            let mut sum = 0u32;
            let mut count = 0u32;
            let first = four.into_iter().find(|&value| value > 0).unwrap_or(0);
            for value in four.into_iter().filter(|&value| value > 0 && value.abs_diff(first) <= SAME_Q8) {
                (sum, count) = (sum + u32::from(value), count + 1);
            }
            let depth_m = px_m * count as f32 / sum as f32;
            // False where there is none: 0 / 0 is no number.
            *to = if depth_m >= near_m && depth_m <= far_m { depth_m } else { 0.0 };
        }
    }
}

/// Mean depth of each 2 x 2 px.
fn halve_depth(finer: View<'_, f32>, level: &mut [f32], width: usize) {
    for (v, row) in level.chunks_exact_mut(width).enumerate() {
        for (to, four) in row.iter_mut().zip(blocks(finer.row(2 * v), finer.row(2 * v + 1))) {
            let first = four.into_iter().find(|&value| value > 0.0).unwrap_or(0.0);
            let near = |value: f32| value > 0.0 && (value - first).abs() <= SAME_SHARE * first;
            let (sum, count) =
                four.into_iter().filter(|&value| near(value)).fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
            *to = if count > 0.0 { sum / count } else { 0.0 };
        }
    }
}

/// 2 x 2 px after 2 x 2 px of two rows.
fn blocks<'r, T: Copy>(upper: &'r [T], lower: &'r [T]) -> impl Iterator<Item = [T; 4]> + 'r {
    upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0).map(|([a, b], [c, d])| [*a, *b, *c, *d])
}
