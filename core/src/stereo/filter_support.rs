//! Support points that stand alone, or that add nothing, are taken back (Geiger et al., section
//! 3.1; the published parameters).
//!
//! Every candidate of a row is asked at once, whether it has a match or not: which have one no
//! processor can foresee.

use crate::{
    parallel::Work,
    slices::{clipped, clipped_mut, padded},
};

use super::{StereoConfig, rims::Rims, support::NO_MATCH};

/// Candidates looked at together.
const BLOCK: usize = 64;
/// Width of a block of candidates with the widest window to both sides.
const AROUND: usize = BLOCK + 2 * PLAUSIBLE_WINDOW;
/// Half the window in which a support point needs company, candidates, as published.
const PLAUSIBLE_WINDOW: usize = 5;
/// Largest difference of disparities that are company, px, as published.
const PLAUSIBLE_THRESHOLD: u16 = 5;
/// Fewest support points in the window, itself included, as published.
const PLAUSIBLE_MIN: u16 = 5;
/// Largest difference of disparities that make a point between them redundant, px, as published.
const REDUNDANT_THRESHOLD: u16 = 1;

/// Removes from a grid of candidates, `columns` wide, the implausible points, adds those at the rim
/// and removes the redundant ones; says how many of each there were.
pub(super) struct FilterSupport<'a> {
    pub config: &'a StereoConfig,
    pub grid: &'a mut [i16],
    pub columns: usize,
    /// Distance of the last column and the last row of the image from the last candidates, px.
    pub beyond_px: [usize; 2],
    /// Buffer at least as long as the grid.
    pub scratch: &'a mut [i16],
}

impl Work for FilterSupport<'_> {
    type Output = [u32; 3];

    #[inline(always)]
    fn run(self) -> [u32; 3] {
        let Self { config, grid, columns, beyond_px, scratch } = self;
        let scratch = clipped_mut(scratch, ..grid.len());
        [
            remove_implausible(grid, columns, scratch),
            // What is implausible is not to be continued, and rims may have too many points, too.
            Rims { config, grid: &mut *grid, columns, beyond_px }.extend(),
            remove_redundant(config, grid, columns, scratch),
        ]
    }
}

/// Removes the points with fewer than [`PLAUSIBLE_MIN`] alike ones in the window about them, all
/// tested before any is removed.
#[inline(always)]
fn remove_implausible(grid: &mut [i16], width: usize, before: &mut [i16]) -> u32 {
    let (window, threshold) = (PLAUSIBLE_WINDOW, PLAUSIBLE_THRESHOLD);
    let width = width.max(1);
    // Company is counted in the grid as it was, so that order does not matter.
    before.iter_mut().zip(&*grid).for_each(|(to, from)| *to = *from);
    let mut removed = 0;
    for (v, row) in grid.chunks_exact_mut(width).enumerate() {
        let (top, rows) = (v.saturating_sub(window), v.min(window) + window + 1);
        for (first, points) in (0usize..).step_by(BLOCK).zip(row.chunks_mut(BLOCK)) {
            let here: [i16; BLOCK] = padded(points, 0, 0, NO_MATCH);
            let (mut found, mut lonely) = ([0u16; BLOCK], [0; BLOCK]);
            for row in before.chunks_exact(width).skip(top).take(rows) {
                // What lies left of the row is no match.
                let around: [i16; AROUND] =
                    padded(row, first.saturating_sub(window), window - window.min(first), NO_MATCH);
                for others in around.array_windows::<BLOCK>().take(2 * window + 1) {
                    for ((found, &other), &point) in found.iter_mut().zip(others).zip(&here) {
                        *found += u16::from(are_alike(other, point, threshold));
                    }
                }
                for (lonely, (&found, &point)) in lonely.iter_mut().zip(found.iter().zip(&here)) {
                    *lonely = u16::from(found < PLAUSIBLE_MIN) & u16::from(point != NO_MATCH);
                }
                // Most have found enough after a row or two.
                if lonely.iter().fold(0, |any, lonely| any | lonely) == 0 {
                    break;
                }
            }
            removed += remove(points, &lonely);
        }
    }
    removed
}

