//! Triangulations against the definition.

use super::*;
use crate::{memory::SLAB_ALIGN, random::Random};
use std::{vec, vec::Vec};

fn point(u: usize, v: usize) -> SupportPoint {
    SupportPoint { u: u as u16, v: v as u16, disparity: 1 }
}

/// Triangulates and checks everything that makes a Delaunay triangulation: every triangle turns
/// left, none has a point within its circle, together they fill the hull.
fn check(points: &[SupportPoint]) -> usize {
    let mut memory = vec![0u8; Triangulation::bytes(points.len()) + SLAB_ALIGN];
    let skip = memory.as_ptr().align_offset(SLAB_ALIGN);
    let mut carver = Carver::new(&mut memory[skip..], 0).unwrap();
    let mut mesh = Triangulation::new_in(points.len(), ["p", "t", "h"], &mut carver);
    // The matcher, too, adds its points from the top row down.
    let mut in_rows = points.to_vec();
    in_rows.sort_by_key(|point| point.v);
    for &point in &in_rows {
        mesh.add(point);
    }
    mesh.triangulate();
    let (mut area, triangles): (i64, Vec<_>) = (0, mesh.triangles().collect());
    for &[a, b, c] in &triangles {
        assert!(orientation(a, b, c) > 0);
        area += orientation(a, b, c);
        assert!(
            !mesh
                .points()
                .iter()
                .any(|&p| in_circle([a, b, c].map(|corner| Offset::new(corner, p)))),
            "a point within the circle of {a:?} {b:?} {c:?}"
        );
    }
    assert_eq!(area, hull_area(mesh.points()), "the triangles fill the hull");
    triangles.len()
}

/// Twice the area of the hull, by Andrew's monotone half_hull.
fn hull_area(points: &[SupportPoint]) -> i64 {
    let half_hull = |points: &mut dyn Iterator<Item = SupportPoint>| {
        let mut hull: Vec<SupportPoint> = vec![];
        for p in points {
            // Points that turn right or lie straight on are not of the hull.
            while hull.len() >= 2 && orientation(hull[hull.len() - 2], hull[hull.len() - 1], p) <= 0
            {
                hull.pop();
            }
            hull.push(p);
        }
        // The last point begins the other half.
        hull.pop();
        hull
    };
    let mut hull = half_hull(&mut points.iter().copied());
    hull.extend(half_hull(&mut points.iter().rev().copied()));
    // By a fan of triangles from the first point.
    (1..hull.len().saturating_sub(1)).map(|i| orientation(hull[0], hull[i], hull[i + 1])).sum()
}

#[test]
fn random_points_have_empty_circles_and_fill_their_hull() {
    let mut random = Random::new(11);
    for (n, size) in [(3, 4), (7, 6), (40, 12), (150, 60), (300, 8_000)].repeat(12) {
        let points: Vec<_> = (0..n)
            .map(|_| point(random.below(size) as usize, random.below(size) as usize))
            .collect();
        check(&points);
    }
}

#[test]
fn grids_full_of_cocircular_and_collinear_points_are_triangulated_whole() {
    for (columns, rows) in [(2, 2), (9, 7), (1, 9), (9, 1), (14, 3)] {
        let points: Vec<_> =
            (0..columns * rows).map(|i| point(i % columns * 5, i / columns * 5)).collect();
        assert_eq!(check(&points), 2 * (columns - 1) * (rows - 1));
    }
    let mut random = Random::new(12);
    let thinned: Vec<_> = (0..15 * 15)
        .filter(|_| random.below(3) == 0)
        .map(|i| point(i % 15 * 5, i / 15 * 5))
        .collect();
    check(&thinned);
}

#[test]
fn lines_make_no_triangle_until_a_point_leaves_them() {
    for line in [[0, 1], [1, 0], [1, 1], [2, 3]] {
        let mut points: Vec<_> = (0..9).map(|i| point(i * line[0], i * line[1])).collect();
        assert_eq!(check(&points), 0);
        points.push(point(3, 40));
        assert_eq!(check(&points), 8);
    }
    assert_eq!(check(&[]), 0);
    assert_eq!(check(&[point(1, 1), point(1, 1)]), 0);
}

#[test]
fn of_two_points_at_one_place_the_nearer_stays() {
    let mut memory = vec![0u8; Triangulation::bytes(3) + SLAB_ALIGN];
    let skip = memory.as_ptr().align_offset(SLAB_ALIGN);
    let mut carver = Carver::new(&mut memory[skip..], 0).unwrap();
    let mut mesh = Triangulation::new_in(3, ["p", "t", "h"], &mut carver);
    let at = |u, disparity| SupportPoint { u, v: 2, disparity };
    let dropped =
        [at(9, 4), at(5, 7), at(9, 6), at(5, 3), at(7, 1), at(8, 1)].map(|point| mesh.add(point));
    assert_eq!(dropped, [false, false, true, true, false, true]);
    assert_eq!(mesh.points(), [at(5, 7), at(7, 1), at(9, 6)]);
}
