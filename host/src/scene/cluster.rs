//! Mesh simplification by vertex clustering (Rossignac, Borrel, 1993): vertices in one cell of a
//! lattice become their mean.
//!
//! Triangles stream in, and memory is bounded by the result, not by the input: where too many would
//! stay, it is told how large cells have to be, and all begins again. Cells that grew in between
//! would not do: what was clustered before and what comes after would part along their borders. A
//! vertex counts once for all triangles that share it within [`RECENT`] numbers of vertices; one
//! that returns later counts again.

use super::IndexedMesh;
use dynvox_core::view::Vertex;
use hashbrown::{HashMap, HashSet};
use std::io;

/// Cells for each triangle that may stay: small fragments have cells and no triangle.
const CELLS_PER_TRIANGLE: usize = 2;
/// Vertices whose cell is remembered: what triangles share lies near each other in a file.
const RECENT: usize = 1 << 16;

/// A vertex and its cluster, by number.
#[derive(Clone, Copy)]
struct Recent {
    vertex: u32,
    cluster: u32,
}

impl Recent {
    /// No cluster yet: no mesh has clusters of this number.
    const NONE: Self = Self { vertex: 0, cluster: u32::MAX };
}

/// The vertices of one cell.
#[derive(Clone, Copy, Default)]
struct Cluster {
    position_sum_m: [f64; 3],
    count: u32,
    colour_sum: [u32; 3],
    coloured: u32,
    weight_sum: u32,
}

impl Cluster {
    fn add(&mut self, Vertex { position_m, colour, weight }: Vertex) {
        for axis in 0..3 {
            self.position_sum_m[axis] += f64::from(position_m[axis]);
            self.colour_sum[axis] = self.colour_sum[axis].saturating_add(colour[axis].into());
        }
        self.count = self.count.saturating_add(1);
        self.coloured = self.coloured.saturating_add((colour != [0; 3]).into());
        self.weight_sum = self.weight_sum.saturating_add(weight.into());
    }

    fn position_m(&self) -> [f32; 3] {
        self.position_sum_m.map(|sum| (sum / f64::from(self.count)) as f32)
    }

    /// Mean of the observations.
    fn weight(&self) -> u8 {
        mean(self.weight_sum, self.count)
    }

    fn colour(&self) -> [u8; 3] {
        self.colour_sum.map(|sum| if self.coloured == 0 { 0 } else { mean(sum, self.coloured) })
    }
}

/// The mean of so many bytes with this sum.
fn mean(sum: u32, count: u32) -> u8 {
    (f64::from(sum) / f64::from(count)).round() as u8
}

/// A mesh that is simplified while it comes in.
pub struct VertexClustering {
    max_triangles: usize,
    cell_m: f32,
    cells: HashMap<[i32; 3], u32>,
    clusters: Vec<Cluster>,
    /// Each in the slot of its number.
    recent: Vec<Recent>,
    triangles: Vec<[u32; 3]>,
    /// Corners of the triangles in ascending order: two sides of a thin sheet would flicker.
    known: HashSet<[u32; 3]>,
}

impl VertexClustering {
    /// Cells of this side, and so many triangles at most.
    pub fn new(cell_m: f32, max_triangles: usize) -> Self {
        Self {
            max_triangles,
            cell_m,
            cells: HashMap::new(),
            clusters: Vec::new(),
            recent: vec![Recent::NONE; RECENT],
            triangles: Vec::new(),
            known: HashSet::new(),
        }
    }

    /// Adds a triangle by the numbers of its vertices in the mesh that comes in; `vertex` tells
    /// those that are not known. Returns whether it counts: a triangle with a vertex that is
    /// `None`, or nowhere, does not.
    ///
    /// # Errors
    /// `vertex` fails.
    pub fn add(
        &mut self,
        corners: [u32; 3],
        mut vertex: impl FnMut(u32) -> io::Result<Option<Vertex>>,
    ) -> io::Result<bool> {
        let [a, b, c] = corners;
        let Some(a) = self.cluster_of(a, &mut vertex)? else { return Ok(false) };
        let Some(b) = self.cluster_of(b, &mut vertex)? else { return Ok(false) };
        let Some(c) = self.cluster_of(c, &mut vertex)? else { return Ok(false) };
        self.connect([a, b, c]);
        Ok(true)
    }

    /// Triangles that stay.
    pub fn triangles(&self) -> usize {
        self.triangles.len()
    }

    /// Returns true if more triangles stay than may.
    pub fn is_full(&self) -> bool {
        self.triangles.len() > self.max_triangles
            || self.clusters.len() > CELLS_PER_TRIANGLE * self.max_triangles
    }

    /// The number of the cell that a vertex is in; it counts there unless it has just done so.
    fn cluster_of(
        &mut self,
        number: u32,
        vertex: impl FnOnce(u32) -> io::Result<Option<Vertex>>,
    ) -> io::Result<Option<u32>> {
        let slot = number as usize % RECENT;
        // Neighbouring triangles share vertices: most are still among the recent ones.
        let known = self.recent[slot];
        if known.vertex == number && known.cluster != Recent::NONE.cluster {
            return Ok(Some(known.cluster));
        }
        let Some(vertex) = vertex(number)?
            .filter(|vertex| vertex.position_m.iter().all(|metres| metres.is_finite()))
        else {
            return Ok(None);
        };
        // The vertex counts in its cell's mean.
        let cluster = self.cluster(vertex);
        self.recent[slot] = Recent { vertex: number, cluster };
        Ok(Some(cluster))
    }

