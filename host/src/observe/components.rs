//! Connected components of a mesh: surfaces, and fragments that float beside them.

use crate::formats::MeshVertex;
use hashbrown::hash_map::Entry;
use hashbrown::{HashMap, HashSet};

/// A component with a smaller share of the largest one's triangles is a surface only where it is near a larger one.
const SURFACE_SHARE: f64 = 0.05;
/// How near, in voxels.
const NEAR_VOXELS: f32 = 2.0;

/// The triangles of a mesh that belong to no floating fragment, in their order. Triangles are connected where they share a corner, to the last bit: meshing
/// gives neighbours the same corners. A small component stays where half of its triangles are near a surface, for there it is what is seen between gaps.
pub fn without_fragments(mut triangles: Vec<[MeshVertex; 3]>, voxel_size_m: f32) -> Vec<[MeshVertex; 3]> {
    let mut components = Components::default();
    let corners: Vec<usize> = triangles.iter().map(|corners| components.connect(corners)).collect();
    let roots: Vec<usize> = corners.into_iter().map(|corner| components.root(corner)).collect();
    let mut counts = vec![0usize; components.parents.len()];
    roots.iter().for_each(|&root| counts[root] += 1);
    let least = SURFACE_SHARE * counts.iter().copied().max().unwrap_or(0) as f64;
    let is_surface = |root: usize| counts[root] as f64 >= least;
    let of_surfaces = triangles.iter().zip(&roots).filter(|(_, root)| is_surface(**root));
    let cell = |corner: &MeshVertex| corner.position_m.map(|metres| (metres / (NEAR_VOXELS * voxel_size_m)).floor() as i32);
    let occupied: HashSet<[i32; 3]> = of_surfaces.flat_map(|(corners, _)| corners.each_ref().map(cell)).collect();
    let mut near = vec![0usize; counts.len()];
    for (corners, &root) in triangles.iter().zip(&roots).filter(|(_, root)| !is_surface(**root)) {
        near[root] += usize::from(around(cell(&corners[0])).any(|cell| occupied.contains(&cell)));
    }
    let mut roots = roots.into_iter();
    triangles.retain(|_| roots.next().is_some_and(|root| is_surface(root) || 2 * near[root] >= counts[root]));
    triangles
}

/// A cell and those around it.
fn around([x, y, z]: [i32; 3]) -> impl Iterator<Item = [i32; 3]> {
    (0..27).map(move |n| [x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1])
}

/// Corners joined into trees, one for each component.
#[derive(Default)]
struct Components {
    corners: HashMap<[u32; 3], usize>,
    /// The corner above each; roots are above themselves.
    parents: Vec<usize>,
}

impl Components {
    /// Joins the corners of a triangle, and gives the number of the first.
    fn connect(&mut self, corners: &[MeshVertex; 3]) -> usize {
        let [first, second, third] = corners.each_ref().map(|corner| self.number(corner));
        for other in [second, third] {
            let (root, above) = (self.root(other), self.root(first));
            self.parents[root] = above;
        }
        first
    }

    fn number(&mut self, corner: &MeshVertex) -> usize {
        // 0 and -0 are one position.
        match self.corners.entry(corner.position_m.map(|metres| (metres + 0.0).to_bits())) {
            Entry::Occupied(known) => *known.get(),
            Entry::Vacant(new) => {
                let number = self.parents.len();
                self.parents.push(number);
                *new.insert(number)
            }
        }
    }

    /// The root of a corner's tree. Paths are halved on the way, so that they stay short.
    fn root(&mut self, mut corner: usize) -> usize {
        while self.parents[corner] != corner {
            self.parents[corner] = self.parents[self.parents[corner]];
            corner = self.parents[corner];
        }
        corner
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of triangles from a coordinate on along x, as many as asked for, a decimetre each, and above the others.
    fn strip(start: i32, count: i32, above_m: f32) -> Vec<[MeshVertex; 3]> {
        let corner = |at: i32| MeshVertex {
            position_m: [(start + at) as f32 * 0.1, (at % 2) as f32 * 0.1, above_m],
            colour: [9; 3],
            weight: 1,
        };
        (0..count).map(|at| [corner(at), corner(at + 1), corner(at + 2)]).collect()
    }

    #[test]
    fn small_components_far_from_a_surface_go_and_the_rest_stays_in_order() {
        let (large, part, fragment, near) = (strip(0, 100, 0.0), strip(200, 5, 0.0), strip(20, 4, 0.3), strip(20, 4, 0.1));
        let mixed: Vec<_> = [&fragment[..], &large[50..], &near, &part, &large[..50]].concat();
        let positions = |triangles: &[[MeshVertex; 3]]| triangles.iter().map(|corners| corners[0].position_m).collect::<Vec<_>>();
        assert_eq!(
            positions(&without_fragments(mixed.clone(), 0.05)),
            positions(&mixed[4..]),
            "the halves of the long strip are connected"
        );
        assert!(without_fragments(Vec::new(), 0.05).is_empty());
    }
}
