//! Fractions of a pixel: where between the disparities beside it the distance has its least value,
//! if it falls and rises with the same slope.

use super::{NONE, WORKING_ONE_PX, load};
use crate::{
    lanes::{Eight, LANES},
    sad::Kernels,
    slices::store,
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
#[expect(clippy::indexing_slicing, reason = "lanes are below eight")]
pub(super) fn refine_row(
    config: &StereoConfig,
    here: &[Descriptor],
    other: &[Descriptor],
    row: &mut [i16],
    kernels: &impl Kernels,
) {
    let mut spare = UNTEXTURED;
    for u in (0..row.len()).step_by(LANES) {
        let mut disparities = load(row, u);
        let mut fractions = [0; LANES];
        // Eight pixels without a disparity have nothing to refine.
        if config.subpixel && disparities != [NO_PLANE; LANES] {
            let pixels =
                Matched { points: eight(here, u, &mut spare), u, disparities_px: disparities };
            fractions = find_fractions(config, &pixels, other, kernels);
        }
        for lane in 0..LANES {
            let px = disparities[lane];
            disparities[lane] =
                if px == NO_PLANE { NONE } else { px * WORKING_ONE_PX + fractions[lane] as i16 };
        }
        store(row, u, disparities);
    }
}

/// Eight pixels from column `u` on, with their disparities.
struct Matched<'a> {
    points: &'a Eight<Descriptor>,
    u: usize,
    disparities_px: Eight<i16>,
}

/// The fractions of eight pixels from column `u` on, in working units; 0 for those whose disparity
/// has no neighbours to compare it with.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "steps are below three, lanes below eight")]
fn find_fractions(
    config: &StereoConfig,
    pixels: &Matched<'_>,
    other: &[Descriptor],
    kernels: &impl Kernels,
) -> Eight<i32> {
    let &Matched { points, u, disparities_px: px } = pixels;
    // In the right image disparity grows to the left.
    let mut windows = [&[Descriptor::UNTEXTURED; 3]; LANES];
    for ((column, window), d) in (u..).zip(&mut windows).zip(px) {
        let after = column.wrapping_sub(usize::from(d.unsigned_abs()) + 1);
        if let Some(three) = other.get(after..).and_then(|row| row.first_chunk()) {
            *window = three;
        }
    }
    // The kernels take the costs after and at the match as one pair, and the one before it by
    // itself.
    let (mut twos, mut lasts) =
        ([&[Descriptor::UNTEXTURED; 2]; LANES], [&Descriptor::UNTEXTURED; LANES]);
    for lane in 0..LANES {
        if let Some((two, [last])) = windows[lane].split_first_chunk() {
            (twos[lane], lasts[lane]) = (two, last);
        }
    }
    let ([after, at], before) = (kernels.sums_of_two(points, twos), kernels.sums_of(points, lasts));
    let (mut dividends, mut divisors, mut counts) = ([0; LANES], [1; LANES], [false; LANES]);
    for lane in 0..LANES {
        let (before, at, after, d) =
            (before[lane] as i32, at[lane] as i32, after[lane] as i32, i32::from(px[lane]));
        // A neighbour beyond the border, or beyond the largest disparity, was never a candidate.
        let reach = (u + lane) as i32 - MARGIN as i32;
        let reach = if reach < i32::from(config.disparity_max) {
            reach
        } else {
            i32::from(config.disparity_max)
        };
        // Two lines of equal slope through the three costs.
        let (least, rise) =
            if before < after { (before, after - at) } else { (after, before - at) };
        // Below 2^17.
        dividends[lane] = MOST * (before - after);
        divisors[lane] = if rise > 1 { rise } else { 1 };
        // Only a minimum between two larger costs has a vertex.
        counts[lane] = (d >= 1) & (d < reach) & (least >= at);
    }
    // A parabola's vertex by integer division: the same on every machine.
    let mut fractions = kernels.quotients(dividends, divisors);
    for lane in 0..LANES {
        fractions[lane] = if counts[lane] { fractions[lane] } else { 0 };
    }
    fractions
}
