//! Fractions of a pixel: where between the disparities beside it the distance has its least value, if it falls and rises with the same
//! slope.

use super::{NONE, WORKING_ONE_PX};
use crate::{
    sad::{Eight, Kernels, LANES},
    stereo::{
        StereoConfig,
        descriptor::{Descriptor, MARGIN, UNTEXTURED, eight},
        prior::NO_PLANE,
    },
};

/// Less than half a pixel, so that what it is added to still rounds to the same.
const MOST: i32 = WORKING_ONE_PX as i32 / 2 - 1;

/// Turns a left row of disparities in px, or [`NO_PLANE`], into working units, or [`NONE`].
#[inline(always)]
pub(super) fn refine_row(config: &StereoConfig, here: &[Descriptor], other: &[Descriptor], row: &mut [i16], kernels: &impl Kernels) {
    let mut spare = UNTEXTURED;
    for (i, disparities) in row.chunks_mut(LANES).enumerate() {
        let mut px = [NO_PLANE; LANES];
        px.iter_mut().zip(&*disparities).for_each(|(px, d)| *px = *d);
        let mut fractions = [0; LANES];
        if config.subpixel && px != [NO_PLANE; LANES] {
            let u = i * LANES;
            fractions = find_fractions(config, eight(here, u, &mut spare), other, (u, px), kernels);
        }
        for ((to, px), fraction) in disparities.iter_mut().zip(px).zip(fractions) {
            *to = if px == NO_PLANE { NONE } else { px * WORKING_ONE_PX + fraction as i16 };
        }
    }
}

/// The fractions of eight pixels from column `u` on, in working units; 0 for those whose disparity has no neighbours to compare it with.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "steps are below three")]
fn find_fractions(
    config: &StereoConfig,
    points: &Eight<Descriptor>,
    other: &[Descriptor],
    (u, px): (usize, Eight<i16>),
    kernels: &impl Kernels,
) -> Eight<i32> {
    // In the right image disparity grows to the left.
    let mut windows = [&[Descriptor::UNTEXTURED; 3]; LANES];
    for ((column, window), d) in (u..).zip(&mut windows).zip(px) {
        let after = column.wrapping_sub(usize::from(d.unsigned_abs()) + 1);
        if let Some(three) = other.get(after..).and_then(|row| row.first_chunk()) {
            *window = three;
        }
    }
    let distances = |step: usize| kernels.sums_of(points, windows.map(|window| &window[step]));
    let (after, at, before) = (distances(0), distances(1), distances(2));
    let mut fractions = [0; LANES];
    let distances = before.into_iter().zip(at).zip(after);
    for (lane, ((fraction, px), ((before, at), after))) in fractions.iter_mut().zip(px).zip(distances).enumerate() {
        let (before, at, after, d) = (before as i32, at as i32, after as i32, i32::from(px));
        let reach = (u + lane) as i32 - MARGIN as i32;
        let reach = if reach < i32::from(config.disparity_max) { reach } else { i32::from(config.disparity_max) };
        let (least, rise) = if before < after { (before, after - at) } else { (after, before - at) };
        // The operands are integers below 2^17: the quotient is that of whole numbers, once its fraction is cut off.
        let offset = ((MOST * (before - after)) as f32 / (if rise > 1 { rise } else { 1 }) as f32) as i32;
        *fraction = if (d >= 1) & (d < reach) & (least >= at) { offset } else { 0 };
    }
    fractions
}
