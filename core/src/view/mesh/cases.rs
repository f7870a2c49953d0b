//! Triangles that cut a cell, for each of the 256 ways its corners can lie inside or outside.
//!
//! The table is worked out at compile time from one rule on faces, not typed in. On each face,
//! every run of neighbouring inside corners is cut off by one segment: so where two inside corners
//! face each other diagonally, each is cut off alone. The rule looks at the four corners of the
//! face and at nothing else, so the two cells that share a face draw the same segments on it, and
//! the surface has no cracks by construction (the holes of Lorensen and Cline's original table come
//! from breaking exactly this; Nielson, Hamann, *The Asymptotic Decider*, 1991). Each cut edge
//! begins one segment and ends one, hence segments close to loops; a loop becomes a fan.
//!
//! Corner `x + 2 y + 4 z` of a cell is the lattice point (x, y, z) steps from its base; edge
//! `4 axis + k` runs along `axis`.

/// Edges of a cell.
pub const EDGE_COUNT: usize = 12;
/// Most triangles in a cell.
pub const MAX_TRIANGLES: usize = 5;

/// The corner each edge starts from; it runs to the corner `1 << axis` further.
pub const EDGE_START: [usize; EDGE_COUNT] = [0, 2, 4, 6, 0, 4, 1, 5, 0, 1, 2, 3];

/// The axis along which an edge runs.
pub const fn edge_axis(edge: usize) -> usize {
    edge / 4
}

/// Triangles of the surface in a cell.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Bit `e`: edge `e` is cut.
    pub edges: u16,
    /// Triangles, the first `count` of them, as edges, counter-clockwise seen from the outside
    /// corners.
    pub triangles: [[u8; 3]; MAX_TRIANGLES],
    /// Number of triangles.
    pub count: u8,
}

/// By inside corners: bit `c` is set where corner `c` lies inside.
pub static CASES: [Case; 256] = all_cases();

#[expect(
    clippy::indexing_slicing,
    reason = "evaluated at compile time, where a wrong index does not compile"
)]
const fn all_cases() -> [Case; 256] {
    let mut cases = [Case { edges: 0, triangles: [[0; 3]; MAX_TRIANGLES], count: 0 }; 256];
    let mut inside = 0;
    while inside < 256 {
        cases[inside] = case(inside);
        inside += 1;
    }
    cases
}

/// The edge between two neighbouring corners.
#[expect(
    clippy::indexing_slicing,
    reason = "evaluated at compile time, where a wrong index does not compile"
)]
const fn edge_between(a: usize, b: usize) -> usize {
    let start = a & b;
    let mut edge = 0;
    while EDGE_START[edge] != start || 1 << edge_axis(edge) != a ^ b {
        edge += 1;
    }
    edge
}

/// The corners of a face, counter-clockwise seen from outside the cell.
const fn face_corners(axis: usize, side: usize) -> [usize; 4] {
    let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    let base = side << axis;
    if side == 1 {
        [base, base + u, base + u + v, base + v]
    } else {
        [base, base + v, base + u + v, base + u]
    }
}

/// From each cut edge, the edge at which the segment that begins there ends.
#[expect(
    clippy::indexing_slicing,
    reason = "evaluated at compile time, where a wrong index does not compile"
)]
const fn segments(inside: usize) -> [usize; EDGE_COUNT] {
    let mut next = [EDGE_COUNT; EDGE_COUNT];
    let mut face = 0;
    while face < 6 {
        let corners = face_corners(face / 2, face % 2);
        let mut i = 0;
        while i < 4 {
            let before = corners[(i + 3) % 4];
            // Each face is cut by segments that have the inside on one side, so that they form
            // rings.
            if inside >> corners[i] & 1 == 1 && inside >> before & 1 == 0 {
                // A run of inside corners begins at i: walk to its end.
                let mut end = i;
                while inside >> corners[(end + 1) % 4] & 1 == 1 {
                    end += 1;
                }
                let last = corners[end % 4];
                next[edge_between(before, corners[i])] = edge_between(last, corners[(end + 1) % 4]);
            }
            i += 1;
        }
        face += 1;
    }
    next
}

#[expect(
    clippy::indexing_slicing,
    reason = "evaluated at compile time, where a wrong index does not compile"
)]
const fn case(inside: usize) -> Case {
    let next = segments(inside);
    let mut case = Case { edges: 0, triangles: [[0; 3]; MAX_TRIANGLES], count: 0 };
    let mut start = 0;
    while start < EDGE_COUNT {
        // A segment that no triangle has used starts a new ring.
        if next[start] < EDGE_COUNT && case.edges >> start & 1 == 0 {
            let mut ring = [0; EDGE_COUNT];
            let mut len = 0;
            let mut edge = start;
            while case.edges >> edge & 1 == 0 {
                case.edges |= 1 << edge;
                ring[len] = edge;
                len += 1;
                edge = next[edge];
            }
            // A fan of triangles from the corner whose diagonals lie least in the cell's faces.
            let apex = best_apex(&ring, len);
            let mut i = 1;
            while i + 1 < len {
                case.triangles[case.count as usize] = [
                    ring[apex] as u8,
                    ring[(apex + i) % len] as u8,
                    ring[(apex + i + 1) % len] as u8,
                ];
                case.count += 1;
                i += 1;
            }
        }
        start += 1;
    }
    case
}

