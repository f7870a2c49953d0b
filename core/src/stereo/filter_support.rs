//! Support points that stand alone, or that add nothing, are taken back (Geiger et al., section 3.1; the published parameters).

use crate::part::part;

use super::{StereoConfig, support::NO_MATCH};

/// Removes the points with fewer than `plausible_min` alike ones in the window about them, all tested before any is removed. `scratch`
/// is as long as `grid`. Returns how many were removed.
pub(super) fn remove_implausible(config: &StereoConfig, grid: &mut [i16], width: usize, scratch: &mut [i16]) -> u32 {
    let (Some(before), window) = (scratch.get_mut(..grid.len()), config.plausible_window) else { return 0 };
    let width = width.max(1);
    before.iter_mut().zip(&*grid).for_each(|(to, from)| *to = *from);
    let threshold = config.plausible_threshold.min(i16::MAX as u16);
    let mut removed = 0;
    for (v, row) in grid.chunks_exact_mut(width).enumerate() {
        let (top, rows) = (v.saturating_sub(window), v.min(window) + window + 1);
        for (u, point) in row.iter_mut().enumerate().filter(|(_, point)| **point != NO_MATCH) {
            let (left, columns) = (u.saturating_sub(window), u.min(window) + window + 1);
            let alike = |other: &&i16| **other != NO_MATCH && other.abs_diff(*point) <= threshold;
            let mut missing = usize::from(config.plausible_min);
            for row in before.chunks_exact(width).skip(top).take(rows) {
                missing = missing.saturating_sub(part(row, left..).iter().take(columns).filter(alike).count());
                // Most have found enough after a row or two.
                if missing == 0 {
                    break;
                }
            }
            if missing > 0 {
                *point = NO_MATCH;
                removed += 1;
            }
        }
    }
    removed
}

/// Removes the points that lie between two alike ones on their column, then on their row; in scan order, each tested against what is left.
/// Returns how many were removed.
pub(super) fn remove_redundant(config: &StereoConfig, grid: &mut [i16], width: usize) -> u32 {
    let height = grid.len() / width.max(1);
    let mut removed = 0;
    for (stride, length, lines, line_stride) in [(width, height, width, 1), (1, width, height, width)] {
        for line in 0..lines {
            for i in 0..length {
                removed += u32::from(thin(config, grid, line * line_stride, stride, length, i));
            }
        }
    }
    removed
}

/// Removes item `i` of a line if it has an alike one on both sides; says whether it did.
fn thin(config: &StereoConfig, grid: &mut [i16], start: usize, stride: usize, length: usize, i: usize) -> bool {
    let item = |k: usize| grid.get(start + k * stride).copied().unwrap_or(NO_MATCH);
    let here = item(i);
    if here == NO_MATCH {
        return false;
    }
    let alike = |k: usize| item(k) != NO_MATCH && item(k).abs_diff(here) <= config.redundant_threshold;
    let reach = config.redundant_distance;
    let between = (i.saturating_sub(reach)..i).any(alike) && (i + 1..length.min(i + reach + 1)).any(alike);
    if between && let Some(point) = grid.get_mut(start + i * stride) {
        *point = NO_MATCH;
    }
    between
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
        let removed = remove_implausible(&StereoConfig::robotics(), &mut grid, 20, &mut [0; 400]);
        assert_eq!(removed, 2);
        assert_eq!(grid.iter().filter(|&&d| d != NO_MATCH).count(), 5);
    }

    #[test]
    fn the_implausible_are_those_whose_whole_window_has_too_few_alike() {
        let config = StereoConfig::robotics();
        let (window, threshold) = (config.plausible_window as i32, config.plausible_threshold);
        let mut random = Random::new(72);
        for (width, height, sparse) in [(23i32, 17i32, 4), (40, 9, 9), (5, 30, 2)] {
            let before: Vec<i16> =
                (0..width * height).map(|_| if random.below(sparse) > 0 { NO_MATCH } else { random.below(60) as i16 }).collect();
            let mut grid = before.clone();
            let removed = remove_implausible(&config, &mut grid, width as usize, &mut vec![0; before.len()]);
            let at = |u: i32, v: i32| before[(v * width + u) as usize];
            for (u, v) in (0..width).flat_map(|u| (0..height).map(move |v| (u, v))).filter(|&(u, v)| at(u, v) != NO_MATCH) {
                let rows = (v - window).max(0)..(v + window + 1).min(height);
                let columns = (u - window).max(0)..(u + window + 1).min(width);
                let alike = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
                let alike = alike.filter(|&(x, y)| at(x, y) != NO_MATCH && at(x, y).abs_diff(at(u, v)) <= threshold).count();
                let expected = if alike < usize::from(config.plausible_min) { NO_MATCH } else { at(u, v) };
                assert_eq!(grid[(v * width + u) as usize], expected);
            }
            assert_eq!(removed as usize, before.iter().zip(&grid).filter(|(a, b)| a != b).count());
            assert!(removed > 0 && grid.iter().any(|&d| d != NO_MATCH));
        }
    }

    #[test]
    fn a_flat_wall_is_thinned_but_its_corners_stay() {
        let mut grid = vec![12i16; 31 * 17];
        let removed = remove_redundant(&StereoConfig::robotics(), &mut grid, 31);
        assert_eq!(removed as usize, grid.iter().filter(|&&d| d == NO_MATCH).count());
        for corner in [0, 30, 16 * 31, 16 * 31 + 30] {
            assert_eq!(grid[corner], 12);
        }
        assert!(removed > 31 * 17 * 8 / 10);
        // What is left still says 12 within the reach of every removed point.
        for v in 0..17usize {
            assert!(v == 0 || v == 16 || (v.saturating_sub(5)..(v + 6).min(17)).any(|w| grid[w * 31..][..31].contains(&12)));
        }
    }
}