/// Removes the points that lie between two alike ones on their column, then on their row; in scan
/// order, each tested against what is left.
#[inline(always)]
fn remove_redundant(
    config: &StereoConfig,
    grid: &mut [i16],
    width: usize,
    turned: &mut [i16],
) -> u32 {
    let height = grid.len() / width.max(1);
    let mut removed = 0;
    // Rows are the columns of the grid on its side; after the second turn it stands again.
    let (mut from, mut to) = (grid, turned);
    for width in [width, height] {
        removed += remove_between(config, from, width);
        transpose(from, width, to);
        core::mem::swap(&mut from, &mut to);
    }
    removed
}

/// Removes the points that lie between two alike ones on their column, from the top down.
#[inline(always)]
fn remove_between(config: &StereoConfig, grid: &mut [i16], width: usize) -> u32 {
    let (reach, threshold, width) = (config.redundant_distance, REDUNDANT_THRESHOLD, width.max(1));
    let mut removed = 0;
    // Rows change in place from the top down: a point removed here does not support those below.
    for start in (0..grid.len()).step_by(width) {
        let Some((above, rest)) = grid.split_at_mut_checked(start) else { break };
        let Some((row, below)) = rest.split_at_mut_checked(width) else { break };
        for (first, points) in (0usize..).step_by(BLOCK).zip(row.chunks_mut(BLOCK)) {
            let here: [i16; BLOCK] = padded(points, 0, 0, NO_MATCH);
            let mut between = [1; BLOCK];
            // A point is redundant only with an alike one both above and below it.
            for rows in [
                clipped(above, above.len().saturating_sub(reach * width)..),
                clipped(below, ..below.len().min(reach * width)),
            ] {
                let any = any_alike(rows.chunks_exact(width), first, &here, threshold);
                between.iter_mut().zip(any).for_each(|(between, any)| *between &= any);
            }
            removed += remove(points, &between);
        }
    }
    removed
}

/// 1 for each of the points from column `first` on that has an alike one on its column in any of
/// the rows, else 0.
#[inline(always)]
fn any_alike<'r>(
    rows: impl Iterator<Item = &'r [i16]>,
    first: usize,
    points: &[i16; BLOCK],
    threshold: u16,
) -> [u16; BLOCK] {
    let mut any = [0u16; BLOCK];
    // Flags instead of branches, so that the compiler can use vectors.
    for row in rows {
        let others: [i16; BLOCK] = padded(row, first, 0, NO_MATCH);
        for ((any, other), &point) in any.iter_mut().zip(others).zip(points) {
            *any |= u16::from(are_alike(other, point, threshold));
        }
    }
    any
}

/// Returns true if a candidate has a match whose disparity is within the threshold of a point's.
#[inline(always)]
fn are_alike(other: i16, point: i16, threshold: u16) -> bool {
    (other != NO_MATCH) & (other.abs_diff(point) <= threshold)
}

/// Takes the points whose flag is 1, not 0; says how many there were.
#[inline(never)]
fn remove(points: &mut [i16], flags: &[u16; BLOCK]) -> u32 {
    let mut removed = 0u16;
    for (point, &flag) in points.iter_mut().zip(flags) {
        let goes = flag & u16::from(*point != NO_MATCH);
        *point = if goes == 1 { NO_MATCH } else { *point };
        removed += goes;
    }
    u32::from(removed)
}

