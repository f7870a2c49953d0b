//! Support points on the image's rim, so that planes reach it.
//!
//! Candidates on the outermost rows and columns have no window and hence no match: without points
//! there, the last rows, of road right before the camera, lie outside of the triangulation and are
//! never matched. Along each line of candidates that begins at the rim, the surface of the two
//! outermost points is continued up to it. What the continued planes say is searched and checked
//! like any other disparity. Memory: none. Time: some ten candidates for each at the rim.

use super::{StereoConfig, config::CANDIDATE_STEP, support::NO_MATCH};

/// Candidates between the two points of a line: enough for a slope, few enough for one surface.
const BASE: core::ops::RangeInclusive<usize> = 2..=12;
/// Largest difference of two points of one surface, px, as between points that are company.
const SAME_SURFACE: u16 = 5;

/// A grid of candidates whose rim gets points.
pub(super) struct Rims<'a> {
    pub config: &'a StereoConfig,
    pub grid: &'a mut [i16],
    /// Candidates along a row.
    pub columns: usize,
    /// Distance of the last column and the last row of the image from the last candidates, px.
    pub beyond_px: [usize; 2],
}

impl Rims<'_> {
    /// Adds the points; returns how many.
    pub fn extend(self) -> u32 {
        let Self { config, grid, columns, beyond_px: [beyond_u, beyond_v] } = self;
        let (rows, last) = (grid.len() / columns.max(1), grid.len().saturating_sub(1));
        let mut added = 0;
        // Bottom and top, whose lines are columns, and the right. The left rim is not in the right
        // image: points there would only take from the surfaces beside it what is redundant.
        for (along, inward, lines, depth, is_end, beyond) in [
            (1, columns, columns, rows, true, beyond_v),
            (1, columns, columns, rows, false, 0),
            (columns, 1, rows, columns, true, beyond_u),
        ] {
            for line in 0..lines {
                // From the end, the grid is read backwards.
                let at = |step: usize| {
                    let index = line * along + step * inward;
                    if is_end { last.saturating_sub(index) } else { index }
                };
                let point = |step: usize| {
                    let known = grid.get(at(step)).filter(|&&d| d != NO_MATCH);
                    Some((step, *known.filter(|_| step < depth)?))
                };
                let found = continued(point, config.rim_reach, beyond);
                let most = i32::from(config.disparity_max);
                let found = found.filter(|disparity| (0..=most).contains(disparity));
                if let (Some(disparity), Some(rim)) = (found, grid.get_mut(at(0)))
                    && *rim == NO_MATCH
                {
                    *rim = disparity as i16;
                    added += 1;
                }
            }
        }
        added
    }
}

/// The disparity at the rim, `beyond` px outside of a line's first candidate, of the surface of its
/// two outermost points: the first at most `reach` candidates inside.
fn continued(
    point: impl Fn(usize) -> Option<(usize, i16)>,
    reach: usize,
    beyond: usize,
) -> Option<i32> {
    let (near, disparity) = (1..=reach).find_map(&point)?;
    let is_same = |&(_, other): &(usize, i16)| other.abs_diff(disparity) <= SAME_SURFACE;
    let (far, inner) = BASE.rev().find_map(|base| point(near + base).filter(is_same))?;
    let disparity = i32::from(disparity);
    let rise = (disparity - i32::from(inner)) * (near * CANDIDATE_STEP + beyond) as i32;
    // To the nearest: twice the fraction, and a half.
    let run = ((far - near) * CANDIDATE_STEP) as i32;
    Some(disparity + (2 * rise + run).checked_div_euclid(2 * run)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{vec, vec::Vec};

    /// A grid of 20 x 30 candidates of a plane, without those at the rim.
    fn plane(at: impl Fn(usize, usize) -> i16) -> Vec<i16> {
        let inside = |i, j| (1..19).contains(&i) && (1..29).contains(&j);
        (0..600)
            .map(|k| (k % 20, k / 20))
            .map(|(i, j)| if inside(i, j) { at(i, j) } else { NO_MATCH })
            .collect()
    }

    fn extended(rim_reach: usize, mut grid: Vec<i16>, beyond_px: [usize; 2]) -> (u32, Vec<i16>) {
        let config = StereoConfig { rim_reach, ..StereoConfig::default() };
        let added = Rims { config: &config, grid: &mut grid, columns: 20, beyond_px }.extend();
        (added, grid)
    }

    #[test]
    fn a_plane_goes_on_up_to_the_rim() {
        // One px of disparity every candidate down, and one in two to the right.
        let truth = |i: usize, j: usize| 20 + j as i16 + i as i16 / 2;
        let (added, grid) = extended(6, plane(truth), [0, 0]);
        // The left rim has none.
        assert_eq!(added, 2 * 19 + 28);
        for (k, &d) in grid.iter().enumerate().filter(|(k, _)| k % 20 > 0) {
            assert!(d.abs_diff(truth(k % 20, k / 20)) <= 1, "{d} at {k}");
        }
        // Four px below the last candidates the road is most of a px nearer.
        let (_, grid) = extended(6, plane(|_, j| j as i16), [0, 4]);
        assert_eq!((grid[590], grid[10]), (30, 0));
    }

    #[test]
    fn a_rim_stays_empty_without_two_points_of_one_surface_nearby() {
        let lone = |at: (usize, usize)| plane(|i, j| if (i, j) == at { 30 } else { NO_MATCH });
        assert_eq!(extended(6, lone((10, 27)), [0, 0]).0, 0, "one point");
        let step = plane(|i, j| if i == 10 { 40 * i16::from(j > 26) } else { NO_MATCH });
        let (_, grid) = extended(6, step, [0, 0]);
        assert_eq!(grid[590], NO_MATCH, "two surfaces");
        let far = plane(|i, j| if i == 10 && j < 22 { 30 } else { NO_MATCH });
        assert_eq!(extended(6, far.clone(), [0, 0]).1[590], NO_MATCH, "too far inside");
        assert_eq!(extended(8, far, [0, 0]).1[590], 30);
        assert_eq!(extended(0, plane(|_, _| 30), [0, 0]).0, 0, "off");
        // A surface that would pass behind infinity has no disparity.
        let receding = plane(|_, j| 28 - j as i16);
        assert_eq!(extended(6, receding, [0, 0]).1[590], NO_MATCH);
    }

    #[test]
    fn grids_of_any_shape_are_extended() {
        for (columns, rows) in [(0, 0), (1, 1), (1, 9), (9, 1), (3, 3)] {
            let mut grid = vec![5; columns * rows];
            let config = &StereoConfig::default();
            let rims = Rims { config, grid: &mut grid, columns, beyond_px: [4, 4] };
            assert_eq!(rims.extend(), 0, "none is empty");
        }
    }
}