    /// Adds a vertex to its cell and returns its number.
    fn cluster(&mut self, vertex: Vertex) -> u32 {
        let cell = vertex.position_m.map(|metres| (metres / self.cell_m).floor() as i32);
        let number = *self.cells.entry(cell).or_insert(self.clusters.len() as u32);
        if number as usize == self.clusters.len() {
            self.clusters.push(Cluster::default());
        }
        self.clusters[number as usize].add(vertex);
        number
    }

    /// Adds a triangle between cells, unless it is a line, a point or there already.
    fn connect(&mut self, triangle: [u32; 3]) {
        let [a, b, c] = triangle;
        if a == b || b == c || c == a {
            return;
        }
        let mut sorted = triangle;
        sorted.sort_unstable();
        if self.known.insert(sorted) {
            self.triangles.push(triangle);
        }
    }

    /// The mesh: vertices in the order in which triangles name them.
    pub fn finish(self) -> IndexedMesh {
        // `u32::MAX` is not numbered yet. Clusters that no triangle names are left out.
        let mut numbers = vec![u32::MAX; self.clusters.len()];
        let mut mesh = IndexedMesh::default();
        for triangle in &self.triangles {
            let corners = triangle.map(|corner| {
                let (number, cluster) =
                    (&mut numbers[corner as usize], &self.clusters[corner as usize]);
                if *number == u32::MAX {
                    *number = mesh.positions_m.len() as u32;
                    mesh.positions_m.push(cluster.position_m());
                    mesh.colours.push(cluster.colour());
                    mesh.weights.push(cluster.weight());
                }
                *number
            });
            mesh.triangles.push(corners);
        }
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Adds a triangle of vertices that come with their numbers.
    fn add(clustering: &mut VertexClustering, corners: [(u32, Vertex); 3]) -> bool {
        let vertex =
            |number| Ok(corners.iter().find(|(own, _)| *own == number).map(|(_, vertex)| *vertex));
        clustering.add(corners.map(|(number, _)| number), vertex).unwrap()
    }

    #[test]
    fn a_plane_keeps_its_extent_and_surface() {
        let mut clustering = VertexClustering::new(0.15, 10_000);
        let side = 100;
        let corner = |x: u32, y: u32| {
            let position_m = [0.05 * x as f32, 0.05 * y as f32, 2.0];
            (x + y * (side + 1), Vertex { position_m, colour: [200, x as u8, 0], weight: 0 })
        };
        for (x, y) in (0..side * side).map(|at| (at % side, at / side)) {
            add(&mut clustering, [corner(x, y), corner(x + 1, y), corner(x, y + 1)]);
            add(&mut clustering, [corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)]);
        }
        // Cells of 0.15 m over squares of 0.05 m: about nine vertices become one.
        let mesh = clustering.finish();
        let [low, high] = mesh.bounds_m().unwrap();
        // Clusters lie at the mean of their vertices, and so a little within the border.
        assert!(
            low[0] < 0.2 && high[0] > 4.8 && low[2] == 2.0 && high[2] == 2.0,
            "{low:?} {high:?}"
        );
        let area = |[a, b, c]: [[f32; 3]; 3]| {
            0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
        };
        let whole: f32 = mesh
            .triangles
            .iter()
            .map(|triangle| area(triangle.map(|corner| mesh.positions_m[corner as usize])))
            .sum();
        assert!((22.0..=25.1).contains(&whole), "of 25 square metres {whole} are covered once");
        assert!(mesh.normals().iter().all(|normal| normal[2] > 0.999));
    }

    #[test]
    fn the_two_sides_of_a_sheet_become_one_and_nonsense_is_left_out() {
        let mut clustering = VertexClustering::new(0.03, 10);
        let corner = |number: u32, position_m: [f32; 3]| {
            (number, Vertex { position_m, ..Vertex::default() })
        };
        let corners =
            [corner(0, [0.0, 0.0, 1.0]), corner(1, [1.0, 0.0, 1.0]), corner(2, [0.0, 1.0, 1.0])];
        assert!(add(&mut clustering, corners));
        add(&mut clustering, [corners[0], corners[2], corners[1]]);
        assert!(!add(&mut clustering, [corners[0], corners[1], corner(3, [f32::NAN, 0.0, 0.0])]));
        assert_eq!(clustering.finish().triangles, [[0, 1, 2]]);
    }

    #[test]
    fn a_vertex_counts_once_however_many_triangles_share_it() {
        let corner = |number: u32, x: f32, y: f32| {
            (number, Vertex { position_m: [x, y, 1.0], ..Vertex::default() })
        };
        // A fan: its centre, and a vertex of one triangle in the same cell.
        let (centre, beside) = (corner(0, 0.01, 0.0), corner(1, 0.02, 0.0));
        let rim = [(0.5, 0.0), (0.0, 0.5), (-0.5, 0.0), (0.0, -0.5)];
        let rim: Vec<_> = (2..).zip(rim).map(|(number, (x, y))| corner(number, x, y)).collect();
        let mut clustering = VertexClustering::new(0.03, 10);
        for pair in rim.windows(2) {
            add(&mut clustering, [centre, pair[0], pair[1]]);
        }
        add(&mut clustering, [beside, rim[3], rim[0]]);
        let x_m = clustering.finish().positions_m[0][0];
        assert!((x_m - 0.015).abs() < 1e-6, "{x_m}: the mean of two vertices, not of four corners");
    }
}