/// Makes columns of rows.
#[inline(always)]
fn transpose(from: &[i16], width: usize, to: &mut [i16]) {
    let height = from.len() / width.max(1);
    for (u, column) in to.chunks_exact_mut(height.max(1)).enumerate() {
        let values = clipped(from, u..).iter().step_by(width.max(1));
        column.iter_mut().zip(values).for_each(|(to, from)| *to = *from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::{vec, vec::Vec};

    #[test]
    fn a_lonely_point_goes_and_a_cluster_stays() {
        let mut grid = vec![NO_MATCH; 20 * 20];
        for (u, v) in [(2, 2), (3, 2), (2, 3), (3, 3), (4, 4)] {
            grid[v * 20 + u] = 30 + u as i16;
        }
        grid[15 * 20 + 15] = 30;
        grid[2 * 20 + 4] = 90;
        let removed = remove_implausible(&mut grid, 20, &mut [0; 400]);
        assert_eq!(removed, 2);
        assert_eq!(grid.iter().filter(|&&d| d != NO_MATCH).count(), 5);
    }

    #[test]
    fn the_implausible_are_those_whose_whole_window_has_too_few_alike() {
        let (window, threshold) = (PLAUSIBLE_WINDOW as i32, PLAUSIBLE_THRESHOLD);
        let mut random = Random::new(72);
        // Also a grid that is narrower than a window.
        for (width, height, sparse) in [(23i32, 17i32, 4), (40, 9, 9), (5, 30, 2)] {
            let before: Vec<i16> = (0..width * height)
                .map(|_| if random.below(sparse) > 0 { NO_MATCH } else { random.below(60) as i16 })
                .collect();
            let mut grid = before.clone();
            // What is removed still counts for its neighbours: the twin reads the grid from before.
            let removed = remove_implausible(&mut grid, width as usize, &mut vec![0; before.len()]);
            let at = |u: i32, v: i32| before[(v * width + u) as usize];
            for (u, v) in (0..width)
                .flat_map(|u| (0..height).map(move |v| (u, v)))
                .filter(|&(u, v)| at(u, v) != NO_MATCH)
            {
                let rows = (v - window).max(0)..(v + window + 1).min(height);
                let columns = (u - window).max(0)..(u + window + 1).min(width);
                let alike = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
                let alike = alike
                    .filter(|&(x, y)| {
                        at(x, y) != NO_MATCH && at(x, y).abs_diff(at(u, v)) <= threshold
                    })
                    .count();
                let expected = if alike < usize::from(PLAUSIBLE_MIN) { NO_MATCH } else { at(u, v) };
                assert_eq!(grid[(v * width + u) as usize], expected);
            }
            assert_eq!(removed as usize, before.iter().zip(&grid).filter(|(a, b)| a != b).count());
            assert!(removed > 0 && grid.iter().any(|&d| d != NO_MATCH));
        }
    }

    #[test]
    fn a_flat_wall_is_thinned_but_its_corners_stay() {
        let mut grid = vec![12i16; 31 * 17];
        let removed = remove_redundant(&StereoConfig::robotics(), &mut grid, 31, &mut [0; 31 * 17]);
        assert_eq!(removed as usize, grid.iter().filter(|&&d| d == NO_MATCH).count());
        for corner in [0, 30, 16 * 31, 16 * 31 + 30] {
            assert_eq!(grid[corner], 12);
        }
        assert!(removed > 31 * 17 * 8 / 10);
        // What is left still says 12 within the reach of every removed point.
        for v in 0..17usize {
            assert!(
                v == 0
                    || v == 16
                    || (v.saturating_sub(5)..(v + 6).min(17))
                        .any(|w| grid[w * 31..][..31].contains(&12))
            );
        }
    }

    #[test]
    fn the_redundant_are_those_that_a_walk_in_scan_order_takes() {
        let config = StereoConfig::default();
        let mut random = Random::new(73);
        // Also lines of a single point, and long ones.
        for (width, height) in [(23, 17), (150, 9), (64, 70), (1, 5), (5, 1)] {
            let mut grid: Vec<i16> = (0..width * height)
                .map(|_| if random.below(5) == 0 { NO_MATCH } else { random.below(4) as i16 })
                .collect();
            let mut expected = grid.clone();
            // Down the columns first, and then along the rows, as libelas does it.
            for (stride, length, lines, line_stride) in
                [(width, height, width, 1), (1, width, height, width)]
            {
                for (line, i) in (0..lines).flat_map(|line| (0..length).map(move |i| (line, i))) {
                    let at = |k: usize| line * line_stride + k * stride;
                    let here = expected[at(i)];
                    let alike = |k: usize| {
                        expected[at(k)] != NO_MATCH
                            && expected[at(k)].abs_diff(here) <= REDUNDANT_THRESHOLD
                    };
                    // Taken points do not support those behind them.
                    let reach = config.redundant_distance;
                    if (i.saturating_sub(reach)..i).any(alike)
                        && (i + 1..length.min(i + reach + 1)).any(alike)
                    {
                        expected[at(i)] = NO_MATCH;
                    }
                }
            }
            let before = grid.clone();
            let removed = remove_redundant(&config, &mut grid, width, &mut vec![0; before.len()]);
            assert_eq!(grid, expected);
            assert_eq!(removed as usize, before.iter().zip(&grid).filter(|(a, b)| a != b).count());
        }
    }
}
