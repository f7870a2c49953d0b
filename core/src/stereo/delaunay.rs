//! Delaunay triangulation of points in scan order, exact, iterative, in fixed memory.
//!
//! Points are inserted in the order of their rows, then columns, so that each lies outside the hull
//! of those before it: it is joined to the hull edges it sees, and the edges opposite to it are
//! flipped until all are locally Delaunay (Lawson). The triangles about the new point form a fan
//! from one hull neighbour to the other, so a walk along the fan visits every edge in question: no
//! stack. Predicates are integer determinants: with coordinates below 2^13 the in-circle one stays
//! below 2^57.
//!
//! Corners are below the number of points and half-edges below six times that, as a planar
//! triangulation of n points has at most 2n triangles: reading beyond a table ([`Table`]) does not
//! happen, and would be no half-edge; writing beyond it would do nothing.
//!
//! Memory: 66 bytes a point. Time: about linear on street scenes (a few flips a point). Four points
//! on one circle keep the diagonal that the order of insertion gives. Points on one line make no
//! triangle.

use crate::{
    memory::{Carver, region_bytes},
    slices::clipped,
};
use bytemuck::{Pod, Zeroable};

/// A support point of one image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct SupportPoint {
    /// Column, px.
    pub u: u16,
    /// Row, px.
    pub v: u16,
    /// Disparity, px.
    pub disparity: u16,
}

/// No half-edge on the other side: the edge is on the hull.
const NONE: u32 = u32::MAX;

/// Numbers by number.
struct Table<'s>(&'s mut [u32]);

impl Table<'_> {
    #[inline(always)]
    fn get(&self, at: u32) -> u32 {
        self.0.get(at as usize).copied().unwrap_or(NONE)
    }

    #[inline(always)]
    fn set(&mut self, at: u32, value: u32) {
        if let Some(slot) = self.0.get_mut(at as usize) {
            *slot = value;
        }
    }
}

/// Triangles as half-edges: triangle t has the corners `corner[3t..3t + 3]`, half-edge h runs from
/// `corner[h]` to the next corner of its triangle and `twin[h]` is the same edge seen from the
/// other side.
pub(super) struct Triangulation<'s> {
    points: &'s mut [SupportPoint],
    corner: Table<'s>,
    twin: Table<'s>,
    hull_next: Table<'s>,
    hull_previous: Table<'s>,
    hull_edge: Table<'s>,
    len: usize,
    triangles: usize,
}

/// The half-edge before one in its triangle.
#[inline(always)]
fn previous(half_edge: u32) -> u32 {
    if half_edge.is_multiple_of(3) { half_edge + 2 } else { half_edge - 1 }
}

/// A point as seen from another.
#[derive(Clone, Copy)]
struct Offset {
    x: i64,
    y: i64,
    /// Square of its length.
    square: i64,
}

impl Offset {
    #[inline(always)]
    fn new(point: SupportPoint, from: SupportPoint) -> Self {
        let (x, y) =
            (i64::from(point.u) - i64::from(from.u), i64::from(point.v) - i64::from(from.v));
        Self { x, y, square: x * x + y * y }
    }

    /// Twice the signed area of the triangle with another and the point that both are seen from.
    #[inline(always)]
    fn cross(self, other: Self) -> i64 {
        self.x * other.y - self.y * other.x
    }
}

/// Twice the signed area of the triangle a, b, c.
fn orientation(a: SupportPoint, b: SupportPoint, c: SupportPoint) -> i64 {
    Offset::new(b, a).cross(Offset::new(c, a))
}

/// Returns true if the point from which a, b and c are seen lies strictly within the circle through
/// them, whose orientation is positive.
#[inline(always)]
fn in_circle([a, b, c]: [Offset; 3]) -> bool {
    a.square * b.cross(c) - b.square * a.cross(c) + c.square * a.cross(b) > 0
}

impl<'s> Triangulation<'s> {
    /// Bytes of the slab for `points` points.
    pub const fn bytes(points: usize) -> usize {
        region_bytes::<SupportPoint>(points)
            + 2 * region_bytes::<u32>(6 * points)
            + 3 * region_bytes::<u32>(points)
    }