/// Returns true if two edges lie on one face.
#[expect(
    clippy::indexing_slicing,
    reason = "evaluated at compile time, where a wrong index does not compile"
)]
const fn share_a_face(a: usize, b: usize) -> bool {
    let mut axis = 0;
    while axis < 3 {
        if edge_axis(a) != axis
            && edge_axis(b) != axis
            && (EDGE_START[a] ^ EDGE_START[b]) >> axis & 1 == 0
        {
            return true;
        }
        axis += 1;
    }
    false
}

/// The corner of a loop from which a fan has the fewest diagonals within a face, where the
/// neighbouring cell might draw the same one.
#[expect(
    clippy::indexing_slicing,
    reason = "evaluated at compile time, where a wrong index does not compile"
)]
const fn best_apex(ring: &[usize; EDGE_COUNT], len: usize) -> usize {
    let (mut best, mut fewest) = (0, EDGE_COUNT);
    let mut apex = 0;
    while apex < len {
        let mut within_faces = 0;
        let mut i = 2;
        while i + 1 < len {
            // A diagonal in a face would meet the neighbouring cell's triangles with an edge they
            // do not have.
            if share_a_face(ring[apex], ring[(apex + i) % len]) {
                within_faces += 1;
            }
            i += 1;
        }
        if within_faces < fewest {
            (best, fewest) = (apex, within_faces);
        }
        apex += 1;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{collections::BTreeMap, vec::Vec};

    /// Directed sides of a case's triangles that no other of its triangles takes back.
    fn rim(case: &Case) -> Vec<(u8, u8)> {
        // Two triangles of a case share a side in opposite directions; what is left is the border.
        let mut sides = BTreeMap::new();
        for triangle in &case.triangles[..usize::from(case.count)] {
            for i in 0..3 {
                let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
                if sides.remove(&(b, a)).is_none() {
                    assert!(
                        sides.insert((a, b), ()).is_none(),
                        "a side is drawn once in each direction"
                    );
                }
            }
        }
        sides.into_keys().collect()
    }

    fn on_face(edge: u8, axis: usize, side: usize) -> bool {
        edge_axis(edge.into()) != axis && EDGE_START[usize::from(edge)] >> axis & 1 == side
    }

    #[test]
    fn every_cut_edge_has_a_vertex_and_no_other_has() {
        // Of all 256 cases: the corners within the surface as bits.
        for (inside, case) in CASES.iter().enumerate() {
            let mut used = 0u16;
            case.triangles[..usize::from(case.count)]
                .iter()
                .flatten()
                .for_each(|&edge| used |= 1 << edge);
            for (edge, &start) in EDGE_START.iter().enumerate() {
                // An edge is cut where one of its ends lies inside.
                let is_cut =
                    (inside >> start ^ inside >> (start + (1 << edge_axis(edge)))) & 1 == 1;
                assert_eq!(
                    (used >> edge & 1 == 1, case.edges >> edge & 1 == 1),
                    (is_cut, is_cut),
                    "case {inside:08b}, edge {edge}"
                );
            }
        }
    }

    #[test]
    fn all_pairs_of_cases_meet_on_their_shared_face_without_a_crack() {
        for axis in 0..3 {
            let mut by_signs: BTreeMap<(usize, usize), Vec<(u8, u8)>> = BTreeMap::new();
            for (inside, case) in CASES.iter().enumerate() {
                for side in 0..2 {
                    let corners = face_corners(axis, 1).map(|corner| corner & !(1 << axis));
                    let signs = corners
                        .iter()
                        .enumerate()
                        .fold(0, |signs, (i, c)| signs | (inside >> (c | side << axis) & 1) << i);
                    // Name edges by their place on the face, whichever side it is on, and turn one
                    // side's segments round.
                    let name = |edge: u8| edge_between_faces(edge, axis);
                    let mut rim: Vec<_> = rim(case)
                        .into_iter()
                        .filter(|&(a, b)| on_face(a, axis, side) && on_face(b, axis, side))
                        .map(
                            |(a, b)| {
                                if side == 0 { (name(a), name(b)) } else { (name(b), name(a)) }
                            },
                        )
                        .collect();
                    rim.sort_unstable();
                    match by_signs.get(&(axis, signs)) {
                        Some(other) => {
                            assert_eq!(&rim, other, "case {inside:08b}, axis {axis}, side {side}")
                        }
                        None => drop(by_signs.insert((axis, signs), rim)),
                    }
                }
            }
            assert_eq!(by_signs.len(), 16);
        }
    }

    fn edge_between_faces(edge: u8, axis: usize) -> u8 {
        let start = EDGE_START[usize::from(edge)] & !(1 << axis);
        edge_between(start, start + (1 << edge_axis(edge.into()))) as u8
    }

    #[test]
    fn no_diagonal_lies_within_a_face_where_a_neighbour_could_draw_it_too() {
        for (inside, case) in CASES.iter().enumerate() {
            // The segments that the case draws on the faces of its cube.
            let next = segments(inside);
            for triangle in &case.triangles[..usize::from(case.count)] {
                for i in 0..3 {
                    let (a, b) = (usize::from(triangle[i]), usize::from(triangle[(i + 1) % 3]));
                    // A segment of a face is shared with the neighbour, and so must be its only
                    // line there.
                    assert!(
                        next[a] == b || next[b] == a || !share_a_face(a, b),
                        "case {inside:08b}: {a} {b}"
                    );
                }
            }
        }
    }
}