    /// Takes buffers for `points` points from the slab.
    pub fn new_in(points: usize, names: [&'static str; 3], carver: &mut Carver<'s>) -> Self {
        let [points_name, triangles_name, hull_name] = names;
        Self {
            points: carver.alloc(points_name, points),
            corner: Table(carver.alloc(triangles_name, 6 * points)),
            twin: Table(carver.alloc(triangles_name, 6 * points)),
            hull_next: Table(carver.alloc(hull_name, points)),
            hull_previous: Table(carver.alloc(hull_name, points)),
            hull_edge: Table(carver.alloc(hull_name, points)),
            len: 0,
            triangles: 0,
        }
    }

    /// Forgets all points and triangles.
    pub fn clear(&mut self) {
        self.len = 0;
        self.triangles = 0;
    }

    /// Adds a point in scan order; within a row points may come in any order. The nearer of two
    /// points at one pixel, with the larger disparity, stays. Returns whether a point was dropped:
    /// this one, as the buffer is full, or the farther one.
    pub fn add(&mut self, point: SupportPoint) -> bool {
        let key = |p: &SupportPoint| (p.v, p.u);
        let points = self.points.get_mut(..self.len).unwrap_or_default();
        // From the end: points come nearly sorted, and most belong last.
        let at = points.iter().rposition(|other| key(other) <= key(&point));
        if let Some(twin) =
            at.and_then(|i| points.get_mut(i)).filter(|other| key(other) == key(&point))
        {
            twin.disparity = twin.disparity.max(point.disparity);
            return true;
        }
        let at = at.map_or(0, |i| i + 1);
        // All behind it move by one.
        let Some(behind) = self.points.get_mut(at..self.len + 1) else { return true };
        // The last swap carries out the unused slot at the end.
        let mut carried = point;
        behind.iter_mut().for_each(|slot| core::mem::swap(slot, &mut carried));
        self.len += 1;
        false
    }

    /// The points.
    pub fn points(&self) -> &[SupportPoint] {
        clipped(self.points, ..self.len)
    }

    /// The corners of all triangles, in the order in which they were made.
    pub fn triangles(&self) -> impl Iterator<Item = [SupportPoint; 3]> + '_ {
        let corners = self.corner.0.as_chunks::<3>().0;
        corners.iter().take(self.triangles).map(|corners| corners.map(|point| self.point(point)))
    }

    /// A point by its number.
    #[inline(always)]
    fn point(&self, number: u32) -> SupportPoint {
        self.points.get(number as usize).copied().unwrap_or_default()
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.triangles
    }

    /// Triangulates the points added so far.
    pub fn triangulate(&mut self) {
        self.triangles = 0;
        let Some(apex) = (2..self.len as u32)
            .find(|&i| orientation(self.point(0), self.point(1), self.point(i)) != 0)
        else {
            return;
        };
        self.begin(apex);
        for p in apex + 1..self.len as u32 {
            let first = self.join(p);
            self.legalise(p, first);
        }
    }

    /// The points before `apex` lie on one line: a fan joins them to it, and there is no other
    /// triangulation.
    fn begin(&mut self, apex: u32) {
        let left_turn = orientation(self.point(0), self.point(1), self.point(apex)) > 0;
        // The hull in positive orientation: along the line, or back along it, then the apex.
        let on_line = |i: u32| if left_turn { i } else { apex - 1 - i };
        let p = apex;
        for i in 0..apex - 1 {
            let (a, b) = (on_line(i), on_line(i + 1));
            let t = self.push([a, b, p]);
            if i > 0 {
                self.link(3 * t + 2, 3 * (t - 1) + 1);
            }
            self.hull_link(a, b, 3 * t);
        }
        let (first, last) = (on_line(0), on_line(apex - 1));
        self.hull_link(last, p, 3 * (apex - 2) + 1);
        self.hull_link(p, first, 2);
    }

    /// Joins p to every hull edge it sees; returns the first of the new triangles in hull order.
    /// All have p as third corner.
    fn join(&mut self, p: u32) -> u32 {
        // The point before p is on the hull, and p sees at least one of its two hull edges: it
        // comes after both in scan order.
        let mut a = p - 1;
        while self.sees(p, self.hull_previous.get(a)) {
            a = self.hull_previous.get(a);
        }
        let (start, first) = (a, self.triangles as u32);
        while self.sees(p, a) {
            let b = self.hull_next.get(a);
            let t = self.push([b, a, p]);
            self.link(3 * t, self.hull_edge.get(a));
            if t != first {
                // Neighbours in the fan share the edge between a and p.
                self.link(3 * t + 1, 3 * (t - 1) + 2);
            }
            a = b;
        }
        // p replaces the hull points between the first and the last one that it sees.
        self.hull_link(start, p, 3 * first + 1);
        self.hull_link(p, a, 3 * (self.triangles as u32 - 1) + 2);
        first
    }

    /// Flips the edges opposite to p that are not Delaunay, walking along the fan about p from
    /// triangle t = (b, a, p).
    fn legalise(&mut self, p: u32, mut t: u32) {
        let at_p = self.point(p);
        let seen =
            |mesh: &Self, half_edge: u32| Offset::new(mesh.point(mesh.corner.get(half_edge)), at_p);
        // What the next triangle shares with this one is not asked for again.
        let (mut a, mut b) = (seen(self, 3 * t + 1), seen(self, 3 * t));
        loop {
            let opposite = self.twin.get(3 * t);
            if opposite != NONE {
                let c = seen(self, previous(opposite));
                // A corner c within the circle means that the other diagonal is Delaunay. The flip
                // gives t a new outer edge, so t is tested again.
                if in_circle([a, b, c]) {
                    self.flip(p, t, opposite);
                    b = c;
                    continue;
                }
            }
            // Edge 2 leads to the next triangle of the fan, which ends at the hull.
            let next = self.twin.get(3 * t + 2);
            if next == NONE {
                return;
            }
            t = next / 3;
            (a, b) = (b, seen(self, 3 * t));
        }
    }

    /// Makes of triangle t = (b, a, p) and, beyond its edge b-a, (a, b, c) the triangles (c, a, p)
    /// and (b, c, p).
    fn flip(&mut self, p: u32, t: u32, opposite: u32) {
        let other = opposite / 3;
        let (after, before) = (previous(previous(opposite)), previous(opposite));
        let (b, c) = (self.corner.get(after), self.corner.get(before));
        let (beyond_bc, beyond_ca, beyond_pb) =
            (self.twin.get(after), self.twin.get(before), self.twin.get(3 * t + 2));
        self.corner.set(3 * t, c);
        for (corner, point) in (3 * other..).zip([b, c, p]) {
            self.corner.set(corner, point);
        }
        self.link_or_hull(3 * t, beyond_ca, c);
        self.link_or_hull(3 * other, beyond_bc, b);
        self.link_or_hull(3 * other + 2, beyond_pb, p);
        self.link(3 * t + 2, 3 * other + 1);
    }

    /// Returns true if p lies strictly outside the hull edge that begins at a.
    fn sees(&self, p: u32, a: u32) -> bool {
        let at = |i: u32| self.point(i);
        orientation(at(a), at(self.hull_next.get(a)), at(p)) < 0
    }

    fn push(&mut self, corners: [u32; 3]) -> u32 {
        let t = self.triangles as u32;
        for (half_edge, corner) in (3 * t..).zip(corners) {
            self.corner.set(half_edge, corner);
            self.twin.set(half_edge, NONE);
        }
        self.triangles += 1;
        t
    }

    fn link(&mut self, h: u32, g: u32) {
        self.twin.set(h, g);
        self.twin.set(g, h);
    }

    fn link_or_hull(&mut self, h: u32, g: u32, origin: u32) {
        if g == NONE {
            self.twin.set(h, NONE);
            self.hull_edge.set(origin, h);
        } else {
            self.link(h, g);
        }
    }

    fn hull_link(&mut self, a: u32, b: u32, edge: u32) {
        self.hull_next.set(a, b);
        self.hull_previous.set(b, a);
        self.hull_edge.set(a, edge);
    }
}

#[cfg(test)]
mod tests;
